"""Smooth values and slopes with gaps."""

from __future__ import annotations

import numpy as np

from seals.sysid.data.smoothing import local_polynomial


def test_a_cubic_is_kept_with_its_slope_despite_gaps() -> None:
    """A cubic polynomial with two thirds of its samples lost comes back exactly."""
    time = np.arange(200) * 0.01
    values = (1.0 - 2.0 * time + 3.0 * time**2 - 1.5 * time**3)[:, None]
    slope = -2.0 + 6.0 * time - 4.5 * time**2
    seen = values.copy()
    seen[np.arange(200) % 3 != 0] = np.nan
    value, rate = local_polynomial(seen, 0.01, bandwidth=0.06)
    assert np.allclose(value, values, atol=1e-9)
    assert np.allclose(rate[:, 0], slope, atol=1e-7)


def test_noise_is_reduced() -> None:
    """White noise shrinks by more than half over a dozen samples."""
    rng = np.random.default_rng(1)
    value, _ = local_polynomial(rng.normal(size=(2000, 1)), 0.01, bandwidth=0.06)
    assert value.std() < 0.4


def test_a_bandwidth_with_too_few_samples_is_widened() -> None:
    """One sample in thirty still gives a curve everywhere."""
    time = np.arange(600) * 0.01
    seen = np.sin(time)[:, None]
    seen[np.arange(600) % 30 != 0] = np.nan
    value, _ = local_polynomial(seen, 0.01, bandwidth=0.05)
    assert np.all(np.isfinite(value))
    assert np.abs(value[100:500, 0] - np.sin(time[100:500])).max() < 0.02
