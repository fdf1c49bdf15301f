"""Local polynomials of evenly spaced rows, for smoothing and derivatives."""

from __future__ import annotations

import math

import numpy as np

from seals.arrays import Floats


def savitzky_golay(
    values: Floats, width: int, order: int, *, derivative: int = 0, step: float = 1.0
) -> Floats:
    """Return a derivative of local polynomials, each fitted to the rows around its own.

    `scipy.signal.savgol_filter` returns the same, but takes half a second to import.

    Equation:
        y_i = c_m / step^m sum_j W_mj x_(i+j) with W = (P^T P)^-1 P^T, P_jk = j^k and c_m = m!, for
        j from -(width - 1) / 2 to (width - 1) / 2; the first and last rows take the polynomial of
        the first and last window (Savitzky and Golay 1964, Anal. Chem. 36, 1627).

    Args:
        values: rows, shape (T, ...), with T at least the width.
        width: rows of a window, odd.
        order: of the polynomials.
        derivative: its order m, 0 for smoothed values.
        step: time from row to row [s].

    Example:
        >>> import numpy as np
        >>> square = np.arange(7.0)[:, None] ** 2
        >>> savitzky_golay(square, 5, 2, derivative=2)[:, 0].round(9).tolist()
        [2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0]
    """
    half = width // 2
    # places in halves of a window: powers of row numbers lose digits in the normal equations
    place, unit = np.arange(-half, half + 1) / half, half * step
    power = np.arange(order + 1)
    powers = place[:, None] ** power
    fit = np.linalg.solve(powers.T @ powers, powers.T)
    lower = np.maximum(power - derivative, 0)
    falling = np.array([float(math.perm(int(k), derivative)) for k in power])
    weights = (falling * place[:, None] ** lower) @ fit / unit**derivative
    windows = np.lib.stride_tricks.sliding_window_view(values, width, axis=0)
    first, last = values[:width], values[-width:]
    return np.concatenate(
        [
            np.tensordot(weights[:half], first, axes=1),
            windows @ weights[half],
            np.tensordot(weights[half + 1 :], last, axes=1),
        ]
    )
