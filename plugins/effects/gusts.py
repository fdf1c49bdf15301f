"""Gusts: turbulence of air or water about its mean flow."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import ClassVar

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.effects import Identification
from seals.effects.effect import Effect, MediumKind, Parameters
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.motion import Inputs, Medium, Motion
from seals.schema import count, param, setting

_FOOT = 0.3048
_VK = 1.339
"""Number of the von Karman spectra: sqrt(pi) Gamma(5/6) / Gamma(1/3) = 1.339."""
_MIL = "MIL-F-8785C, 3.7: medium and high altitude, 1750 ft"


class GustSpectrum(Enum):
    """Form of the spectra over the wavenumber."""

    dryden = "dryden"
    """Rational in the wavenumber."""
    von_karman = "von_karman"
    """With the -5/3 slope of the inertial range."""


@roles(data="links")
@dataclass(kw_only=True)
class Gusts(Effect):
    """Frozen turbulence that the mean flow carries past; adds to wind or current.

    Equation:
        One-sided spectra over the wavenumber k [rad/m] of the component along the heading
        ``dryden`` 2 s^2 L / (pi (1 + (L k)^2)), ``von_karman`` 2 s^2 L / (pi (1 + (a L k)^2)^(5/6))
        and of those across it and upward
        ``dryden`` s^2 L (1 + 3 (L k)^2) / (pi (1 + (L k)^2)^2),
        ``von_karman`` s^2 L (1 + 8/3 (a L k)^2) / (pi (1 + (a L k)^2)^(11/6)), a = 1.339.
        u = s sqrt(2/n) sum_i cos(k_i (V t - x_along) + phi_i): n waves of equal variance, whose k_i
        are the quantiles of the spectrum, one drawn in each n-th of it, with random phases.
        With an altitude h and W, the wind at 6.1 m (20 ft), after MIL-F-8785C at low altitude:
        s_z = 0.1 W, s_x = s_y = s_z / g^0.4, L_z = h, L_x = L_y = h / g^1.2,
        g = 0.177 + 0.000823 h, h in feet.

    Args:
        deviation_x: s along the heading, standard deviation [m/s].
        deviation_y: s across, toward the left [m/s].
        deviation_z: s upward [m/s].
        length_x: L, scale of the turbulence along the heading [m].
        length_y: of the component across [m].
        length_z: of the upward component [m].
        speed: V, of the mean flow, which carries the field past a point at rest [m/s].
        heading: toward which it is carried, from east anticlockwise [rad].
        altitude: h above the ground [m]; deviations and scales follow from it and ``low_wind``,
            unless it is zero.
        low_wind: W, mean wind at 6.1 m, for ``altitude`` [m/s].
        spectrum: dryden or von_karman.
        waves: n, of each component.
        seed: of wavenumbers and phases.
        medium: air by default; water for a turbulent current.
        links: links it acts on, all by default.

    Assumptions:
        The turbulence does not change while it passes (Taylor 1938), nor from side to side: all
        points of a plane across the heading feel the same gust at a time. A vehicle that moves
        along the heading meets the waves at its own speed through the air.

    Valid range:
        Vehicles much smaller than the scales; with ``altitude`` 3 to 305 m (10 to 1000 ft).

    Limitations:
        Gradients over a vehicle, and with them the gust rates p, q and r, are those of its links
        apart. The change of a gust in time is no acceleration of the medium by itself: a light
        body in water misses that part. The highest 1/(2 n) of the variance is one wave. A log does
        not tell the waves apart: a diagnosis takes the force of gusts from ``disturbance``.

    References:
        MIL-F-8785C 1980, Flying Qualities of Piloted Airplanes, 3.7.1 to 3.7.3; MIL-HDBK-1797 has
        the same spectra across and upward with 2 L for L and half the scale; von Karman 1948, Proc.
        Natl. Acad. Sci. 34; Shinozuka and Deodatis 1991, Appl. Mech. Rev. 44 (sums of waves).

    Example:
        >>> gusts = Gusts(altitude=30.48, low_wind=10.0)
        >>> round(gusts.deviation_z, 3), round(gusts.deviation_x, 3), round(gusts.length_x, 1)
        (1.0, 1.716, 154.0)
    """

    deviation_x: float = param(
        0.0, "m/s", bounds=(0.0, 30.0), tolerance=0.3, relative=True, source="calm by default"
    )
    deviation_y: float = param(
        0.0, "m/s", bounds=(0.0, 30.0), tolerance=0.3, relative=True, source="calm by default"
    )
    deviation_z: float = param(
        0.0, "m/s", bounds=(0.0, 30.0), tolerance=0.3, relative=True, source="calm by default"
    )
    length_x: float = param(
        533.4, "m", bounds=(0.01, 1e5), tolerance=0.3, relative=True, source=_MIL
    )
    length_y: float = param(
        533.4, "m", bounds=(0.01, 1e5), tolerance=0.3, relative=True, source=_MIL
    )
    length_z: float = param(
        533.4, "m", bounds=(0.01, 1e5), tolerance=0.3, relative=True, source=_MIL
    )
    speed: float = param(5.0, "m/s", bounds=(0.0, 100.0), tolerance=0.5, source="chosen")
    heading: float = param(0.0, "rad", bounds=(-7.0, 7.0), tolerance=0.1, source="chosen: east")
    altitude: float = setting(0.0, "m", bounds=(0.0, 1000.0 * _FOOT), source="none by default")
    low_wind: float = setting(0.0, "m/s", bounds=(0.0, 50.0), source="calm by default")
    spectrum: GustSpectrum = GustSpectrum.dryden
    waves: int = count(48, bounds=(4, 500))
    seed: int = count(0, bounds=(0, 2**63 - 1))
    medium: MediumKind = MediumKind.air
    links: list[str] = field(default_factory=lambda: ["*"])
    accounts_for: ClassVar[tuple[str, ...]] = ("gusts",)
    material: ClassVar[dict[str, float]] = {
        **{f"deviation_{a}": 1.0 for a in "xyz"},
        **{f"length_{a}": 20.0 for a in "xyz"},
    }
    identification: ClassVar[Identification] = Identification(searched=False, compared=None)

    def __post_init__(self) -> None:
        """Derive deviations and scales near the ground, where an altitude is given.

        Raises:
            ConfigError: the altitude is below those that the specification covers.
        """
        if not self.altitude:
            return
        if not self.altitude >= 10.0 * _FOOT:
            raise ConfigError(
                f"altitude={self.altitude:g} m of gusts is below the range of MIL-F-8785C.\n"
                "Allowed: from 3.048 to 304.8 m; or leave it out and give deviation_x, length_x "
                "and so on."
            )
        grown = 0.177 + 0.000823 * self.altitude / _FOOT
        low, length = 0.1 * self.low_wind, self.altitude / grown**1.2
        self.deviation_x = self.deviation_y = low / grown**0.4
        self.length_x, self.length_y = length, length
        self.deviation_z, self.length_z = low, self.altitude

    def ambient(self) -> Effect | None:
        """Return the effect for every link of another robot or object in the scene."""
        return None if self.correction else replace(self, links=["*"])

    def constants(self) -> dict[str, Floats]:
        """Return quantiles k L and phases of all waves, shape (1, 3 n), component by component."""
        draw = np.random.default_rng(self.seed)
        shares = (np.arange(self.waves) + draw.uniform(size=(3, self.waves))) / self.waves
        # a wave drawn from the very end of the spectrum would be of no length
        shares[:, -1] = 1.0 - 0.5 / self.waves
        along, across = _DENSITIES[self.spectrum]
        found = []
        for f, s in zip((along, across, across), shares, strict=True):
            # by d(ln x), from a share of 1e-7 below the first node to one of 1e-6 above the last
            x = np.exp(np.linspace(math.log(1e-7), math.log(1e9), 20_001))
            rate = f(x) * x
            whole = np.concatenate(
                [[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(np.log(x)))]
            )
            found.append(np.interp(s, whole / whole[-1], x))
        phase = draw.uniform(0.0, 2.0 * math.pi, (1, 3 * self.waves))
        return {"scaled": np.concatenate(found)[None], "phase": phase}

    @staticmethod
    def flow(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Array, Array]:
        """Velocity of the gusts, world axes [m/s]."""
        place, scaled, phase = motion.position, params["scaled"], params["phase"]
        xp, n = namespace(place), params["scaled"].shape[1] // 3
        east, north = xp.cos(params["heading"]), xp.sin(params["heading"])
        way = params["speed"] * motion.time - east * place[:, 0:1] - north * place[:, 1:2]
        found = []
        for k in range(3):
            own = slice(k * n, (k + 1) * n)
            angle = scaled[:, own] * (way / params["length"][:, k : k + 1]) + phase[:, own]
            gain = params["deviation"][:, k : k + 1] * math.sqrt(2.0 / n)
            found.append(gain * xp.sum(xp.cos(angle), axis=1)[:, None])
        u, v, w = found
        return xp.concat((east * u - north * v, north * u + east * v, w), axis=1), memory


_Density = Callable[[Floats], Floats]
_DENSITIES: dict[GustSpectrum, tuple[_Density, _Density]] = {
    GustSpectrum.dryden: (
        lambda x: 2.0 / math.pi / (1.0 + x * x),
        lambda x: (1.0 + 3.0 * x * x) / math.pi / (1.0 + x * x) ** 2,
    ),
    GustSpectrum.von_karman: (
        lambda x: 2.0 / math.pi / (1.0 + (_VK * x) ** 2) ** (5.0 / 6.0),
        lambda x: (
            (1.0 + 8.0 / 3.0 * (_VK * x) ** 2) / math.pi / (1.0 + (_VK * x) ** 2) ** (11.0 / 6.0)
        ),
    ),
}
"""Spectra over x = k L for s = L = 1, along and across; each integrates to 1."""
