"""Linear waves on water of any depth: one regular wave, or an irregular sea."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, Floats, as_like, columns, namespace
from seals.environment.linear_waves import jonswap, wavenumber
from seals.environment.waves import Sea, WaveOptions, gradient_along
from seals.errors import ConfigError
from seals.schema import check_tree, count, optional, param

_CHOSEN = "chosen"
STEEPEST = 2.0 * math.pi / 15.0
"""Significant height of an irregular sea times k of its peak, at most [1]: DNV-RP-C205, 3.5.4."""


class Spectrum(enum.Enum):
    """Shape of the wave spectrum."""

    regular = "regular"
    """One wave: height from trough to crest, and its period."""
    jonswap = "jonswap"
    """Hasselmann et al. 1973; height is the significant one, period the peak's."""


@dataclass(kw_only=True)
class WaveSea(WaveOptions):
    """Sum of linear waves in one direction on water of any depth.

    Equation:
        eta = sum a_i cos(theta_i), theta_i = k_i (x cos b + y sin b) - w_i t + phi_i,
        w_i^2 = g k_i tanh(k_i h); horizontal velocity a_i w_i cosh(k_i (z + h)) / sinh(k_i h)
        cos(theta_i), vertical a_i w_i sinh(k_i (z + h)) / sinh(k_i h) sin(theta_i), z below the
        mean level.

    Args:
        height: from trough to crest; significant height of an irregular sea [m].
        period: of the wave, or of the spectrum's peak [s].
        spectrum: regular or jonswap.
        direction: b, toward which the waves run, from east anticlockwise [rad].
        depth: h of the sea [m]; deep water when left out.
        peakedness: gamma of the spectrum [1].
        components: waves of an irregular sea.
        seed: of their phases; a regular wave has its crest over the origin at time zero.
        gravity: [m/s^2].

    Assumptions:
        Linear theory.

    Valid range:
        Steepness k a below 0.3, with half the height for a; an irregular sea up to 1/15 of the
        length at its peak.

    Limitations:
        No second-order crest, no breaking, no spread of directions; velocity above the mean level
        held at its value there. An irregular sea of n components repeats itself after a long while.

    References:
        Airy 1845; Dean and Dalrymple 1991, Water Wave Mechanics for Engineers and Scientists,
        ch. 3 and 4; Hasselmann et al. 1973; DNV-RP-C205, Environmental Conditions and Environmental
        Loads.

    Example:
        >>> round(WaveSea(height=0.2, period=2.0).shortest, 3)
        6.245
    """

    height: float = param(
        0.1, "m", bounds=(0.0, 30.0), tolerance=0.05, relative=True, source=_CHOSEN, fit=False
    )
    period: float = param(2.0, "s", bounds=(0.1, 60.0), tolerance=0.02, source=_CHOSEN, fit=False)
    spectrum: Spectrum = Spectrum.regular
    direction: float = param(
        0.0, "rad", bounds=(-7.0, 7.0), tolerance=0.05, source=_CHOSEN, fit=False
    )
    depth: float | None = optional("m", bounds=(0.01, 12000.0), source=_CHOSEN)
    peakedness: float = param(
        3.3, "1", bounds=(1.0, 10.0), tolerance=0.5, source="Hasselmann et al. 1973", fit=False
    )
    components: int = count(40, bounds=(1, 10_000))
    seed: int = count(0, bounds=(0, 2**63 - 1))
    gravity: float = param(
        9.81, "m/s^2", bounds=(0.1, 30.0), tolerance=0.01, source="standard gravity", fit=False
    )

    def __post_init__(self) -> None:
        """Find the waves; refuse what linear theory does not describe."""
        check_tree(self, where="sea")
        rates, self._amplitude = (
            np.array([2.0 * math.pi / self.period]),
            np.array([self.height / 2]),
        )
        self._phase = np.zeros(1)
        peak = wavenumber(float(rates[0]), self._depth, self.gravity)
        if peak * self.height / 2 > 0.3:
            raise ConfigError(
                f"a sea of {self.height:g} m at {self.period:g} s has the steepness "
                f"{peak * self.height / 2:.2f}.\n"
                f"Allowed: up to 0.3, that is {0.6 / peak:.3g} m; lower the height or raise the "
                "period."
            )
        if self.spectrum is Spectrum.jonswap:
            if peak * self.height > STEEPEST:
                raise ConfigError(
                    f"an irregular sea of {self.height:g} m at {self.period:g} s is steeper than "
                    f"seas are: {peak * self.height / (2.0 * math.pi):.3f} of its length.\n"
                    f"Allowed: up to 1/15, that is {STEEPEST / peak:.3g} m; lower the height or "
                    "raise the period."
                )
            rates, self._amplitude = jonswap(
                self.height, self.period, peakedness=self.peakedness, components=self.components
            )
            draw = np.random.default_rng(self.seed)
            self._phase = draw.uniform(0.0, 2.0 * math.pi, self.components)
        self._omega: Floats = rates
        self._k = np.array([wavenumber(float(w), self._depth, self.gravity) for w in rates])

    @property
    def _depth(self) -> float:
        return math.inf if self.depth is None else self.depth

    @property
    def shortest(self) -> float:
        """Length of the shortest wave [m]."""
        return float(2.0 * math.pi / self._k.max())

    def at(self, position: Array, time: Array, level: float) -> Sea:
        """Return the sea at points."""
        xp = namespace(position)
        east, north = math.cos(self.direction), math.sin(self.direction)
        k, omega, amplitude = (
            as_like(a, position) for a in (self._k, self._omega, self._amplitude)
        )
        cosine, sine = self._turned(position, time)
        along, up = self._profiles(position, level)
        slope = -xp.sum(k * amplitude * sine, axis=1)
        rise = xp.sum(omega * amplitude * sine, axis=1)
        length = xp.sqrt(1.0 + slope * slope)
        speed, climb = omega * amplitude * along, omega * amplitude * up
        u, w = xp.sum(speed * cosine, axis=1), xp.sum(climb * sine, axis=1)
        push = xp.sum(omega * speed * sine, axis=1)
        heave = -xp.sum(omega * climb * cosine, axis=1)
        ahead, under = -xp.sum(k * speed * sine, axis=1), xp.sum(k * climb * cosine, axis=1)
        return Sea(
            elevation=(level + xp.sum(amplitude * cosine, axis=1))[:, None],
            normal=columns(-east * slope / length, -north * slope / length, 1.0 / length),
            rise=(rise / length)[:, None],
            velocity=columns(east * u, north * u, w),
            acceleration=columns(east * push, north * push, heave),
            gradient=gradient_along(east, north, ahead, under),
        )

    def displacement(self, position: Array, time: Array, level: float) -> Array:
        """Return the displacement of the water from its rest position [m], shape (N, 3)."""
        xp = namespace(position)
        k, amplitude = as_like(self._k, position), as_like(self._amplitude, position)
        cosine, sine = self._turned(position, time)
        along, up = (amplitude * share for share in self._profiles(position, level))
        back = -xp.sum(along * sine, axis=1)
        lift = xp.sum(up * cosine + 0.5 * k * along * up, axis=1)
        return columns(math.cos(self.direction) * back, math.sin(self.direction) * back, lift)

    def _turned(self, position: Array, time: Array) -> tuple[Array, Array]:
        """Cosine and sine of every theta, shape (N, M)."""
        xp = namespace(position)
        way = math.cos(self.direction) * position[:, 0] + math.sin(self.direction) * position[:, 1]
        k, omega, phase = (as_like(a, position) for a in (self._k, self._omega, self._phase))
        theta = k * way[:, None] - omega * time + phase
        return xp.cos(theta), xp.sin(theta)

    def _profiles(self, position: Array, level: float) -> tuple[Array, Array]:
        """Depth attenuation of horizontal and vertical motion, shape (N, M)."""
        xp = namespace(position)
        k = as_like(self._k, position)
        z = xp.clip(position[:, 2] - level, None, 0.0)[:, None]
        fade = xp.exp(k * z)
        if math.isinf(self._depth):
            return fade, fade
        # cosh and sinh over sinh, without overflow
        back = xp.exp(-2.0 * k * xp.clip(z + self._depth, 0.0, None))
        whole = 1.0 - xp.exp(-2.0 * k * self._depth)
        return fade * (1.0 + back) / whole, fade * (1.0 - back) / whole
