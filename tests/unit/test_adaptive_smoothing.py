"""Smoothing of a measured pose: wide in steady motion, narrow about an impact."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.sysid.data.smoothing import adaptive_polynomial, local_polynomial

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
