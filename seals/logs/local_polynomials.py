"""Smoothing and derivatives of evenly spaced samples by local polynomials."""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from seals.arrays import Floats


def local_polynomial(
    values: Floats, width: int, order: int, *, derivative: int = 0, step: float = 1.0
) -> Floats:
    """Return a derivative of the polynomial that fits the samples about each row best.

    Equation: least squares over ``width`` rows about each one; the first and last half of a width
    are on the polynomials of the first and last ``width`` rows (Savitzky and Golay 1964).
    `scipy.signal.savgol_filter` gives the same; its import takes half a second.

    Args:
        values: shape (T, k), T of ``width`` at least.
        width: rows of a polynomial, odd.
        order: of the polynomials.
        derivative: order of the derivative; 0 smooths.
        step: between two rows.

    Returns:
        The derivative, shape (T, k).

    Raises:
        ValueError: there are fewer rows than a polynomial takes.
    """
    if len(values) < width:
        raise ValueError(f"{len(values)} rows are fewer than the {width} of a polynomial")
    half = width // 2
    at = np.arange(-half, half + 1, dtype=float)
    powers = np.arange(order + 1)
    # coefficients of the polynomial by its samples, shape (order + 1, width)
    fit = np.linalg.pinv(at[:, None] ** powers)
    size = factorial(derivative) / step**derivative
    out: Floats = np.empty(values.shape)
    inside = sliding_window_view(values, width, axis=0)
    out[half : len(values) - half] = size * (inside @ fit[derivative])
    kept = powers[derivative:]
    falling = np.array([factorial(p) / factorial(p - derivative) for p in kept]) / step**derivative
    for rows, edge, places in (
        (slice(0, half), values[:width], at[:half]),
        (slice(len(values) - half, None), values[-width:], at[half + 1 :]),
    ):
        terms = falling * places[:, None] ** (kept - derivative)
        out[rows] = terms @ (fit[derivative:] @ edge)
    return out
