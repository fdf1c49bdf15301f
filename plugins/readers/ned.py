"""Attitude and vectors of autopilots: north-east-down and forward-right-down to ENU and FLU."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.frames import matrix_of, normalised, unrotate

_ROOT_HALF = float(np.sqrt(0.5))
_EARTH = 6378137.0
_SQUEEZED = 6.69437999014e-3
"""Equatorial radius [m] and squared eccentricity of WGS 84."""


def quaternion_of(roll: Floats, pitch: Floats, yaw: Floats) -> tuple[Floats, ...]:
    """Return w, x, y, z of the turn Rz(yaw) Ry(pitch) Rx(roll), angles in rad; NaN if infinite.

    Example:
        >>> [float(np.round(part, 3)) for part in quaternion_of(*np.radians([0.0, 0.0, 90.0]))]
        [0.707, 0.0, 0.0, 0.707]
    """
    known = [0.5 * np.where(np.isfinite(angle), angle, np.nan) for angle in (roll, pitch, yaw)]
    (cr, cp, cy), (sr, sp, sy) = ([turn(half) for half in known] for turn in (np.cos, np.sin))
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def flu_in_enu(w: Floats, x: Floats, y: Floats, z: Floats) -> Floats:
    """Return q_WB_xyzw from FLU to ENU, of a quaternion from FRD to NED, shape (samples, 4)."""
    # (0, r, r, 0) x q x (1, 0, 0, 0), both half turns multiplied out, with r = sqrt(1/2)
    return np.stack([x + y, x - y, w - z, w + z], axis=1) * _ROOT_HALF


def orientation(q: Floats) -> dict[str, Floats]:
    """Return the columns of an attitude, from q_WB_xyzw of shape (samples, 4)."""
    return {f"orientation_{axis}": q[:, k] for k, axis in enumerate("xyzw")}


def flu(x: Floats, y: Floats, z: Floats) -> Floats:
    """Return body vectors in FLU, of those in FRD, shape (samples, 3)."""
    return np.stack([x, -y, -z], axis=1)


def enu(north: Floats, east: Floats, down: Floats) -> Floats:
    """Return world vectors in ENU, of those in NED, shape (samples, 3)."""
    return np.stack([east, north, -down], axis=1)


def in_body(
    world: Floats, stamps: NDArray[np.int64], times: NDArray[np.int64], q: Floats
) -> Floats:
    """Return world vectors in body axes, by the attitude between its samples.

    Args:
        world: in ENU, shape (samples, 3).
        stamps: of the vectors, shape (samples,).
        times: of the attitude, on the same clock, shape (attitudes,).
        q: q_WB_xyzw, shape (attitudes, 4).

    Returns:
        Vectors in FLU, shape (samples, 3); NaN before the first attitude and after the last.
    """
    order = np.argsort(times, kind="stable")
    times, q = times[order].astype(np.float64), q[order]
    # q and -q are one attitude: neighbours on one side, so that the mean of two is between them
    flips = np.cumsum(np.append(0, np.sum(q[1:] * q[:-1], axis=1) < 0.0)) % 2
    q = np.where(flips[:, None] == 1, -q, q)
    at = np.stack([np.interp(stamps, times, q[:, k]) for k in range(4)], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        turned = unrotate(matrix_of(normalised(at)), world)
    outside = (stamps < times[0]) | (stamps > times[-1])
    return np.where(outside[:, None], np.nan, turned)


def from_first(latitude: Floats, longitude: Floats, height: Floats) -> Floats:
    """Return places east, north and up of the first one, in the plane that touches there.

    Equation:
        With the radii of the ellipsoid at the first place, M of the meridian and N across it:
        east = (N + h) cos(lat) dlon, north = (M + h) dlat. Good to 1e-4 of the distance within
        some kilometres.

    Args:
        latitude: [rad], NaN where there is none, shape (samples,).
        longitude: [rad], as above.
        height: above the ellipsoid or the sea [m], as above.
    """
    good = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(height))
    if not good.size:
        return np.full((latitude.size, 3), np.nan)
    lat, lon, up = (float(values[good[0]]) for values in (latitude, longitude, height))
    squeezed = 1.0 - _SQUEEZED * np.sin(lat) ** 2
    across, along = _EARTH / np.sqrt(squeezed), _EARTH * (1.0 - _SQUEEZED) / squeezed**1.5
    turn = np.mod(longitude - lon + np.pi, 2.0 * np.pi) - np.pi
    return np.stack(
        [(across + up) * np.cos(lat) * turn, (along + up) * (latitude - lat), height - up], axis=1
    )
