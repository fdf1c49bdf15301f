"""Noise estimate of a measured channel from the data alone, and smoothing of samples."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats

_ORDER = 3
_GAIN = math.sqrt(sum(math.comb(_ORDER, k) ** 2 for k in range(_ORDER + 1)))


def noise_of(values: Floats, *, stated: float | None = None) -> Floats:
    """Estimate white noise by third differences.

    Equation:
        sigma = 1.4826 median(abs(D3 y)) / sqrt(20); third differences remove motion up to a
        parabola, the median removes impacts, and sqrt(1 + 9 + 9 + 1) is the gain of D3 for white
        noise.

    Args:
        values: samples in time order, shape (rows, k); NaN is skipped.
        stated: noise stated by the data sheet, used for components with too few samples.

    Returns:
        One standard deviation per component, shape (k,); NaN where nothing is known.

    Limitations:
        Coloured noise and slow errors (scale, alignment) are not in it; quantisation is, from its
        third part on.
    """
    out = np.full(values.shape[1], np.nan if stated is None else stated)
    for k in range(values.shape[1]):
        y = values[np.isfinite(values[:, k]), k]
        if y.size < 12:
            continue
        spread = np.abs(np.diff(y, n=_ORDER))
        sigma = 1.4826 * float(np.median(spread)) / _GAIN
        # quantisation step of a coarsely quantised channel; else 0
        levels = np.unique(y)
        if levels.size < 2 or levels.size > 0.5 * y.size:
            grid = 0.0
        else:
            grid = float(np.min(np.diff(levels)))
        # a channel that sits on one quantisation level shows no differences; its step bounds the
        # noise
        out[k] = max(sigma, grid / math.sqrt(12.0), 1e-12)
    return out


def moving_mean(values: Floats, width: int) -> Floats:
    """Return the centred moving mean over ``width`` samples, padded with zeros.

    Example:
        >>> moving_mean(np.array([3.0, 3.0, 3.0]), 3)
        array([2., 3., 2.])
    """
    return np.asarray(np.convolve(values, np.full(width, 1.0 / width), "same"))
