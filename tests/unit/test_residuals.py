"""Residuals: their lag, and the words for them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from seals.sysid.residual_force.lagged import _LAGS, _pooled, _runs
from seals.sysid.residual_force.signature import signature

STEP, LATE = 0.05, 6


def test_logs_with_overlapping_clocks_are_correlated_each_by_itself() -> None:
    """A response that comes six knots late is found in two logs that both begin near zero."""
    rng = np.random.default_rng(3)
    time = np.concatenate([2.0 + STEP * np.arange(300), STEP * np.arange(200)])
    drive = rng.normal(size=500)
    late = np.concatenate([np.roll(drive[:300], LATE), np.roll(drive[300:], LATE)])
    runs = _runs(time)
    assert runs == [slice(0, 300), slice(300, 500)]
    curve, band = _pooled(time, late, drive, runs, STEP)
    assert int(np.argmax(curve)) - _LAGS == LATE
    assert curve.max() > 0.9 > 3.0 * band


def test_a_longer_record_has_a_narrower_band() -> None:
    """Two runs of one length have a band 1/sqrt(2) as wide as one of them."""
    rng = np.random.default_rng(4)
    x, y = rng.normal(size=(2, 4000))
    time = np.concatenate([STEP * np.arange(2000)] * 2)
    _, one = _pooled(time, x, y, _runs(time)[:1], STEP)
    _, both = _pooled(time, x, y, _runs(time), STEP)
    assert both == pytest.approx(one / np.sqrt(2.0), rel=0.2)


@pytest.mark.parametrize(
    ("ceiling", "spread", "said"),
    [(0.0, 1.0, "that of noise"), (0.1, 0.1, "sensors disagree")],
)
def test_sensors_are_blamed_only_for_what_is_there(
    ceiling: float, spread: float, said: str
) -> None:
    """Of a misfit at the floor a force explained '0 +- 100 %', and sensors were suspected."""
    left = SimpleNamespace(
        missing=True, before=0.87, after=0.77, ceiling=ceiling, ceiling_sd=spread
    )
    whole = SimpleNamespace(force=2.6, force_ratio=1.9, torque=0.25, torque_ratio=2.6)
    first, second = signature(
        cast(Any, SimpleNamespace)(residual=left, regimes=[whole], jointed=False)
    ).sentences
    assert first.startswith("Left over: a force of about 2.6 N")
    assert said in second
    assert ("sensors" in second) is (spread < 1.0)
