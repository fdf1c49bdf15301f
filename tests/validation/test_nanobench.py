"""Real flights of a healthy Crazyflie: bad logs and clocks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from benchmarks.nanobench import Flight
from benchmarks.real_data import BESIDE
from seals.logs.time_offset import delay_between
from seals.plugins.readers.nanobench import ReaderNanobench

pytestmark = pytest.mark.validation
ESTIMATOR = 0.017
"""By how much the position estimate on board is late by itself, as the data's description says."""


def test_clocks_agree_with_the_estimate_on_board() -> None:
    """The one log whose link was lost is bad; the others' offsets are right to 0.02 s."""
    folder = BESIDE / "nanobench" / "flights"
    if not folder.is_dir():
        pytest.skip(f"the flights are not there: {folder}")
    bad = set()
    for place in sorted(folder.glob("*.parquet")):
        (log,) = ReaderNanobench().read(place)
        told = {quantity: value for _, quantity, value in Flight.of(log).answers()}
        if told["log_quality"] == "bad":
            bad.add(log.name)
            continue
        true, late = (
            savgol_filter(log.channel(stem), 31, 3, deriv=1, delta=0.01, axis=0)
            for stem in ("position", "estimated_position")
        )
        other = delay_between(true, late, np.ones(log.rows, dtype=bool))[0] - ESTIMATOR
        found = float(told["time_offset_s"])
        assert found == pytest.approx(0.5 * (found + other), abs=0.02), log.name
    assert bad == {"B9_trefoil_medium_rep13"}
