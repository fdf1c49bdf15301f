"""Local polynomial smoothing of measured channels with gaps: values and slopes."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats

_REACH = 3.0
"""Half width of the kernel in bandwidths."""


def local_polynomial(
    values: Floats, step: float, *, bandwidth: float, degree: int = 3
) -> tuple[Floats, Floats]:
    """Value and slope of a local polynomial fit at every row.

    Args:
        values: evenly spaced rows, NaN where there is no sample, shape (T, k).
        step: between rows [s].
        bandwidth: standard deviation of the Gaussian weight [s]; doubled where too few samples lie
            within reach.
        degree: of the polynomial.

    Returns:
        Values and slopes, each (T, k).
    """
    good = np.isfinite(values[:, 0])
    half = int(np.ceil(_REACH * bandwidth / step))
    lags = np.arange(-half, half + 1) * step / bandwidth
    weight = np.exp(-0.5 * lags**2)
    filled = np.where(good[:, None], values, 0.0)
    powers = [weight * lags**i for i in range(2 * degree + 1)]
    sums = [_correlate(good.astype(float)[:, None], w)[:, 0] for w in powers]
    right = [_correlate(filled, w) for w in powers[: degree + 1]]
    matrix = np.array([[sums[i + j] for j in range(degree + 1)] for i in range(degree + 1)])
    matrix = np.moveaxis(matrix, -1, 0)
    poor = np.linalg.cond(matrix) > 1e9
    if poor.any() and half < len(values):
        wide = local_polynomial(values, step, bandwidth=2.0 * bandwidth, degree=degree)
        matrix[poor] = np.eye(degree + 1)
    solved = np.linalg.solve(matrix, np.stack(right, axis=1))
    value, slope = solved[:, 0], solved[:, 1] / bandwidth
    if poor.any() and half < len(values):
        value[poor], slope[poor] = wide[0][poor], wide[1][poor]
    return value, slope


def _correlate(values: Floats, weight: Floats) -> Floats:
    """Sum of weight(lag) * values(row + lag) along the rows, zero outside."""
    half = len(weight) // 2
    padded = np.pad(values, ((half, half), (0, 0)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, len(weight), axis=0)
    summed: Floats = windows @ weight
    return summed
