"""Smoothing of measured columns, with a fixed and with an adapted width."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from seals.arrays import Floats
from seals.smoothing import savitzky_golay
from seals.sysid.data.smoothing import adaptive_polynomial, local_polynomial


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


STEP, SIGMA, WIDE = 0.004, 1e-3, 0.06
"""Rows [s], noise [m], and the widest bandwidth [s]."""


def fall(*, impact: bool) -> tuple[Floats, Floats, Floats]:
    """Position with noise, true position and true velocity of a fall that water stops in 20 ms."""
    time = np.arange(400) * STEP
    force = np.where(impact & (np.abs(time - 0.8) < 0.01), 90.0, 0.0)
    velocity = -2.0 + np.cumsum(force) * STEP
    position = np.cumsum(velocity) * STEP
    noise = np.random.default_rng(2).normal(size=400) * SIGMA
    return (position + noise)[:, None], position[:, None], velocity[:, None]


def test_an_impact_is_followed_within_the_noise() -> None:
    """The wide fit is ten standard deviations off; the narrow ones are not, nor is the speed."""
    seen, place, speed = fall(impact=True)
    stiff, _ = local_polynomial(seen, STEP, bandwidth=WIDE)
    value, slope = adaptive_polynomial(seen, STEP, bandwidth=WIDE, sigma=SIGMA)
    assert np.abs(stiff - place).max() > 8.0 * SIGMA
    assert np.abs(value - place).max() < 4.0 * SIGMA
    near = slice(170, 230)
    rough = np.abs(local_polynomial(seen, STEP, bandwidth=WIDE)[1] - speed)[near].mean()
    assert np.abs(slope - speed)[near].mean() < 0.5 * rough


def test_steady_motion_keeps_the_wide_fit_whatever_noise_is_stated() -> None:
    """Noise alone changes nothing, and a stated noise that is a third of the true one neither."""
    seen, _, _ = fall(impact=False)
    for sigma in (SIGMA, SIGMA / 3.0):
        found = adaptive_polynomial(seen, STEP, bandwidth=WIDE, sigma=sigma)
        wide = local_polynomial(seen, STEP, bandwidth=WIDE)
        assert all(np.array_equal(a, b) for a, b in zip(found, wide, strict=True))


def test_lost_samples_do_not_count() -> None:
    """Half of the rows are empty."""
    seen, place, _ = fall(impact=True)
    seen[::2] = np.nan
    value, _ = adaptive_polynomial(seen, STEP, bandwidth=WIDE, sigma=SIGMA)
    assert np.isfinite(value).all()
    assert np.abs(value - place).max() < 6.0 * SIGMA


def test_columns_with_gaps_of_their_own_are_smoothed_as_alone() -> None:
    """What one column misses neither spreads to another nor takes samples from it."""
    seen, _, _ = fall(impact=True)
    both = np.column_stack([seen, seen[::-1]])
    both[100:110, 0], both[200::3, 1] = np.nan, np.nan
    for smooth in (
        lambda v: local_polynomial(v, STEP, bandwidth=WIDE),
        lambda v: local_polynomial(v, STEP, bandwidth=0.002),
    ):
        together = smooth(both)
        for k in range(2):
            for whole, alone in zip(together, smooth(both[:, [k]]), strict=True):
                np.testing.assert_array_equal(whole[:, [k]], alone)
    value, slope = adaptive_polynomial(both, STEP, bandwidth=WIDE, sigma=SIGMA)
    assert np.isfinite([value, slope]).all()
