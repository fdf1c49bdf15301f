"""Local polynomial smoothing of measured channels with gaps: values and slopes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats

_REACH = 3.0
"""Half width of the kernel in bandwidths."""
_NARROW = 2.0
"""Bandwidth in rows below which a cubic is no longer determined well by what it holds."""
_MISSED = 2.0
"""Root mean square residual about a row from which a fit is too stiff there [1-sigma]; noise alone
leaves one."""


def local_polynomial(
    values: Floats, step: float, *, bandwidth: float, degree: int = 3
) -> tuple[Floats, Floats]:
    """Value and slope of a local polynomial fit at every row.

    Args:
        values: evenly spaced rows, NaN where there is no sample, of each column by itself, shape
            (T, k).
        step: between rows [s].
        bandwidth: standard deviation of the Gaussian weight [s]; doubled where too few samples lie
            within reach.
        degree: of the polynomial.

    Returns:
        Values and slopes, each (T, k).
    """
    given = np.isfinite(values)
    if not given.any():
        return np.full(values.shape, np.nan), np.full(values.shape, np.nan)
    if (given != given[:, :1]).any():
        each = [
            local_polynomial(values[:, [k]], step, bandwidth=bandwidth, degree=degree)
            for k in range(values.shape[1])
        ]
        value, slope = (np.concatenate(parts, axis=1) for parts in zip(*each, strict=True))
        return value, slope
    good = given[:, 0]
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


def adaptive_polynomial(
    values: Floats, step: float, *, bandwidth: float, sigma: float
) -> tuple[Floats, Floats]:
    """Value and slope of a local polynomial fit whose bandwidth is halved where it is too stiff.

    At an impact a wide fit leaves the measurements by many times their noise; there narrower ones
    take its place, as long as each still misses them.

    Args:
        values: evenly spaced rows, NaN where there is no sample, shape (T, k).
        step: between rows [s].
        bandwidth: the widest [s].
        sigma: white noise of the values, 1-sigma.

    Returns:
        Values and slopes, each (T, k).
    """
    value, slope = local_polynomial(values, step, bandwidth=bandwidth)
    stiff = np.ones(len(values), dtype=bool)
    while bandwidth >= _NARROW * step:
        # mean square of the columns that have a sample in a row, NaN where none has
        residual = (values - value) / sigma
        given = np.isfinite(residual)
        total = np.where(given, residual, 0.0) ** 2
        mean: Floats = total.sum(axis=1) / np.maximum(given.sum(axis=1), 1)
        square = np.where(given.any(axis=1), mean, np.nan)
        stiff &= _missed(square, max(1, round(bandwidth / step)))
        if not stiff.any():
            break
        bandwidth *= 0.5
        closer = local_polynomial(values, step, bandwidth=bandwidth)
        value[stiff], slope[stiff] = closer[0][stiff], closer[1][stiff]
    return value, slope


def _missed(square: Floats, half: int) -> NDArray[np.bool_]:
    """Return a mask of rows near which a fit misses the samples, shape (T,).

    Args:
        square: whitened squared residual of every row, NaN for no sample, shape (T,).
        half: rows to either side that count.
    """
    good = np.isfinite(square)
    if not good.any():
        return np.zeros(len(square), dtype=bool)
    ones = np.ones(2 * half + 1)
    total = _correlate(np.where(good, square, 0.0)[:, None], ones)[:, 0]
    mean = total / np.maximum(_correlate(good.astype(float)[:, None], ones)[:, 0], 1.0)
    # a stated noise that is too small counts for less
    return mean > _MISSED**2 * max(1.0, float(np.median(mean[good])))


def _correlate(values: Floats, weight: Floats) -> Floats:
    """Sum of weight(lag) * values(row + lag) along the rows, zero outside."""
    half = len(weight) // 2
    padded = np.pad(values, ((half, half), (0, 0)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, len(weight), axis=0)
    return windows @ weight
