"""Scripted walking policy: gait parameters that lead to a target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from seals.arrays import Array, namespace
from seals.learn.task import Instant

if TYPE_CHECKING:
    from seals.plugins.tasks.walk import TaskWalk

SCRIPTED: Mapping[str, float] = {
    "frequency": 4.0,
    "stroke": 0.036,
    "lift": 0.009,
    "duty": 0.5,
    "spread": 0.0,
    "crouch": 0.0,
    "along": 0.5,
    "across": 0.5,
}
"""How the scripted crab steps: that of its folder, a tripod."""
PACE = 0.2
"""Speed of the scripted crab [m/s]."""
SLOWING = 0.05
"""Distance within which it slows down [m]."""
TURN_GAIN = 3.0
"""Of the rate of turn against the angle [1/s]."""


def yaw_of(now: Instant) -> Array:
    """Return the heading of the body x axis [rad], shape (N, 1)."""
    return namespace(now.position).atan2(now.rotation[:, 1, 0:1], now.rotation[:, 0, 0:1])


def over_ground(now: Instant) -> tuple[Array, Array]:
    """Return the horizontal vector to the target, heading axes [m] (N, 2), and its length."""
    xp = namespace(now.position)
    heading = yaw_of(now)
    c, s = xp.cos(heading), xp.sin(heading)
    x, y = (now.target[:, k : k + 1] - now.position[:, k : k + 1] for k in (0, 1))
    away = xp.concat((c * x + s * y, c * y - s * x), axis=1)
    return away, xp.sqrt(x * x + y * y)


def scripted(
    task: TaskWalk, ranges: Mapping[str, tuple[float, float]], way: Array, far: Array
) -> Array:
    """Return actions that walk straight to the target with the leading side ahead.

    Args:
        task: with speeds, and the side that leads.
        ranges: of the manner of stepping, by name.
        way: to the target, heading axes [m], shape (N, 2).
        far: its length [m], shape (N, 1).
    """
    xp = namespace(way)
    one = far * 0.0 + 1.0
    share = xp.minimum(xp.maximum(far / SLOWING, 0.3 * one), one)
    going = xp.astype(far > 0.5 * task.success_distance, far.dtype)
    pace = going * share * (PACE / task.speed) / xp.maximum(far, one * 1e-6)
    angle = xp.atan2(way[:, 1:2], way[:, 0:1])
    if task.sideways:
        # the nearer of the two sides
        angle = angle - 0.5 * math.pi * xp.where(way[:, 1:2] >= 0.0, one, -one)
    turn = going * share * angle * (TURN_GAIN / max(task.turning, 1e-9))
    columns = [
        one * (2.0 * (SCRIPTED.get(name, 0.5 * (low + high)) - low) / max(high - low, 1e-12) - 1.0)
        for name, (low, high) in ranges.items()
    ]
    wanted = xp.concat((pace * way, turn, *columns), axis=1)
    most = wanted * 0.0 + 1.0
    return xp.minimum(xp.maximum(wanted, -most), most)
