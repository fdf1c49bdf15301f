"""Contract tests of wave plug-ins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats, as_like
from seals.contract import require
from seals.environment.waves import Waves
from seals.testing.declaration import build_declared
from seals.testing.hooks import other_libraries
from seals.testing.instants import copied

ROWS = 64
LEVEL = 0.3
"""Mean surface height of the checks [m]; not zero, so that it cannot be forgotten."""
SHIFT = 1e-4
"""Shift of the numerical derivatives [m, s]."""


@dataclass(frozen=True, kw_only=True)
class WavesReport:
    """Result of `check_waves`: largest differences relative to the largest value [1].

    Args:
        name: of the wave.
        figures: by quantity.
    """

    name: str
    figures: Mapping[str, float]

    def table(self) -> str:
        """Return the figures as text."""
        return f"{self.name}: " + ", ".join(
            f"{key} {value:.1e}" for key, value in self.figures.items()
        )


def check_waves(
    wave: str | type, *, values: Mapping[str, Any] | None = None, seed: int = 0
) -> WavesReport:
    """Check the contract of a wave.

    Normal and rise must be the derivatives of the elevation; the water at the mean level must
    follow the surface; its velocity must be free of divergence and fade with depth; its
    acceleration must be the rate of the velocity, and the gradient, where it gives one, that of the
    velocity.

    Args:
        wave: name of an installed wave, or its class.
        values: fields of the wave.
        seed: of the random points.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.
    """
    name, made = build_declared("wave", wave, values)
    check = _WaveCheck(name, made, np.random.default_rng(seed))
    check.surface()
    check.water()
    check.libraries()
    return WavesReport(name=name, figures=check.figures)


class _WaveCheck:
    """Random points under and around the surface."""

    def __init__(self, name: str, wave: Waves, rng: np.random.Generator) -> None:
        self.name, self.wave = name, wave
        self.place = rng.uniform(-20.0, 20.0, (ROWS, 3))
        self.place[:, 2] = LEVEL - rng.uniform(0.05, 2.0, ROWS)
        self.time = rng.uniform(0.0, 10.0, (ROWS, 1))
        self.figures: dict[str, float] = {}

    def surface(self) -> None:
        """Compare normal and rise with derivatives of the elevation."""
        sea = self.wave.at(self.place, self.time, LEVEL)
        east, north, rate = (self._slope(lambda s: s.elevation, axis) for axis in (0, 1, 3))
        length = np.sqrt(1.0 + east**2 + north**2)
        up = np.repeat([[0.0, 0.0, 1.0]], ROWS, axis=0)
        normal = np.concatenate((-east, -north, np.ones_like(east)), axis=1) / length
        self._compare("normal", up if sea.normal is None else sea.normal, normal, 1e-6)
        self._compare("rise", 0.0 if sea.rise is None else sea.rise, rate / length, 1e-6)
        mean = float(np.mean(sea.elevation))
        largest = float(np.abs(sea.elevation - LEVEL).max(initial=0.0))
        require(
            abs(mean - LEVEL) <= largest,
            self.name,
            f"has the mean level {mean:.2g} m, expected {LEVEL} m",
            "Use level.",
        )

    def water(self) -> None:
        """Compare the water's motion with the surface's, and its acceleration with its velocity."""
        sea = self.wave.at(self.place, self.time, LEVEL)
        if sea.velocity is None:
            still = sea.acceleration is None and sea.rise is None
            require(
                still,
                self.name,
                "moves its surface or accelerates water at rest",
                "Return None for all.",
            )
            return
        self._compare("acceleration", sea.acceleration, self._slope(lambda s: s.velocity, 3), 1e-5)
        if sea.gradient is not None:
            by_place = [self._slope(lambda s: s.velocity, axis) for axis in range(3)]
            self._compare("gradient", sea.gradient, np.stack(by_place, axis=2), 1e-5)
        spread = sum(
            self._slope(lambda s, k=axis: s.velocity[:, k : k + 1], axis) for axis in range(3)
        )
        self._compare(
            "divergence", spread, np.zeros((ROWS, 1)), 1e-5, scale=float(np.abs(sea.velocity).max())
        )
        at_level = self.place.copy()
        at_level[:, 2] = LEVEL
        top = self.wave.at(at_level, self.time, LEVEL)
        rate = self._slope(lambda s: s.elevation, 3)
        self._compare("velocity at the surface", top.velocity[:, 2:3], rate, 1e-5)  # type: ignore[index]
        deep = self.wave.at(at_level - [[0.0, 0.0, 500.0]], self.time, LEVEL)
        share = float(np.abs(deep.velocity).max() / np.abs(top.velocity).max())  # type: ignore[arg-type]
        require(
            share < 0.5,
            self.name,
            f"still moves {share:.0%} of the surface's speed 500 m below",
            "Let it fade.",
        )

    def libraries(self) -> None:
        """Compare other array libraries with NumPy, and each row with the batch."""
        expected = self.wave.at(self.place, self.time, LEVEL)
        if expected.normal is None:
            return
        for library, like in other_libraries().items():
            found = self.wave.at(as_like(self.place, like), as_like(self.time, like), LEVEL)
            for field, a, b in zip(found._fields, copied(found), expected, strict=True):
                if b is not None:
                    self._compare(f"{field} under {library}", a, b, 1e-12)
        alone = self.wave.at(self.place[3:4], self.time[3:4], LEVEL)
        for field, a, b in zip(alone._fields, alone, expected, strict=True):
            if b is not None:
                self._compare(f"{field} of one row", a, b[3:4], 1e-12)

    def _slope(self, of: Callable[..., Any], axis: int) -> Floats:
        """Central difference of a quantity along an axis; axis 3 is time."""
        ends = []
        for sign in (1.0, -1.0):
            place, time = self.place.copy(), self.time.copy()
            if axis == 3:
                time += sign * SHIFT
            else:
                place[:, axis] += sign * SHIFT
            ends.append(of(self.wave.at(place, time, LEVEL)) + np.zeros((ROWS, 1)))
        slope: Floats = (ends[0] - ends[1]) / (2.0 * SHIFT)
        return slope

    def _compare(
        self, what: str, found: Any, expected: Floats, most: float, *, scale: float | None = None
    ) -> None:
        size = max(float(np.abs(expected).max(initial=0.0)) if scale is None else scale, 1e-3)
        off = float(np.abs(found - expected).max(initial=0.0)) / size
        self.figures[what] = off
        require(
            off <= most,
            self.name,
            f"its {what} is {off:.1e} off",
            f"Allowed: {most:g} of the largest value.",
        )
