"""Linear waves on water of any depth: one regular wave, or an irregular sea."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, Floats, as_like, columns, namespace
from seals.environment.linear_waves import jonswap, spread, wavenumber
from seals.environment.waves import Sea, WaveOptions, gradient_of
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
    """Sum of linear waves on water of any depth, in one direction or spread about it.

    Equation:
        eta = sum a_i cos(theta_i), theta_i = k_i (x cos b_i + y sin b_i) - w_i t + phi_i,
        w_i^2 = g k_i tanh(k_i h); horizontal velocity a_i w_i cosh(k_i (z + h)) / sinh(k_i h)
        cos(theta_i), vertical a_i w_i sinh(k_i (z + h)) / sinh(k_i h) sin(theta_i), z below the
        mean level.

    Args:
        height: from trough to crest; significant height of an irregular sea [m].
        period: of the wave, or of the spectrum's peak [s].
        spectrum: regular or jonswap.
        direction: b, toward which the waves run, from east anticlockwise [rad].
        spreading: s of an irregular sea whose directions are distributed as cos^{2s}((b_i - b) / 2)
            [1]; one direction when left out. Wind seas have 5 to 15 at their peak, swell 25 to 75.
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
        No second-order crest, no breaking; velocity above the mean level held at its value there.
        The spread is that of all frequencies, and each component has one direction. An irregular
        sea of n components repeats itself after a long while.

    References:
        Airy 1845; Dean and Dalrymple 1991, Water Wave Mechanics for Engineers and Scientists,
        ch. 3 and 4; Hasselmann et al. 1973; DNV-RP-C205, Environmental Conditions and Environmental
        Loads; Longuet-Higgins, Cartwright and Smith 1963; Goda 2010, Random Seas and Design of
        Maritime Structures, ch. 2 (values of s).

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
    spreading: float | None = optional(
        "1", bounds=(0.5, 1000.0), source="Longuet-Higgins et al. 1963", later=True
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
        self._phase, turns = np.zeros(1), np.zeros(1)
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
            if self.spreading is not None:
                # no frequency has a side of its own
                turns = draw.permutation(spread(self.spreading, self.components))
        elif self.spreading is not None:
            raise ConfigError(
                f"wave.spreading={self.spreading:g}: a regular wave has one direction.\n"
                "Choose an irregular sea: wave.spectrum=jonswap"
            )
        self._east, self._north = np.cos(self.direction + turns), np.sin(self.direction + turns)
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
        k, omega, amplitude, east, north = (
            as_like(a, position)
            for a in (self._k, self._omega, self._amplitude, self._east, self._north)
        )
        cosine, sine = self._turned(position, time)
        along, up = self._profiles(position, level)

        def total(*parts: Array) -> list[Array]:
            """Sums over the waves, shape (N,) each."""
            return [xp.sum(part, axis=1) for part in parts]

        steep = k * amplitude * sine
        slope_x, slope_y, rise = total(east * steep, north * steep, omega * amplitude * sine)
        length = xp.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
        speed, climb = omega * amplitude * along, omega * amplitude * up
        level_speed, push = speed * cosine, omega * speed * sine
        ahead, under = -k * speed * sine, k * climb * cosine
        return Sea(
            elevation=(level + xp.sum(amplitude * cosine, axis=1))[:, None],
            normal=columns(slope_x / length, slope_y / length, 1.0 / length),
            rise=(rise / length)[:, None],
            velocity=columns(*total(east * level_speed, north * level_speed, climb * sine)),
            acceleration=columns(*total(east * push, north * push, -omega * climb * cosine)),
            gradient=gradient_of(
                total(east * east * ahead, east * north * ahead, north * north * ahead),
                total(east * under, north * under),
            ),
        )

    def displacement(self, position: Array, time: Array, level: float) -> Array:
        """Return the displacement of the water from its rest position [m], shape (N, 3)."""
        xp = namespace(position)
        k, amplitude, east, north = (
            as_like(a, position) for a in (self._k, self._amplitude, self._east, self._north)
        )
        cosine, sine = self._turned(position, time)
        along, up = (amplitude * share for share in self._profiles(position, level))
        back, lift = -along * sine, up * cosine + 0.5 * k * along * up
        return columns(*(xp.sum(part, axis=1) for part in (east * back, north * back, lift)))

    def _turned(self, position: Array, time: Array) -> tuple[Array, Array]:
        """Cosine and sine of every theta, shape (N, M)."""
        xp = namespace(position)
        k, omega, phase, east, north = (
            as_like(a, position)
            for a in (self._k, self._omega, self._phase, self._east, self._north)
        )
        way = east * position[:, 0:1] + north * position[:, 1:2]
        theta = k * way - omega * time + phase
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
