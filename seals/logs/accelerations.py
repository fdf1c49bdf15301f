"""Acceleration of a body from its position, and from accelerometer and attitude."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.frames import conjugate, matrix_of, multiply, normalised, rotate, rotation_vector
from seals.logs.log import Log
from seals.logs.resample import one_sign
from seals.smoothing import savitzky_golay

STEP = 0.01
"""Of the even grid on which channels are compared [s]."""
_BRIDGED = 0.25
"""Longest gap between samples of a channel across which it is interpolated [s]."""
_WINDOW = 0.61
"""Of the local polynomials [s]: position noise of 1 cm at 100 Hz leaves 0.1 m/s^2."""
_LEAST = 300
_LARGEST = 30.0
"""Accelerations beyond are impacts [m/s^2]."""
_MOST = 200_000
GRAVITY = 9.81


class Even(NamedTuple):
    """Channels on an even time grid, and a mask of valid samples; q is x, y, z, w."""

    time: Floats
    there: NDArray[np.bool_]
    channels: dict[str, Floats]


def even(log: Log, stems: tuple[str, ...]) -> Even | None:
    """Return the longest run of a log with the channels on an even grid; None if too short."""
    parts = [part for part in log.segments() if part.rows > 1]
    if not parts or not all(
        log.has(stem) and np.isfinite(log.channel(stem)).any(axis=0).all() for stem in stems
    ):
        return None
    part = max(parts, key=lambda p: float(p.time[-1] - p.time[0]))
    rows = int((part.time[-1] - part.time[0]) / STEP) + 1
    if not _LEAST <= rows <= _MOST:
        return None
    time = part.time[0] + np.arange(rows) * STEP
    there = np.ones(rows, dtype=bool)
    found = {}
    for stem in stems:
        values = part.channel(stem)
        if stem == "orientation":
            values = one_sign(values[:, [1, 2, 3, 0]])
        good = np.isfinite(values).all(axis=1)
        if good.sum() < _LEAST // 10:
            return None
        stamps = part.time[good]
        after = np.clip(np.searchsorted(stamps, time), 1, stamps.size - 1)
        there &= stamps[after] - stamps[after - 1] < _BRIDGED
        there &= (time >= stamps[0]) & (time <= stamps[-1])
        found[stem] = np.stack([np.interp(time, stamps, v) for v in values[good].T], axis=1)
    if "orientation" in found:
        found["orientation"] = normalised(found["orientation"])
    return Even(time, there, found) if there.sum() >= _LEAST else None


def second_derivative(position: Floats) -> Floats:
    """Return the second derivative of local cubic polynomials, shape (T, k)."""
    return savitzky_golay(position, int(_WINDOW / STEP) | 1, 3, derivative=2, step=STEP)


def filtered_alike(acceleration: Floats) -> Floats:
    """Return an acceleration filtered like `second_derivative` filters a position.

    The place of row n + 1 is the double sum up to row n: its second difference about a row is the
    acceleration of that row. A sum up to the row itself would be a step early.
    """
    place = np.zeros_like(acceleration)
    np.cumsum(np.cumsum(acceleration[:-1], axis=0), axis=0, out=place[1:])
    return second_derivative(place * STEP**2)


def world_acceleration(orientation: Floats, force: Floats) -> Floats:
    """Return R f - g in the world, filtered as the second derivative of the position.

    Args:
        orientation: q_WB_xyzw, shape (T, 4).
        force: specific force, body axes [m/s^2], shape (T, 3).
    """
    raw = rotate(matrix_of(orientation), force) - np.array([0.0, 0.0, GRAVITY])
    return filtered_alike(np.clip(raw, -_LARGEST, _LARGEST))


def attitude_rates(orientation: Floats) -> Floats:
    """Return body rates of an attitude q_WB_xyzw by central differences, shape (T, 3) [rad/s]."""
    turn = rotation_vector(multiply(conjugate(orientation[:-2]), orientation[2:])) / (2.0 * STEP)
    return np.concatenate([turn[:1], turn, turn[-1:]])
