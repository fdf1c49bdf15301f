"""Quaternions and rotation matrices of many cases at once; the batch is the last axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis, (3, ...) by (3, ...)."""
    return np.stack(
        (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    )


def to_world(turn: Array, body: Array) -> Array:
    """Body vectors (3, n) in world axes, with matrices (3, 3, n)."""
    return (turn * body).sum(1)


def to_body(turn: Array, world: Array) -> Array:
    """World vectors (3, n) in body axes, with matrices (3, 3, n)."""
    return (turn * world[:, None]).sum(0)


def matrix(q: Array) -> Array:
    """Rotation matrices (3, 3, n) of quaternions (4, n), scalar first, any length."""
    w, x, y, z = q
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    sx, sy, sz = scale * x, scale * y, scale * z
    wx, wy, wz = w * sx, w * sy, w * sz
    xx, xy, xz = x * sx, x * sy, x * sz
    yy, yz, zz = y * sy, y * sz, z * sz
    out = np.empty((3, 3, *w.shape))
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - yy - zz, xy - wz, xz + wy
    out[1, 0], out[1, 1], out[1, 2] = xy + wz, 1.0 - xx - zz, yz - wx
    out[2, 0], out[2, 1], out[2, 2] = xz - wy, yz + wx, 1.0 - xx - yy
    return out


def multiply(a: Array, b: Array) -> Array:
    """Hamilton product of quaternions (4, ...), scalar first."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return np.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        )
    )


def rate(q: Array, w: Array) -> Array:
    """Time derivative of quaternions (4, n) under body rates (3, n)."""
    return 0.5 * multiply(q, np.concatenate((np.zeros_like(w[:1]), w)))


def exponential(r: Array) -> Array:
    """Quaternions (4, ...) of rotation vectors (3, ...)."""
    angle = np.sqrt((r * r).sum(0))
    half = np.where(angle < 1e-8, 0.5, np.sin(0.5 * angle) / np.maximum(angle, 1e-12))
    return np.concatenate((np.cos(0.5 * angle)[None], half * r))


def logarithm(q: Array) -> Array:
    """Rotation vectors (3, ...) of unit quaternions (4, ...), the short way round."""
    q = np.where(q[:1] < 0.0, -q, q)
    size = np.sqrt((q[1:] ** 2).sum(0))
    angle = 2.0 * np.arctan2(size, q[0])
    return np.where(size < 1e-10, 2.0, angle / np.maximum(size, 1e-12)) * q[1:]


def conjugate(q: Array) -> Array:
    """Inverse of unit quaternions (4, ...)."""
    return np.concatenate((q[:1], -q[1:]))


def from_angles(roll: float, pitch: float, yaw: float) -> Array:
    """Quaternion (4,) of the turn yaw, then pitch, then roll about the turned axes."""
    one = [
        exponential(np.array(v, dtype=float))
        for v in ([0.0, 0.0, yaw], [0.0, pitch, 0.0], [roll, 0.0, 0.0])
    ]
    return multiply(multiply(one[0], one[1]), one[2])


def turn_of(r: Array) -> Array:
    """Rotation matrix (3, 3, ...) of a rotation vector (3, ...)."""
    return matrix(exponential(r))
