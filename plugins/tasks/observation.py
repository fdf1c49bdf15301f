"""Observations of robot and target."""

from __future__ import annotations

import enum

from seals.arrays import Array, namespace
from seals.learn.task import Instant

TINY = 1e-12
"""What keeps the heading of a body that stands on its nose a number [1]."""
_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_VELOCITY = ("velocity_x", "velocity_y", "velocity_z")


class ObservationKind(enum.Enum):
    """Kind of observation.

    ``paper``: positions and orientations of robot and target, and the robot's velocity. ``full``:
    the target as seen from the hand of a level body, velocities, lean, submersion and the last
    action. ``blind``: the same without the target.
    """

    paper = "paper"
    full = "full"
    blind = "blind"


def names_of(
    sight: ObservationKind, actions: tuple[str, ...], *, turning: bool = False
) -> tuple[str, ...]:
    """Return the names of the components of an observation; for arguments see `observation_of`."""
    if sight is ObservationKind.paper:
        poses = [f"{who}_{k}" for who in ("robot", "target") for k in _POSE]
        return (*poses, *_VELOCITY)
    away = ("target_x", "target_y", "target_z", "drift_x", "drift_y", "drift_z")
    rest = ("spin_x", "spin_y", "spin_z", "up_x", "up_y", "height", "submersion")
    first = () if sight is ObservationKind.blind else away
    more = ("up_z", "east_x", "east_y", "east_z") if turning else ()
    return (*first, *_VELOCITY, *rest, *more, *(f"last_{name}" for name in actions))


def observation_of(sight: ObservationKind, now: Instant, *, turning: bool = False) -> Array:
    """Return observations, shape (N, d).

    Args:
        sight: what is seen.
        now: of N robots.
        turning: whether nobody holds the heading: the whole attitude is seen then, as the
            directions of world z and x in body axes.
    """
    xp = namespace(now.position)
    if sight is ObservationKind.paper:
        still = now.time * 0.0
        upright = xp.concat((still, still, still, still + 1.0), axis=1)
        pose = xp.concat((now.position, quaternion(now.rotation)), axis=1)
        return xp.concat((pose, now.target, upright, now.velocity), axis=1)
    away = (now.target - now.position - level_hand_offset(now), now.target_velocity)
    own = (
        now.velocity,
        now.angular_velocity,
        now.rotation[:, 2, 0:2],
        now.position[:, 2:3],
        now.submersion,
    )
    first = () if sight is ObservationKind.blind else away
    more = (now.rotation[:, 2, 2:3], now.rotation[:, 0, :]) if turning else ()
    return xp.concat((*first, *own, *more, now.action), axis=1)


def level_hand_offset(now: Instant) -> Array:
    """Return the offset from the body to the hand with the body level [m], shape (N, 3).

    The heading is kept. A body that leans to go somewhere swings its hand the other way: a hand
    that is led by where it is would swing on and on.
    """
    xp = namespace(now.position)
    arm = (now.tool - now.position)[:, None, :]
    x, y, z = (xp.sum(arm[:, 0, :] * now.rotation[:, :, k], axis=1) for k in range(3))
    ahead = now.rotation[:, :2, 0]
    c, s = (ahead / xp.sqrt(xp.sum(ahead * ahead, axis=1, keepdims=True) + TINY)).T
    return xp.stack((c * x - s * y, s * x + c * y, z), axis=1)


def quaternion(rotation: Array) -> Array:
    """Return quaternions, x y z w with w not below zero, shape (N, 4).

    Each component by the root of its own square, its sign by the differences of the matrix: exact
    but for the sign of what is nearly zero, which is good enough to be seen.

    Args:
        rotation: shape (N, 3, 3).
    """
    xp = namespace(rotation)
    a, b, c = (rotation[:, k, k] for k in range(3))
    zero = a * 0.0

    def part(square: Array, sign: Array) -> Array:
        size = 0.5 * xp.sqrt(xp.maximum(1.0 + square, zero))
        return xp.where(sign < 0.0, -size, size)

    x = part(a - b - c, rotation[:, 2, 1] - rotation[:, 1, 2])
    y = part(b - a - c, rotation[:, 0, 2] - rotation[:, 2, 0])
    z = part(c - a - b, rotation[:, 1, 0] - rotation[:, 0, 1])
    return xp.stack((x, y, z, part(a + b + c, zero)), axis=1)
