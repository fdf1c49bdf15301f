"""Smoothing of sampled series."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats


def moving_mean(values: Floats, width: int) -> Floats:
    """Return the centred moving mean over ``width`` samples, padded with zeros.

    Example:
        >>> moving_mean(np.array([3.0, 3.0, 3.0]), 3)
        array([2., 3., 2.])
    """
    return np.asarray(np.convolve(values, np.full(width, 1.0 / width), "same"))
