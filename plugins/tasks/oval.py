"""Task oval: follow a target around a vertical ellipse, half of it under water."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, namespace
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.hover import TaskHover
from seals.schema import setting


@dataclass(kw_only=True)
class TaskOval(TaskHover):
    """Task: follow a target around a vertical ellipse centred on the water surface.

    Equation:
        p = (length / 2 sin a, 0, height / 2 cos a), a = 2 pi time / period; the robot starts near
        the top.

    Args:
        duration: of an episode: a lap [s].
        success_distance: distance from the target that counts as following it [m].
        hold: for how long [s].
        length: horizontal axis [m].
        height: vertical axis [m].
        period: time of a lap [s].

    All other fields are those of `TaskReach`; the boxes of targets are not used.

    Example:
        >>> TaskOval().period
        20.0
    """

    duration: float = setting(20.0, "s", bounds=(0.1, 1e4), source="chosen: a lap")
    success_distance: float = setting(0.1, "m", bounds=(1e-4, 10.0), source="chosen")
    hold: float = setting(15.0, "s", bounds=(0.0, 60.0), source="chosen: most of a lap")
    length: float = setting(2.0, "m", bounds=(0.0, 1e4), source="as the guide oval")
    height: float = setting(1.6, "m", bounds=(0.0, 1e4), source="as the guide oval")
    period: float = setting(20.0, "s", bounds=(0.1, 1e5), source="as the guide oval")

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts within 0.2 m of the topmost point."""
        top = np.array([0.0, 0.0, 0.5 * self.height])
        start = top + rng.uniform(-0.2, 0.2, (count, 3))
        still = np.zeros((count, 3))
        return Draw(start, still[:, :1], still, np.zeros((count, 1)))

    def target(self, goal: Array, time: Array) -> tuple[Array, Array]:
        """Return position and velocity of the target on the ellipse."""
        xp = namespace(time)
        rate = 2.0 * math.pi / self.period
        sine, cosine, still = xp.sin(rate * time), xp.cos(rate * time), time * 0.0
        wide, high = 0.5 * self.length, 0.5 * self.height
        place = xp.concat((wide * sine, still, high * cosine), axis=1)
        return place, rate * xp.concat((wide * cosine, still, -high * sine), axis=1)

    def scripted_policy(self, now: Instant) -> Array:
        """Scripted policy: target velocity plus proportional position error."""
        wanted = super().scripted_policy(now) + now.target_velocity / self.speed
        return namespace(wanted).clip(wanted, -1.0, 1.0)
