"""Task hover: hold the body at a position in air or water against disturbances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Array
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.reach import TaskReach
from seals.schema import setting, vector

_BOX = (-1e4, 1e4)


@dataclass(kw_only=True)
class TaskHover(TaskReach):
    """Task: move the body to a position and hold it there.

    Args:
        hold: for how long the body must be within the distance [s].
        target_low: corner of the box of places to hold [m].

    All other fields are those of `TaskReach`.

    Example:
        >>> TaskHover().hold
        2.0
    """

    hold: float = setting(2.0, "s", bounds=(0.0, 60.0), source="chosen: a quarter")
    start_low: list[float] = vector((-0.5, -0.5, 0.7), "m", bounds=_BOX, source="chosen: in air")
    start_high: list[float] = vector((0.5, 0.5, 1.7), "m", bounds=_BOX, source="chosen")
    target_low: list[float] = vector((0.0, 0.0, 1.2), "m", bounds=_BOX, source="chosen: in air")
    target_high: list[float] = vector((0.0, 0.0, 1.2), "m", bounds=_BOX, source="chosen")

    def place(self, now: Instant) -> Array:
        """Return the point that must reach the target: the body origin [m], shape (N, 3)."""
        return now.position


@dataclass(kw_only=True)
class TaskStation(TaskHover):
    """Task: hold a submerged vehicle at a position in current and waves, from any heading.

    All other fields are those of `TaskReach`.

    Example:
        >>> TaskStation().duration
        15.0
    """

    duration: float = setting(15.0, "s", bounds=(0.1, 1e4), source="chosen: 1.5 m, then 8 s")
    speed: float = setting(0.5, "m/s", bounds=(0.01, 20.0), source="chosen: half of its maximum")
    start_low: list[float] = vector((-0.7, -0.7, -2.7), "m", bounds=_BOX, source="chosen: wet")
    start_high: list[float] = vector((0.7, 0.7, -1.3), "m", bounds=_BOX, source="chosen: wet")
    target_low: list[float] = vector((0.0, 0.0, -2.0), "m", bounds=_BOX, source="chosen: wet")
    target_high: list[float] = vector((0.0, 0.0, -2.0), "m", bounds=_BOX, source="chosen: wet")

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts with any heading; the wanted heading is zero."""
        yaw = rng.uniform(-np.pi, np.pi, (count, 1))
        return super().draw(rng, count)._replace(yaw=yaw)
