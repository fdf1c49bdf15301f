"""Task valve: take the knob of a lever and turn it by a quarter."""

from __future__ import annotations

import math
from dataclasses import dataclass

from seals.arrays import Array, namespace
from seals.learn.task import Instant
from seals.plugins.tasks.catch import GAIN, TaskCatch
from seals.plugins.tasks.observation import level_hand_offset
from seals.plugins.tasks.rewards import chosen

PUSH = 0.2
"""Velocity along the circle, and largest across it [m/s]."""


@dataclass(kw_only=True)
class TaskValve(TaskCatch):
    """Take the knob of a lever and turn it about the vertical; actions as in `TaskCatch`.

    The target is the knob of an object with one joint, the lever's, which begins at zero. An
    episode succeeds once the lever has been turned by ``angle``.

    Equation:
        knob = origin + (lever cos p, lever sin p, knob), p = heading + turn.

    Args:
        success_distance: what may be lacking of the knob's way [m].
        hold: for how long it must be turned [s].
        object: name of the valve among the objects.
        lever: distance of the knob from the axis [m].
        knob: height of the knob's grip above the valve's origin [m].
        angle: by which the lever is to be turned [rad].

    All other fields are those of `TaskCatch`; ``height`` and ``depth`` are not used.

    Example:
        >>> TaskValve().observation_names[-3:]
        ('lever_x', 'lever_y', 'left')
    """

    success_distance: float = chosen(0.01, "m", 1e-4, 10.0, "5 degrees")
    hold: float = chosen(0.2, "s", 0.0, 60.0, "as reach")
    object: str = "valve"
    view: float = chosen(3.2, "rad", 0.01, 3.2, "its place is told")
    lever: float = chosen(0.12, "m", 1e-3, 10.0, "of the valve that ships")
    knob: float = chosen(0.3, "m", -10.0, 10.0, "of the valve that ships")
    angle: float = chosen(0.5 * math.pi, "rad", 0.01, 10.0, "a quarter turn")

    @property
    def knows(self) -> tuple[str, ...]:
        """Quantities that observations use: those of a catch, the draw, and the lever's turn."""
        return (*super().knows, "goal", "turn")

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the components of an observation, in order."""
        return (*super().observation_names, "lever_x", "lever_y", "left")

    def _pointing(self, now: Instant) -> Array:
        """Direction of the lever [rad], shape (N, 1)."""
        return now.facts["goal"][:, 2:3] + now.facts["turn"]

    def _on_circle(self, now: Instant, pointing: Array) -> Array:
        """Place of the knob with the lever in a direction, world [m], shape (N, 3)."""
        xp = namespace(pointing)
        flat = self.lever * xp.cos(pointing), self.lever * xp.sin(pointing)
        return now.target + xp.concat((*flat, pointing * 0.0 + self.knob), axis=1)

    def _aimed(self, now: Instant) -> Instant:
        """The same with the knob as the target."""
        return now._replace(target=self._on_circle(now, self._pointing(now)))

    def _left(self, now: Instant) -> Array:
        """Angle that is left [rad], shape (N, 1)."""
        return self.angle - now.facts["turn"]

    def observation(self, now: Instant) -> Array:
        """Return observations, shape (N, d)."""
        xp, pointing = namespace(now.position), self._pointing(now)
        lever = xp.cos(pointing), xp.sin(pointing), self._left(now)
        return xp.concat((super().observation(self._aimed(now)), *lever), axis=1)

    def distance(self, now: Instant) -> Array:
        """Return the way of the knob that is left [m], shape (N,)."""
        xp, left = namespace(now.position), self._left(now)[:, 0]
        return self.lever * xp.maximum(left, left * 0.0)

    def reached(self, now: Instant) -> Array:
        """Return the distance of the hand from the knob [m], shape (N,)."""
        return super().reached(self._aimed(now))

    def gone(self, now: Instant) -> Array:
        """Return the share of the turn [1], shape (N,)."""
        return 1.0 - self._left(now)[:, 0] / self.angle

    def bring(self, now: Instant) -> Array:
        """Return the velocity along the knob's circle [m/s], shape (N, 3).

        Args:
            now: with the knob as the target.
        """
        xp, pointing = namespace(now.position), self._pointing(now)
        along = xp.concat((-xp.sin(pointing), xp.cos(pointing), pointing * 0.0), axis=1)
        # a body that pushes leans ahead of its hand: it is held over the knob across the way alone
        off = now.target - now.position - level_hand_offset(now)
        across = off - xp.sum(off * along, axis=1, keepdims=True) * along
        return PUSH * along + xp.clip(GAIN * across, -PUSH, PUSH)

    def scripted_policy(self, now: Instant) -> Array:
        """Return the actions of a memoryless scripted diver, shape (N, 4)."""
        return super().scripted_policy(self._aimed(now))
