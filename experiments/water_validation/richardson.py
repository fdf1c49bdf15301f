"""Extrapolation of a figure to spacing zero, with a band of uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

LOWEST, HIGHEST = 0.5, 2.0
"""Orders of convergence that a fit may have [1]."""
SAFE, UNSURE = 1.25, 3.0
"""Factors on the distance to the finest figure: of a clear order, and of any other fit [1]."""


class Extrapolated(NamedTuple):
    """A figure at spacing zero.

    Args:
        value: of the fit at spacing zero.
        band: half width that holds the true figure in nine cases of ten, with scatter of some per
            cent and an order between 1 and 2.
        order: of convergence [1].
        clear: whether the order lies within its bounds and the fit explains the figures.
    """

    value: float
    band: float
    order: float
    clear: bool

    @classmethod
    def of(cls, spacings: Sequence[float], values: Sequence[float]) -> Extrapolated:
        """Fit value + slope spacing^order to figures and return the value at spacing zero.

        Equation:
            U = F abs(f_1 - f_0) + 2 s + abs(f_1 - fit_1): f_1 the figure of the finest spacing, f_0
            the extrapolated one, s its standard error at the fitted order; F = 1.25 where the order
            is within 0.5 and 2 and the deviation of the fit below the mean step between figures;
            otherwise the fit is of first order and F = 3.

        Args:
            spacings: at least three different ones [m].
            values: of the figure.

        Raises:
            ValueError: less than three spacings.

        References:
            After Eça and Hoekstra 2014, doi:10.1016/j.jcp.2014.01.006, without weights and fits of
            mixed order, and with the standard error at spacing zero for that of the fit.

        Example:
            >>> found = Extrapolated.of([1.0, 0.5, 0.25], [3.0, 2.5, 2.25])
            >>> round(found.value, 2), round(found.order, 2), found.clear
            (2.0, 1.0, True)
        """
        h, f = np.asarray(spacings, dtype=float), np.asarray(values, dtype=float)
        if len(np.unique(h)) < 3:
            raise ValueError(f"{len(np.unique(h))} spacings were given.\nGive at least three.")
        orders = np.linspace(LOWEST, HIGHEST, 301)
        best = int(np.argmin([_Fit.of(h, f, order).left for order in orders]))
        sigma = float(np.sqrt(_Fit.of(h, f, orders[best]).left / max(len(h) - 3, 1)))
        inside = 0 < best < len(orders) - 1
        clear = inside and sigma < float(np.ptp(f)) / (len(h) - 1)
        order = float(orders[best]) if clear else 1.0
        fit = _Fit.of(h, f, order)
        finest = int(np.argmin(h))
        off = abs(float(f[finest]) - fit.value - fit.slope * float(h[finest]) ** order)
        distance = abs(float(f[finest]) - fit.value)
        band = (SAFE if clear else UNSURE) * distance + 2.0 * sigma * fit.gain + off
        return cls(fit.value, band, order, bool(clear))


class _Fit(NamedTuple):
    """Fit of one order: value at zero, slope, squares left, and noise at zero over its source."""

    value: float
    slope: float
    left: float
    gain: float

    @classmethod
    def of(cls, h: np.ndarray, f: np.ndarray, order: float) -> _Fit:
        """Fit by least squares."""
        table = np.stack([np.ones_like(h), h**order], axis=1)
        (value, slope), *_ = np.linalg.lstsq(table, f, rcond=None)
        left = f - value - slope * h**order
        gain = float(np.sqrt(np.linalg.inv(table.T @ table)[0, 0]))
        return cls(float(value), float(slope), float(left @ left), gain)
