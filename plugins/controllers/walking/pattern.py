"""Stepping patterns: the phase of every leg in the gait cycle.

In scripted gaits a clock drives all legs at fixed phase offsets; in a central pattern generator
each leg is one oscillator, coupled to the others by its phase.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Array, namespace
from seals.errors import ConfigError
from seals.plugins.controllers.walking.anatomy import Anatomy
from seals.plugins.controllers.walking.walker import BatchGait, Facing, Manner, Pace, Walker
from seals.schema import setting


class Pattern(enum.Enum):
    """Names of stepping patterns.

    tripod: every second leg at once, both sides against each other; on eight legs this is the
    alternating tetrapod. tetrapod: thirds of the legs, one after the other. ripple: waves from the
    rear to the front, both sides half a cycle apart. wave: one leg after the other. trot: the
    diagonal pairs of four legs. crawl: one of four legs after the other, the fore leg of a side
    after its hind leg, with a rest on all four before each (McGhee and Frank 1968).
    """

    tripod = "tripod"
    tetrapod = "tetrapod"
    ripple = "ripple"
    wave = "wave"
    trot = "trot"
    crawl = "crawl"


DUTY = {
    Pattern.tripod: 0.5,
    Pattern.tetrapod: 2.0 / 3.0,
    Pattern.ripple: 0.7,
    Pattern.trot: 0.55,
    Pattern.crawl: 0.85,
}
"""Share of the cycle on the ground with which the groups of a pattern relieve each other [1]."""


def phases_of(pattern: Pattern, anatomy: Anatomy) -> Array:
    """Return the phase of every leg, as a share of the cycle, shape (N,)."""
    rank, side = anatomy.rank, anatomy.side
    count = float(rank.max()) + 1.0
    if pattern in (Pattern.tripod, Pattern.trot):
        return _lagged(anatomy, 0.5, 0.5)
    if pattern is Pattern.tetrapod:
        return _lagged(anatomy, 1.0 / 3.0, 1.0 / 3.0)
    if pattern is Pattern.ripple:
        return _lagged(anatomy, 1.0 / count, 0.5)
    return np.mod((rank + side * count) / (2.0 * count), 1.0)


def _lagged(anatomy: Anatomy, along: Any, across: Any) -> Array:
    """Return phases with a lag between neighbouring legs and one between the sides, (N,) or (B, N).

    Args:
        anatomy: of the animal.
        along: lag of a leg behind the one in front of it [cycles], a number or shape (B, 1).
        across: lag of the right side behind the left [cycles], likewise.
    """
    phases = along * anatomy.rank + across * anatomy.side
    return phases - namespace(phases).floor(phases)


def duty_of(pattern: Pattern, legs: int) -> float:
    """Return the duty factor of a pattern [1].

    Example:
        >>> duty_of(Pattern.tripod, 6)
        0.5
    """
    return DUTY.get(pattern, 1.0 - 1.0 / legs)


@dataclass(kw_only=True)
class Gait(Walker):
    """Gait controller with fixed phase offsets: tripod, tetrapod, ripple or wave.

    Equation:
        phase of leg i = f t + offset_i; on the ground for its first ``duty``, in the air for the
        rest; f = speed duty / stroke between lowest and highest.

    Args:
        pattern: order of the legs.
        duty: share of the cycle on the ground, 0 for that of the pattern [1].

    Assumptions:
        The ground is firm and flat on the scale of a step.

    Valid range:
        Robots with legs of three joints, four legs or more.

    Limitations:
        Feels neither ground nor tilt: it steps by the clock.

    References:
        Wilson 1966, Annual Review of Entomology 11 (gaits of insects); Burrows and Hoyle 1973,
        Journal of Experimental Zoology 184 (ghost crabs run on three pairs of legs, in tripods).

    Example:
        >>> Gait(pattern=Pattern.ripple).pattern.value
        'ripple'
    """

    pattern: Pattern = Pattern.tripod
    duty: float = setting(0.0, "1", bounds=(0.0, 0.95), source="chosen: the pattern's")

    def walking(self, batch: int, like: Array, *, turns: bool = False) -> BatchGait:
        """Return the gait over a batch of robots.

        Args:
            batch: number of robots.
            like: array whose library, type and device to use.
            turns: whether it turns the robots itself; else it is told how.

        Raises:
            ConfigError: it turns the robot itself, or feels what a batch does not.
        """
        steered = turns or (self.facing is Facing.aim and not self.turn_gain)
        if not steered or self.support or self.catch:
            raise ConfigError(
                f"controller.facing={self.facing.value}, turn_gain={self.turn_gain:g}, "
                f"support={self.support:g}, catch={self.catch:g} have no batched form.\n"
                "Give controller.facing=aim and zero for the others, as in env=crab_walk"
            )
        return BatchGait(self, batch, like)

    def rhythm(self) -> dict[str, float]:
        """Return the duty factor."""
        return {"duty": self.duty or duty_of(self.pattern, len(self._legs.toe))}

    def order(self, manner: Manner) -> Array:
        """Return the phases of the pattern, shape (N,)."""
        return phases_of(self.pattern, self._legs)

    def advanced(self, pace: Pace, manner: Manner, step: float) -> Array:
        """Return the phases one period later, shape (B, N)."""
        later = pace.phase + pace.frequency * step
        return later - namespace(later).floor(later)


@dataclass(kw_only=True)
class Oscillators(Walker):
    """Walking controller of coupled oscillators: the gait emerges from their coupling.

    Equation:
        d phi_i / dt = f + (coupling / N) sum_j sin(2 pi (phi_j - phi_i - o_j + o_i)) / (2 pi), phi
        in cycles, o_i = along rank_i + across side_i.

    Args:
        duty: share of the cycle on the ground [1].
        along: phase by which a leg lags behind the one in front [cycles].
        across: phase by which the right side lags behind the left [cycles].
        coupling: rate at which the legs find their order [1/s].

    Assumptions:
        All legs are coupled alike.

    Valid range:
        Robots with legs of three joints, four legs or more.

    Limitations:
        No feeling in the legs: a toe that finds no ground changes nothing.

    References:
        Ijspeert 2008, Neural Networks 21(4), 642-653 (central pattern generators); Kuramoto 1984,
        Chemical Oscillations, Waves, and Turbulence.

    Example:
        >>> Oscillators(along=0.4).coupling
        8.0
    """

    duty: float = setting(0.55, "1", bounds=(0.05, 0.95), source="chosen")
    along: float = setting(0.5, "cycles", bounds=(-1.0, 1.0), source="chosen: tripod")
    across: float = setting(0.5, "cycles", bounds=(-1.0, 1.0), source="chosen: tripod")
    coupling: float = setting(8.0, "1/s", bounds=(0.0, 1e3), source="chosen: some steps")

    def rhythm(self) -> dict[str, float]:
        """Return the duty factor and the phase lags."""
        return {"duty": self.duty, "along": self.along, "across": self.across}

    def order(self, manner: Manner) -> Array:
        """Return the phases that the oscillators tend to, shape (N,)."""
        return _lagged(self._legs, manner.along, manner.across)

    def advanced(self, pace: Pace, manner: Manner, step: float) -> Array:
        """Return the phases one period later, shape (B, N)."""
        xp, apart = namespace(pace.phase), pace.phase - self.order(manner)
        turns = 2.0 * np.pi * (apart[:, None, :] - apart[:, :, None])
        pull = xp.sum(xp.sin(turns), axis=2) * (self.coupling / (2.0 * np.pi * apart.shape[1]))
        later = pace.phase + step * (pace.frequency + pull)
        return later - xp.floor(later)
