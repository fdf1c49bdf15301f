"""Scripted gaits: a clock drives all legs at fixed phase offsets."""

from __future__ import annotations

from dataclasses import dataclass

from seals.arrays import Array, namespace
from seals.errors import ConfigError
from seals.plugins.controllers.walking.pattern import Pattern, duty_of, phases_of
from seals.plugins.controllers.walking.walker import BatchGait, Facing, Manner, Pace, Walker
from seals.schema import setting


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
                f"support={self.support:g}, catch={self.catch:g} have no form over a batch.\n"
                "Say controller.facing=aim and zero for the others, as env=crab_walk does"
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
