"""Rotations and cross products, batch first, on any array library.

Quaternions are ordered x, y, z, w (``q_WB_xyzw``); ``R_WB`` turns body vectors into world vectors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, Floats, as_like, columns, fixed, namespace

AXES = ("x", "y", "z")

# R = sum_ij K[r, 4 i + j] q_i q_j: nine entries of the rotation matrix as quadratic forms of (x,
# y, z, w).
_QUADRATIC = {
    0: {(0, 0): 1, (1, 1): -1, (2, 2): -1, (3, 3): 1},
    1: {(0, 1): 2, (2, 3): -2},
    2: {(0, 2): 2, (1, 3): 2},
    3: {(0, 1): 2, (2, 3): 2},
    4: {(0, 0): -1, (1, 1): 1, (2, 2): -1, (3, 3): 1},
    5: {(1, 2): 2, (0, 3): -2},
    6: {(0, 2): 2, (1, 3): -2},
    7: {(1, 2): 2, (0, 3): 2},
    8: {(0, 0): -1, (1, 1): -1, (2, 2): 1, (3, 3): 1},
}


def _forms() -> Floats:
    forms = np.zeros((9, 16))
    for row, terms in _QUADRATIC.items():
        for (i, j), factor in terms.items():
            forms[row, 4 * i + j] = factor
    return forms


_FORMS = _forms()
_FORMS_T = np.ascontiguousarray(_FORMS.T)
FEW = 48
"""Number of rows below which one small matrix product per row beats column operations."""


def matrix_of(quaternion: Array) -> Array:
    """Rotation matrices of unit quaternions.

    Args:
        quaternion: x, y, z, w, shape (N, 4).

    Returns:
        Rotation matrices, shape (N, 3, 3), stored entry by entry.
    """
    q = quaternion.T
    rows = q.shape[1]
    if type(q) is np.ndarray and rows < FEW:
        forms = (quaternion[:, :, None] * quaternion[:, None, :]).reshape(rows, 16)
        return (forms @ _FORMS_T).reshape(rows, 3, 3)
    if type(q) is np.ndarray:
        forms = (q[:, None, :] * q[None, :, :]).reshape(16, rows)
        return (_FORMS @ forms).reshape(3, 3, rows).transpose(2, 0, 1)
    xp = namespace(quaternion)
    outer = xp.reshape(q[:, None, :] * q[None, :, :], (16, rows))
    entries = xp.reshape(xp.matmul(fixed(_FORMS, quaternion), outer), (3, 3, rows))
    return xp.permute_dims(entries, (2, 0, 1))


MANY = 256
"""Number of rows from which a cross product is cheapest component by component."""


def rotate(rotation: Array, vector: Array) -> Array:
    """Rotate vectors by matrices: R v, shapes (N, 3, 3) and (N, 3)."""
    return (
        rotation[:, :, 0] * vector[:, 0:1]
        + rotation[:, :, 1] * vector[:, 1:2]
        + rotation[:, :, 2] * vector[:, 2:3]
    )


def unrotate(rotation: Array, vector: Array) -> Array:
    """Rotate vectors by transposed matrices: R^T v, shapes (N, 3, 3) and (N, 3)."""
    if type(rotation) is np.ndarray and len(rotation) < FEW:
        return np.matmul(vector[:, None, :], rotation)[:, 0, :]
    return (
        rotation[:, 0, :] * vector[:, 0:1]
        + rotation[:, 1, :] * vector[:, 1:2]
        + rotation[:, 2, :] * vector[:, 2:3]
    )


def carried(x: Any, y: Any, z: Any, w: Any, arm: Sequence[float]) -> tuple[Any, Any, Any]:
    """Rotate one vector by a unit quaternion; equal bits for numbers and for columns of many.

    Args:
        x: part of the quaternion, a number or an array, as all others.
        y: likewise.
        z: likewise.
        w: likewise.
        arm: the vector.

    Returns:
        Its three parts.

    Example:
        >>> carried(0.0, 0.0, 1.0, 0.0, (1.0, 2.0, 3.0))
        (-1.0, -2.0, 3.0)
    """
    a, b, c = arm
    p, q, r = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * p + (y * r - z * q), b + w * q + (z * p - x * r), c + w * r + (x * q - y * p)


_LEVI_CIVITA = np.zeros((3, 9))
for _i, _j, _k, _sign in (
    (0, 1, 2, 1),
    (1, 2, 0, 1),
    (2, 0, 1, 1),
    (0, 2, 1, -1),
    (2, 1, 0, -1),
    (1, 0, 2, -1),
):
    _LEVI_CIVITA[_k, 3 * _i + _j] = _sign

CROSS = np.ascontiguousarray(_LEVI_CIVITA.T)
"""Nine products a_i b_j, in rows, times this make the cross product, shape (9, 3)."""


def cross(a: Array, b: Array) -> Array:
    """Cross product of rows, shapes (N, 3); a single row is broadcast.

    All nine products at once, then one small matrix product: a third of the calls of the textbook
    form.

    Example:
        >>> cross(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 2.0, 0.0]]))
        array([[0., 0., 2.]])
    """
    if type(a) is np.ndarray and max(len(a), len(b)) >= MANY:
        return _components(a, b, np.empty((3, max(len(a), len(b)))).T)
    if type(a) is np.ndarray and max(len(a), len(b)) < FEW:
        return (a[:, :, None] * b[:, None, :]).reshape(-1, 9) @ CROSS
    outer = a.T[:, None, :] * b.T[None, :, :]
    if type(outer) is np.ndarray:
        return (_LEVI_CIVITA @ outer.reshape(9, -1)).T
    xp = namespace(a)
    return xp.matmul(fixed(_LEVI_CIVITA, a), xp.reshape(outer, (9, outer.shape[2]))).T


def cross_last(a: Array, b: Array) -> Array:
    """Cross product over the last axis of arrays of any shape (..., 3), with broadcasting."""
    if type(a) is np.ndarray and max(a.size, b.size) >= 3 * MANY:
        return _components(a, b, np.empty(np.broadcast_shapes(a.shape, b.shape)))
    outer = a[..., :, None] * b[..., None, :]
    flat = (*outer.shape[:-2], 9)
    if type(outer) is np.ndarray:
        return outer.reshape(flat) @ CROSS
    xp = namespace(a)
    return xp.matmul(xp.reshape(outer, flat), as_like(CROSS, a))


def _components(a: Floats, b: Floats, out: Floats) -> Floats:
    """Cross product over the last axis, written component by component into ``out``."""
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[..., i], b[..., j], out=out[..., k])
        out[..., k] -= a[..., j] * b[..., i]
    return out


def skew_last(vector: Array) -> Array:
    """Cross-product matrices, skew(a) b = a x b, shape (..., 3) to (..., 3, 3)."""
    xp = namespace(vector)
    flat = xp.matmul(vector, as_like(SKEW, vector))
    return xp.reshape(flat, (*vector.shape, 3))


SKEW = np.zeros((3, 9))
"""A row vector times this are the nine entries of its cross-product matrix."""
for _i in range(3):
    # skew(a)[k, j] = sum_i eps_kij a_i
    SKEW[_i] = _LEVI_CIVITA[:, 3 * _i : 3 * _i + 3].ravel()


def multiply(p: Array, q: Array) -> Array:
    """Quaternion product p q (first q turns, then p), shapes (N, 4), order x, y, z, w."""
    px, py, pz, pw = p[:, 0], p[:, 1], p[:, 2], p[:, 3]
    qx, qy, qz, qw = q[:, 0], q[:, 1], q[:, 2], q[:, 3]
    return columns(
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def quaternion_rate(quaternion: Array, angular_velocity: Array) -> Array:
    """Time derivative of q_WB_xyzw for w_WB_B [rad/s] in body axes: q' = q (w, 0) / 2."""
    x, y, z, w = (quaternion[:, i] for i in range(4))
    a, b, c = (0.5 * angular_velocity[:, i] for i in range(3))
    return columns(
        w * a + y * c - z * b, w * b - x * c + z * a, w * c + x * b - y * a, -x * a - y * b - z * c
    )


def normalised(quaternion: Array) -> Array:
    """Quaternions scaled to unit length, shape (N, 4)."""
    xp = namespace(quaternion)
    return quaternion / xp.sqrt(xp.sum(quaternion * quaternion, axis=1, keepdims=True))


def exponential(rotation_vector: Array) -> Array:
    """Quaternions (x, y, z, w) of rotation vectors [rad], shape (N, 3) to (N, 4)."""
    xp = namespace(rotation_vector)
    angle2 = xp.sum(rotation_vector * rotation_vector, axis=1, keepdims=True)
    half = 0.5 * xp.sqrt(angle2)
    # sin(h)/(2h) by its series below 1e-3 rad, where the quotient would lose digits
    small = 0.5 - angle2 / 48.0
    safe = xp.where(half > 5e-4, half, half * 0.0 + 1.0)
    scale = xp.where(half > 5e-4, 0.5 * xp.sin(safe) / safe, small)
    return xp.concat((rotation_vector * scale, xp.cos(half)), axis=1)


def rotation_vector(quaternion: Array) -> Array:
    """Rotation vectors [rad] of unit quaternions (x, y, z, w), the shorter way, shape (N, 3)."""
    xp = namespace(quaternion)
    sign = xp.where(
        quaternion[:, 3:4] < 0, quaternion[:, 3:4] * 0.0 - 1.0, quaternion[:, 3:4] * 0.0 + 1.0
    )
    vector = quaternion[:, 0:3] * sign
    scalar = quaternion[:, 3:4] * sign
    length = xp.sqrt(xp.sum(vector * vector, axis=1, keepdims=True))
    safe = xp.where(length > 1e-9, length, length * 0.0 + 1.0)
    ratio = xp.where(length > 1e-9, 2.0 * xp.atan2(safe, scalar) / safe, length * 0.0 + 2.0)
    return vector * ratio


def conjugate(quaternion: Array) -> Array:
    """Inverse of unit quaternions (x, y, z, w), shape (N, 4)."""
    return columns(-quaternion[:, 0], -quaternion[:, 1], -quaternion[:, 2], quaternion[:, 3])


def quaternion_of_rpy(rpy: Array) -> Array:
    """Quaternions (x, y, z, w) of fixed-axis roll, pitch, yaw [rad], shape (N, 3) to (N, 4).

    The order of the turns is that of URDF.
    """
    xp = namespace(rpy)
    half = 0.5 * rpy
    cr, cp, cy = (xp.cos(half[:, i]) for i in range(3))
    sr, sp, sy = (xp.sin(half[:, i]) for i in range(3))
    return columns(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def rpy_of(rotation: Floats) -> Floats:
    """Fixed-axis roll, pitch, yaw [rad] of one rotation matrix, shape (3,), in the order of URDF.

    Where the pitch is a right angle only the difference of roll and yaw is known: roll is zero.

    Example:
        >>> rpy_of(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])).round(4) + 0.0
        array([0.    , 0.    , 1.5708])
    """
    r = rotation
    cosine = np.hypot(r[0, 0], r[1, 0])
    pitch = np.arctan2(-r[2, 0], cosine)
    if cosine < 1e-9:
        return np.array([0.0, pitch, np.arctan2(-r[0, 1], r[1, 1])])
    return np.array([np.arctan2(r[2, 1], r[2, 2]), pitch, np.arctan2(r[1, 0], r[0, 0])])


def quaternion_of(rotation: Floats) -> Floats:
    """Unit quaternion x, y, z, w of one rotation matrix, shape (4,); w is not negative.

    Example:
        >>> quaternion_of(np.eye(3))
        array([0., 0., 0., 1.])
    """
    r = rotation
    # four times the squares of x, y, z, w: the largest of them is safe to divide by
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    squares = (*(1.0 + 2.0 * r[k, k] - trace for k in range(3)), 1.0 + trace)
    largest = max(range(4), key=lambda k: float(squares[k]))
    wx, wy, wz = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    xy, xz, yz = r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] + r[1, 2]
    rows = (
        (squares[0], xy, xz, wx),
        (xy, squares[1], yz, wy),
        (xz, yz, squares[2], wz),
        (wx, wy, wz, squares[3]),
    )
    q = np.array(rows[largest])
    return q * (math.copysign(1.0, q[3]) / math.sqrt(float(q @ q)))


def cross3(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors, shape (3,), faster than `numpy.cross`.

    Example:
        >>> cross3(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
        array([0., 0., 1.])
    """
    if type(a) is not np.ndarray or type(b) is not np.ndarray:
        return cross(a[None], b[None])[0]
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
