"""Noise floors, clock offsets and drop events, on signals whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from seals.compare.application import clock_offset
from seals.compare.events import find_drop
from seals.compare.noise import noise_of
from seals.errors import LogError


def test_noise_is_found_under_motion() -> None:
    """White noise on a parabola and a slow swing is estimated within five per cent."""
    rng = np.random.default_rng(1)
    t = np.arange(8000) * 0.01
    y = 3.0 * t - 4.9 * t**2 + np.sin(0.5 * t) + rng.normal(0.0, 0.02, t.size)
    # the median of |D3| over n samples has a relative standard error of about 1.2/sqrt(n)
    assert noise_of(y[:, None])[0] == pytest.approx(0.02, rel=0.05)


def test_an_impact_does_not_raise_the_noise() -> None:
    """A spike of a thousand sigma leaves the estimate where it was."""
    rng = np.random.default_rng(2)
    y = rng.normal(0.0, 0.02, 4000)
    y[2000:2010] += 20.0
    assert noise_of(y[:, None])[0] == pytest.approx(0.02, rel=0.08)


def test_a_quantised_channel_has_the_noise_of_its_step() -> None:
    """A quiet signal that sits on two levels gets step/sqrt(12), not zero."""
    y = np.where(np.arange(1000) < 500, 0.0, 0.1)
    assert noise_of(y[:, None])[0] == pytest.approx(0.1 / np.sqrt(12.0))


def test_missing_samples_are_left_out() -> None:
    """A component without samples is unknown, or what the data sheet states."""
    y = np.full((100, 1), np.nan)
    assert np.isnan(noise_of(y)[0])
    assert noise_of(y, stated=0.3)[0] == 0.3


@pytest.mark.parametrize("lag", [0.0, 0.0137, -0.031])
def test_a_clock_offset_is_found_to_a_fraction_of_a_sample(lag: float) -> None:
    """The lag of a noisy copy is found within a fifth of the sampling."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 20.0, 0.01)

    def signal(at: np.ndarray) -> np.ndarray:
        return np.sin(2.1 * at) + 0.6 * np.sin(5.7 * at + 1.0) + 0.3 * np.sin(11.0 * at)

    found, match = clock_offset(
        t, signal(t - lag) + rng.normal(0, 0.02, t.size), signal(t), most=0.1
    )
    assert found == pytest.approx(lag, abs=0.002)
    assert match > 0.99


def test_a_channel_at_rest_has_no_clock_offset() -> None:
    """Nothing moves, so nothing is claimed."""
    t = np.arange(0.0, 5.0, 0.01)
    assert clock_offset(t, np.ones(t.size), np.ones(t.size), most=0.1) == (0.0, 0.0)


def drop(
    *, fall: float = 0.4, rate: float = 2000.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Specific force of a body that hangs, falls, enters water and is caught."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 4.0, 1.0 / rate)
    f = np.zeros((t.size, 3))
    f[:, 2] = 9.81
    f[(t >= 2.0) & (t < 2.0 + fall), 2] = 0.05
    wet = t >= 2.0 + fall
    since = t - 2.0 - fall
    f[wet, 2] = 20.0 * np.exp(-since[wet] / 0.005) + 6.0
    shock = wet & (since > 0.15) & (since < 0.17)
    f[shock, 2] = 350.0
    f[since > 0.17, 2] = 9.81
    return t, f + rng.normal(0.0, 0.02, f.shape)


def test_release_entry_and_catch_are_told_apart() -> None:
    """The largest spike is the catch at the bottom, not the water."""
    t, f = drop()
    events = find_drop(t, f)
    assert events.release == pytest.approx(2.0, abs=1e-3)
    assert events.entry == pytest.approx(2.4, abs=1e-3)
    assert events.catch == pytest.approx(2.55, abs=2e-3)
    assert events.caught
    assert events.offset == pytest.approx(0.05, abs=0.01)


def test_a_log_without_a_fall_is_refused() -> None:
    """A body that only hangs has no events."""
    t, f = drop()
    with pytest.raises(LogError, match="no free fall"):
        find_drop(t[:3000], f[:3000])
