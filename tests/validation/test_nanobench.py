"""Real flights of a healthy Crazyflie: bad logs and clocks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import savgol_filter

from benchmarks.nanobench import Flight, diagnosed
from benchmarks.real_data import BESIDE
from seals.logs.time_offset import delay_between
from seals.plugins.readers.nanobench import ReaderNanobench

pytestmark = pytest.mark.validation
PAIR = ("battery_sag", "rotor_lag")
ABSURD = {"ground_effect", "added_mass", "buoyancy", "tether", "waves", "wind", "slung_load"}
"""What is not there; a weak rotor or a centre of gravity may be."""
ESTIMATOR = 0.017
"""By how much the position estimate on board is late by itself, as the data's description says."""


@pytest.mark.thorough
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


@pytest.mark.slow
def test_a_fast_flight_shows_drag_sag_and_lag_at_once(tmp_path: Path) -> None:
    """A healthy Crazyflie against a simple model, by the commands of the own-flight tutorial."""
    table = BESIDE / "nanobench" / "flights" / "B3_figure8_fast_rep1.parquet"
    if not table.is_file():
        pytest.skip(f"the flights are not there: {table}")
    (log,) = ReaderNanobench().read(table)
    found = diagnosed(Flight.of(log), table, tmp_path)
    named = {effect["name"]: effect["parameters"] for effect in found["effects"]}
    assert {*PAIR} < set(named)
    assert {"rotor_drag", "linear_drag"} & set(named)
    assert not set(named) & ABSURD
    # 1.3 to 2.6 and 20 to 65 ms, as the description of these flights says by simple statistics
    assert 1.3 < named["battery_sag"]["sensitivity"]["value"] < 2.6
    assert 0.02 < named["rotor_lag"]["time_constant_change"]["value"] < 0.065
