"""Time offset between two streams by cross-correlation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.logs.accelerations import (
    STEP,
    attitude_rates,
    even,
)
from seals.logs.log import Log
from seals.smoothing import savitzky_golay

_MOST = int(0.5 / STEP)
"""Largest offset that is looked for, in rows."""
_SMOOTH = 15
"""Rows of the local parabolas through both rates."""
_WINDOW = 800
"""Rows of a stretch that gives an offset of its own; the answer is their weighted median."""
_OUTLIER = 5.0
"""Robust standard deviations at which samples are cut: a hard landing must not decide."""
_LEAST_RATE = 0.05
_LEAST_LIKENESS = 0.3
"""Correlation of noise alone at the best of all offsets, with room."""
_SURE, _SHARE = 0.01, 3.0
"""Spread of the stretches up to which an offset is told [s], and its share of a larger offset."""


class Offset(NamedTuple):
    """Delay of the inertial channels of a log against its pose.

    Args:
        late: median over stretches of the log; negative for early [s].
        spread: half the distance of the quartiles of the stretches [s].
        likeness: weighted mean correlation of what was compared, once shifted [1].
    """

    late: float
    spread: float
    likeness: float


def time_offset(log: Log) -> Offset | None:
    """Estimate the delay of the inertial channels of a log against its pose.

    The gyroscope is compared with the rate of the attitude; without either, where the body hardly
    turns, or turns so steadily that the stretches disagree, there is None. Each stretch of some
    seconds gives an offset; the weight of one is c^2 / (1 - c^2) with the correlation c. (The
    accelerometer tells nothing more: its level components follow the attitude, whose clock is that
    of the pose.)
    """
    rows = even(log, ("orientation", "angular_velocity"))
    if rows is None:
        return None
    rates = _smooth(attitude_rates(rows.channels["orientation"]))
    if float(np.sqrt(np.mean(rates[rows.there] ** 2))) < _LEAST_RATE:
        return None
    gyro = _smooth(rows.channels["angular_velocity"])
    found = _median(rates, gyro, rows.there)
    if found is None or found.likeness < _LEAST_LIKENESS:
        return None
    return found if found.spread <= max(_SURE, abs(found.late) / _SHARE) else None


def _median(true: Floats, late: Floats, there: NDArray[np.bool_]) -> Offset | None:
    """Return the weighted median of the offsets of stretches that overlap by half."""
    true, late = _cut(true, there), _cut(late, there)
    found = []
    for first in range(0, max(len(true) - _WINDOW, 0) + 1, _WINDOW // 2):
        part = slice(first, first + _WINDOW)
        if there[part].sum() >= min(_WINDOW, len(true)) // 2:
            found.append(delay_between(true[part], late[part], there[part]))
    if not found:
        return None
    offsets, likeness = np.array(found).T
    weight = np.maximum(likeness, 1e-3) ** 2 / (1.0 - np.minimum(likeness, 0.999) ** 2)
    order = np.argsort(offsets)
    share = np.cumsum(weight[order]) / weight.sum()
    low, middle, high = offsets[order][np.searchsorted(share, (0.25, 0.5, 0.75))]
    mean = float(weight @ likeness / weight.sum())
    return Offset(float(middle), 0.5 * float(high - low), mean)


def delay_between(
    true: Floats, late: Floats, there: NDArray[np.bool_], *, step: float = STEP, most: int = _MOST
) -> tuple[float, float]:
    """Return the delay of one signal against another [s], and their correlation at it.

    Args:
        true: of the earlier stream, even rows, shape (T, k).
        late: the same quantity by the other stream, shape (T, k).
        there: rows in which both have samples, shape (T,).
        step: time between rows [s].
        most: largest delay looked for, in rows.

    Example:
        >>> wave = np.sin(np.arange(2000) * 0.03)[:, None]
        >>> held = np.ones(2000, dtype=bool)
        >>> shift, likeness = delay_between(wave, np.roll(wave, 7, axis=0), held)
        >>> round(shift, 3), likeness > 0.99
        (0.07, True)
    """
    scores = np.array([_likeness(true, late, there, k) for k in range(-most, most + 1)])
    best = int(np.argmax(scores))
    part = 0.0
    if 0 < best < 2 * most:
        before, at, after = scores[best - 1 : best + 2]
        bend = before - 2.0 * at + after
        part = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(best - most + part) * step, float(scores[best])


def _likeness(true: Floats, late: Floats, there: NDArray[np.bool_], shift: int) -> float:
    """Correlation of true(t - shift) with late(t) over the rows that both have."""
    count = len(true)
    first, last = max(0, shift), count + min(0, shift)
    rows = there[first:last] & there[first - shift : last - shift]
    a, b = true[first - shift : last - shift][rows], late[first:last][rows]
    if len(a) < 2:
        return 0.0
    return cosine(a - a.mean(axis=0), b - b.mean(axis=0))


def cosine(a: Floats, b: Floats) -> float:
    """Return the cosine between two arrays of one shape, 0 where one of them is zero [1]."""
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0.0 else 0.0


def _cut(values: Floats, there: NDArray[np.bool_]) -> Floats:
    """Return values cut at some robust standard deviations from the median."""
    middle = np.median(values[there], axis=0)
    spread = 1.4826 * np.median(np.abs(values[there] - middle), axis=0)
    return np.clip(values, middle - _OUTLIER * spread, middle + _OUTLIER * spread)


def _smooth(values: Floats) -> Floats:
    return savitzky_golay(values, _SMOOTH, 2)
