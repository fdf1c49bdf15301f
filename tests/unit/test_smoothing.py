"""Local polynomials against those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from seals.smoothing import savitzky_golay


@pytest.mark.parametrize(
    ("width", "order", "derivative"), [(5, 2, 0), (21, 3, 2), (51, 2, 1), (7, 4, 3)]
)
def test_as_scipy_filters(width: int, order: int, derivative: int) -> None:
    """Inner rows and both ends; two columns and steps of 10 ms."""
    values = np.random.default_rng(3).normal(size=(60, 2)).cumsum(axis=0)
    found = savitzky_golay(values, width, order, derivative=derivative, step=0.01)
    known = savgol_filter(values, width, order, deriv=derivative, delta=0.01, axis=0)
    assert found == pytest.approx(known, rel=1e-9, abs=1e-9 * float(np.abs(known).max()))


def test_a_polynomial_comes_back_whole() -> None:
    """A cubic and its second derivative, at the ends as well, in windows as long as the rows."""
    time = np.linspace(0.0, 1.2, 121)[:, None]
    found = savitzky_golay(time**3 - time, 121, 3, derivative=2, step=0.01)
    assert found == pytest.approx(6.0 * time, abs=1e-8)
