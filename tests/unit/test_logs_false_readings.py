"""Readings of a table that are none: repeated, held where a pose failed, or leaping away."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from seals.arrays import Floats
from seals.logs.false_readings import without_false_readings
from seals.logs.log import Log

ROWS = 600
TIME = 0.01 * np.arange(ROWS)


def log_of(place: Floats, *, still: bool = False) -> Log:
    """A log with a position, and a gyroscope that never repeats itself unless all is still."""
    spin = 0.01 * np.random.default_rng(1).standard_normal((ROWS, 3))
    spin = np.zeros_like(spin) if still else spin
    parts = {f"position_{a}": v for a, v in zip("xyz", place.T, strict=True)}
    parts |= {f"angular_velocity_{a}": v for a, v in zip("xyz", spin.T, strict=True)}
    return Log(name="x", columns={"t": TIME, **parts})


def moving() -> Floats:
    """Places of a flight with the noise of motion capture."""
    way = np.stack([np.sin(TIME), np.cos(1.3 * TIME), 1.0 + 0.2 * np.sin(0.7 * TIME)], axis=1)
    return np.asarray(way + 0.001 * np.random.default_rng(0).standard_normal((ROWS, 3)))


@pytest.mark.parametrize("rate", [50.0, 30.0, 20.0, 12.5])
def test_a_slower_sensor_on_every_row_is_read_at_its_own_rate(rate: float) -> None:
    """Also where its period is no whole number of rows; the first row of each reading stays."""
    number = np.floor(TIME * rate + 1e-9).astype(int)
    first = np.append(True, np.diff(number) > 0)
    place = moving()[first][np.cumsum(first) - 1]
    thin, said = without_false_readings(log_of(place))
    assert_array_equal(np.isfinite(thin.columns["position_x"]), first)
    assert_array_equal(thin.columns["position_y"][first], place[first, 1])
    assert len(said) == 1
    assert "position repeats each reading" in said[0]
    assert np.isfinite(thin.columns["angular_velocity_x"]).all()


def test_a_pose_that_was_held_where_it_failed_is_left_out() -> None:
    """A second of one value, then a jump to where the vehicle is: one reading and a gap."""
    place = moving()
    place[200:300] = place[200]
    thin, said = without_false_readings(log_of(place))
    gone = np.isnan(thin.columns["position_z"])
    assert_array_equal(np.flatnonzero(gone), np.arange(201, 300))
    assert said == ["position was held for 0.99 s from t = 2 s: left out"]


def test_a_coarse_sensor_is_left_as_it_is() -> None:
    """A slow drift written in centimetres repeats itself as often as it happens to."""
    drift = np.stack([0.02 * TIME, 0.03 * np.sin(0.5 * TIME), 1.0 + 0.01 * TIME], axis=1)
    thin, said = without_false_readings(log_of(np.round(drift, 2)))
    assert said == []
    assert np.isfinite(thin.columns["position_x"]).all()


def test_a_vehicle_at_rest_may_repeat_itself() -> None:
    """Nothing else changes either; and a run of SEALS holds nothing."""
    assert without_false_readings(log_of(np.ones((ROWS, 3)), still=True))[1] == []
    held = log_of(np.repeat(moving()[::5], 5, axis=0))
    own = Log(name="x", columns=held.columns, meta={"simulated": {}})
    assert without_false_readings(own)[1] == []


def test_a_pose_that_leaps_away_for_a_row_or_two_is_left_out_there() -> None:
    """Markers that were taken for others: 0.4 m off in single rows and in one pair."""
    place, false = moving(), np.zeros(ROWS, dtype=bool)
    false[[1, 200, 201, 410]] = True
    place[false] += np.array([0.3, -0.2, 0.2])
    thin, said = without_false_readings(log_of(place))
    assert_array_equal(np.isnan(thin.columns["position_x"]), false)
    assert said == ["position jumps away and back in 4 rows: left out"]


@pytest.mark.parametrize("what", ["step", "corner", "rest", "fast start"])
def test_what_a_vehicle_may_do_is_no_leap(what: str) -> None:
    """A pose set anew, a bounce without noise, and a flight that begins after a long rest."""
    place = moving()
    if what == "step":
        place[300:] += 0.5
    elif what == "corner":
        place = np.abs(TIME - 3.0)[:, None] * np.array([3.0, 1.0, 2.0])
    elif what == "fast start":
        place = place + 2.0 * np.exp(-TIME / 0.2)[:, None]
    else:
        place = np.maximum(TIME - 4.0, 0.0)[:, None] ** 2 * np.array([2.0, 1.0, 0.5])
    thin, said = without_false_readings(log_of(place))
    assert said == []
    assert np.isfinite(thin.columns["position_x"]).all()


def test_a_vector_of_one_component_is_thinned_alike() -> None:
    """Of a position of which a table has x alone, x alone loses its repeated rows."""
    spin = {f"angular_velocity_{a}": np.sin(TIME + k) for k, a in enumerate("xyz")}
    log = Log(name="x", columns={"t": TIME, "position_x": np.full(ROWS, np.nan), **spin})
    thin, _ = without_false_readings(log)
    assert sorted(thin.columns) == sorted(log.columns)
