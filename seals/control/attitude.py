"""Attitude error on SO(3), and the attitude for a wanted force; batch first."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, namespace


def lean_for(force: Array, yaw: Any, *, tilt: Any, least: Any) -> Array:
    """Return attitudes with their z axes along wanted forces, within a tilt limit.

    A force that points down is taken for one that pulls along -z: the robot leans the other way.
    Near zero a force has no direction, and the robot stays level.

    Args:
        force: wanted, world axes [N], shape (3,) or (B, 3).
        yaw: heading of body x [rad], a number or shape (B, 1).
        tilt: largest lean [rad], likewise.
        least: vertical part below which the lean fades [N], likewise.

    Returns:
        R_WD of the wanted attitude, shape (3, 3) or (B, 3, 3).

    Example:
        >>> bool(np.allclose(lean_for(np.array([0, 0, 5.0]), 0.0, tilt=0.5, least=1.0), np.eye(3)))
        True
    """
    if force.ndim == 1:
        yaw, tilt, least = (np.full((1, 1), x) for x in (yaw, tilt, least))
        return lean_for(force[None], yaw, tilt=tilt, least=least)[0]
    xp = namespace(force)
    x, y, z = (force[:, k : k + 1] for k in range(3))
    size = xp.maximum(z * z, least * least)
    if type(size) is np.ndarray and not size.all():
        # without gravity the least is zero as well; NumPy alone would go on with nan
        raise ZeroDivisionError("a force of zero has no direction for the tilt")
    per = z / size
    x, y = x * per, y * per
    aside, most = xp.sqrt(x * x + y * y), xp.tan(tilt)
    share = xp.minimum(most / xp.maximum(aside, most * 1e-9), most * 0.0 + 1.0)
    x, y = x * share, y * share
    size = xp.sqrt(1.0 + x * x + y * y)
    x, y, z = x / size, y / size, 1.0 / size
    # body y = z x heading, then body x = y x z
    ahead, left = xp.cos(yaw), xp.sin(yaw)
    u, v, w = -z * left, z * ahead, x * left - y * ahead
    size = xp.sqrt(u * u + v * v + w * w)
    u, v, w = u / size, v / size, w / size
    rows = [v * z - w * y, u, x, w * x - u * z, v, y, u * y - v * x, w, z]
    return xp.reshape(xp.concat(rows, axis=1), (-1, 3, 3))


def attitude_error(rotation: Array, wanted: Array) -> Array:
    """Return the rotation vector from the wanted attitude to the present one, body axes [rad].

    Equation:
        e = vee(R_d^T R - R^T R_d) / 2, lengthened from the sine of the angle to the angle, so that
        an upside-down robot still turns back.

    Args:
        rotation: R_WB, shape (3, 3) or (B, 3, 3).
        wanted: R_WD, likewise.

    References:
        Lee, Leok, McClamroch 2010, Geometric tracking control of a quadrotor UAV on SE(3), CDC.
    """
    if rotation.ndim == 2:
        return attitude_error(rotation[None], wanted[None])[0]
    xp = namespace(rotation)
    e = xp.matmul(xp.permute_dims(wanted, (0, 2, 1)), rotation)
    x, y, z = (0.5 * (e[:, i, j] - e[:, j, i])[:, None] for i, j in ((2, 1), (0, 2), (1, 0)))
    sine = xp.sqrt(x * x + y * y + z * z)
    cosine = 0.5 * (e[:, 0, 0] + e[:, 1, 1] + e[:, 2, 2] - 1.0)[:, None]
    longer = xp.atan2(sine, cosine) / xp.maximum(sine, sine * 0.0 + 1e-9)
    small = sine < 1e-6
    # half a turn has no direction of its own: any axis will do
    half = xp.where(cosine > 0.0, x, x * 0.0 + np.pi)
    first = xp.where(small, half, x * longer)
    rest = (xp.where(small, part, part * longer) for part in (y, z))
    return xp.concat((first, *rest), axis=1)
