"""Local polynomials and pieces between rows against those of SciPy and against polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import savgol_filter

from seals.logs.local_polynomials import local_polynomial
from seals.sysid.predictors.delayed_readings import hermite


@pytest.mark.parametrize(("order", "derivative"), [(2, 0), (3, 2), (3, 1), (4, 3)])
def test_same_as_savitzky_golay(order: int, derivative: int) -> None:
    """Rows inside and at both edges are those of `scipy.signal.savgol_filter`."""
    values = np.random.default_rng(1).normal(size=(200, 3)).cumsum(axis=0)
    found = local_polynomial(values, 21, order, derivative=derivative, step=0.01)
    wanted = savgol_filter(values, 21, order, deriv=derivative, delta=0.01, axis=0)
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())


def test_a_polynomial_is_its_own_fit() -> None:
    """The second derivative of t^3 is 6 t at every row, edges included."""
    time = np.arange(50) * 0.1
    found = local_polynomial((time**3)[:, None], 11, 3, derivative=2, step=0.1)[:, 0]
    assert found == pytest.approx(6.0 * time, abs=1e-9)


def test_too_few_rows_are_refused() -> None:
    """A polynomial over more rows than there are is an error."""
    with pytest.raises(ValueError, match="fewer"):
        local_polynomial(np.zeros((10, 1)), 11, 3)


@pytest.mark.parametrize("order", [0, 1])
def test_pieces_between_delayed_rows_are_those_of_scipy(order: int) -> None:
    """Values and derivatives are those of `scipy.interpolate.CubicHermiteSpline`, ends included."""
    draw = np.random.default_rng(2)
    time = np.sort(draw.uniform(0.0, 1.0, 50))
    values, slopes = draw.normal(size=(2, 50, 6))
    at = np.clip(time - 0.013, time[0], time[-1])
    wanted = CubicHermiteSpline(time, values, slopes)(at, order)
    found = hermite(time, values, slopes, at, order)
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())
