"""Differences between inertial sensors and pose of one flight that white noise does not explain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.frames import matrix_of, rotate
from seals.logs.accelerations import (
    GRAVITY,
    STEP,
    Even,
    attitude_rates,
    even,
    filtered_alike,
    second_derivative,
)
from seals.logs.log import Log
from seals.logs.time_offset import time_offset
from seals.smoothing import savitzky_golay

_SMOOTH = 15
"""Rows of the local parabolas: motion, not vibration, is compared."""
_CLEAR = 2.0
"""Deviation, over that by the white noises, from which it counts."""
_ROBUST = 1.4826
_SLOW = 51
"""Rows of the local parabolas that leave the fast part of a motion, in which noise stands out."""

_FEWEST = 200
"""Rows that are enough for a regression."""
_SURE = 0.1
"""Least share of the sensor in a difference: a flight tells it no better."""


class _Disagreement(NamedTuple):
    """Difference between an inertial channel and the pose, as an equivalent white noise.

    Args:
        sigma: equivalent white noise at the time step `STEP`, in the channel's unit.
        white: part of sigma that white noise explains: of both channels, or of the sensor alone
            where the share of the pose is told.
        of_pose: error of the pose that explains the rest of the difference, as white noise in its
            unit; 0 where that is not told.
    """

    sigma: float
    white: float
    of_pose: float = 0.0

    @property
    def clear(self) -> bool:
        """Whether the difference clearly exceeds the white noise of both channels."""
        return self.sigma > _CLEAR * self.white


def disagreement(log: Log, noise: Mapping[str, float]) -> dict[str, _Disagreement]:
    """Return the differences of gyroscope and accelerometer from the pose, by channel.

    Sensors filter, samples were interpolated where some were lost, and clocks of a radio link
    jitter: errors as slow as the motion, which differences of neighbouring samples do not show.
    Biases, scales, misalignments and delays, which a diagnosis can name, are regressed out.

    Args:
        log: in SI units, ENU and FLU.
        noise: white noise by channel, 1-sigma.
    """
    found = {}
    for stem, pose, compared in (
        ("angular_velocity", ("orientation",), _rates),
        ("specific_force", ("orientation", "position"), _forces),
    ):
        rows = even(log, (*pose, stem))
        if rows is None:
            continue
        offset = time_offset(log)
        late = 0.0 if offset is None else offset.late
        values = rows.channels[stem].T
        sensed = np.stack([np.interp(rows.time + late, rows.time, v) for v in values], axis=1)
        found[stem] = compared(rows, sensed, noise)
    return found


def _rates(rows: Even, gyro: Floats, noise: Mapping[str, float]) -> _Disagreement:
    true = smooth(attitude_rates(rows.channels["orientation"]))
    turning = np.gradient(true, STEP, axis=0)
    left = _left(smooth(gyro), [true, turning], rows.there)
    gain = _gain(smooth)
    slope = _gain(lambda v: smooth(np.gradient(v, STEP, axis=0)))
    whole = _against(left, gain, slope * noise.get("orientation", 0.0), noise["angular_velocity"])
    if not whole.clear:
        return whole
    inner = _inner(rows.there)
    share = _share(*_alike(smooth(gyro), true, inner))
    return whole._replace(
        sigma=whole.sigma * share**0.5,
        white=noise["angular_velocity"],
        of_pose=whole.sigma * (1.0 - share) ** 0.5 * gain / slope,
    )


def _forces(rows: Even, force: Floats, noise: Mapping[str, float]) -> _Disagreement:
    attitude = matrix_of(rows.channels["orientation"])
    back = np.swapaxes(attitude, -1, -2)
    weight = np.array([0.0, 0.0, GRAVITY])
    sensed = filtered_alike(rotate(attitude, force) - weight) + weight
    true = rotate(back, second_derivative(rows.channels["position"]) + weight)
    turning = np.gradient(smooth(attitude_rates(rows.channels["orientation"])), STEP, axis=0)
    jerk = np.gradient(true, STEP, axis=0)
    left = _left(rotate(back, sensed), [true, jerk, turning], rows.there)
    of_pose = _gain(second_derivative) * noise.get("position", 0.0)
    whole = _against(left, _gain(filtered_alike), of_pose, noise["specific_force"])
    if not whole.clear:
        return whole
    inner = _inner(rows.there)
    share = _share(*_alike(rotate(back, sensed), true, inner))
    return whole._replace(sigma=whole.sigma * share**0.5, white=noise["specific_force"])


def _against(left: Floats, gain: float, of_pose: float, white: float) -> _Disagreement:
    """Convert residuals to the white noise that gives them after a filter of gain `gain`."""
    spread = _ROBUST * np.median(np.abs(left), axis=0)
    return _Disagreement(
        sigma=float(np.sqrt(np.mean(spread**2))) / gain,
        white=float(np.hypot(of_pose / gain, white)),
    )


def _alike(sensed: Floats, posed: Floats, inner: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Return the fast parts of both at valid rows, the second with gain and axes of the first.

    They are those of the slow part of the motion, of which noise is a small share.
    """
    slow = [savitzky_golay(values, _SLOW, 2) for values in (sensed, posed)]
    a, b = (values[inner] - values[inner].mean(axis=0) for values in slow)
    gain = np.linalg.lstsq(b, a, rcond=None)[0]
    return (sensed - slow[0])[inner], (posed - slow[1])[inner] @ gain


def _share(sensed: Floats, posed: Floats) -> float:
    """Share of a sensor in the variance of its difference from the pose.

    Equation:
        With the motion s, a = s + e_a and b = s + e_b: var(e_a) = var(a) - cov(a, b).
    """
    a, b = sensed - sensed.mean(axis=0), posed - posed.mean(axis=0)
    both = np.sum(a * b)
    own, other = max(np.sum(a * a) - both, 0.0), max(np.sum(b * b) - both, 0.0)
    share = float(own / (own + other)) if own + other > 0.0 else 1.0
    return max(share, _SURE)


def smooth(values: Floats) -> Floats:
    """Smooth evenly sampled rows by local parabolas (Savitzky-Golay filter), shape (T, k)."""
    return savitzky_golay(values, _SMOOTH, 2)


def _left(values: Floats, known: list[Floats], there: NDArray[np.bool_]) -> Floats:
    """Residual of a regression on a constant and known columns, at valid rows, shape (n, k)."""
    columns = np.concatenate([np.ones((len(values), 1)), *known], axis=1)
    inner = _inner(there)
    model = np.linalg.lstsq(columns[inner], values[inner], rcond=None)[0]
    left: Floats = values[inner] - columns[inner] @ model
    return left


def _inner(there: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Valid samples away from ends and gaps, where the filters lean on nothing.

    Where gaps leave too few of them, those away from the ends.
    """
    around = np.ones(4 * _SMOOTH + 1)
    padded = np.pad(there.astype(float), 2 * _SMOOTH)
    inner: NDArray[np.bool_] = np.convolve(padded, around, mode="valid") > around.size - 0.5
    if inner.sum() < _FEWEST:
        inner = there.copy()
        inner[: 2 * _SMOOTH] = inner[-2 * _SMOOTH :] = False
    return inner


def _gain(filtered: Any) -> float:
    """Standard deviation of filtered white noise of unit variance."""
    pulse = np.zeros((401, 1))
    pulse[200] = 1.0
    return float(np.sqrt(np.sum(filtered(pulse) ** 2)))
