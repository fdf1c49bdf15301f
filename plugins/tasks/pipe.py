"""Task pipe: lead the hand along a pipe, on the sea bed or through the surface."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, namespace
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.reach import TaskReach
from seals.schema import setting, vector

_BOX = (-1e4, 1e4)


@dataclass(kw_only=True)
class TaskPipe(TaskReach):
    """Task: go to the beginning of a pipe, and lead the hand along it to its end.

    The target waits above the beginning of the pipe for ``approach``, and moves along it with
    ``pace``. The pipe has two straight parts of equal length, with a random bend between them. An
    episode succeeds once the hand has stayed within ``success_distance`` of the target for
    ``hold`` without a break: by default four fifths of the time that the target moves.

    Equation:
        p = p_0 + min(s, l / 2) d(a) + max(s - l / 2, 0) d(a + b),
        d(a) = (cos rise cos a, cos rise sin a, sin rise), s = pace (t - approach) from 0 to l.

    Args:
        success_distance: of the hand from the target that counts as following [m].
        hold: for how long it must follow [s].
        target_low: corner of the box of the hand's places above the beginning of the pipe [m].
        length: l of the pipe [m].
        pace: of the target [m/s].
        approach: time to the beginning of the pipe [s].
        bend: largest angle b between the parts, to either side [rad].
        rise: inclination of the pipe, 0 along the floor, pi / 2 upright [rad].

    All other fields are those of `TaskReach`.

    Limitations:
        The pipe is a line and no body: nothing touches it.

    Example:
        >>> task = TaskPipe()
        >>> task.approach + task.length / task.pace <= task.duration
        True
    """

    duration: float = setting(20.0, "s", bounds=(0.1, 1e4), source="chosen: approach and way")
    success_distance: float = setting(
        0.15, "m", bounds=(1e-4, 10.0), source="chosen: a pipe's width"
    )
    hold: float = setting(8.0, "s", bounds=(0.0, 60.0), source="chosen: four fifths of the way")
    start_low: list[float] = vector((-0.5, -0.5, -1.2), "m", bounds=_BOX, source="chosen: wet")
    start_high: list[float] = vector((0.5, 0.5, -0.8), "m", bounds=_BOX, source="chosen: wet")
    target_low: list[float] = vector((-0.5, -0.5, -1.8), "m", bounds=_BOX, source="chosen: wet")
    target_high: list[float] = vector((0.5, 0.5, -1.8), "m", bounds=_BOX, source="chosen: level")
    length: float = setting(1.0, "m", bounds=(0.01, 1e4), source="chosen")
    pace: float = setting(0.1, "m/s", bounds=(1e-3, 10.0), source="chosen: of inspections")
    approach: float = setting(8.0, "s", bounds=(0.0, 1e3), source="chosen: that of reach")
    bend: float = setting(1.0, "rad", bounds=(0.0, 3.1), source="chosen")
    rise: float = setting(0.0, "rad", bounds=(-1.6, 1.6), source="chosen: on the floor")

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts, and pipes: beginning [m], heading and bend [rad]."""
        drawn = super().draw(rng, count)
        heading = rng.uniform(-math.pi, math.pi, (count, 1))
        bend = rng.uniform(-self.bend, self.bend, (count, 1))
        return drawn._replace(goal=np.concatenate((drawn.goal, heading, bend), axis=1))

    def target(self, goal: Array, time: Array) -> tuple[Array, Array]:
        """Return position and velocity of the target along the pipe."""
        xp, half = namespace(goal), 0.5 * self.length
        way = self.pace * (time - self.approach)
        gone = xp.minimum(xp.maximum(way, way * 0.0), way * 0.0 + self.length)
        first = xp.minimum(gone, gone * 0.0 + half)
        moves = xp.astype((way > 0.0) & (way < self.length), gone.dtype)
        on_first = xp.astype(way < half, gone.dtype)
        one, other = (self._along(goal[:, 3:4] + turn) for turn in (0.0, goal[:, 4:5]))
        place = goal[:, :3] + first * one + (gone - first) * other
        return place, self.pace * moves * (on_first * one + (1.0 - on_first) * other)

    def _along(self, heading: Array) -> Array:
        """Return directions of a part of the pipe, shape (N, 3)."""
        xp, flat = namespace(heading), math.cos(self.rise)
        up = heading * 0.0 + math.sin(self.rise)
        return xp.concat((flat * xp.cos(heading), flat * xp.sin(heading), up), axis=1)

    def scripted_policy(self, now: Instant) -> Array:
        """Scripted policy: target velocity plus proportional error of the level hand."""
        wanted = super().scripted_policy(now) + now.target_velocity / self.speed
        return namespace(wanted).clip(wanted, -1.0, 1.0)
