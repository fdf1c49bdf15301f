"""Several logs of one vehicle fitted together: their runs one after the other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.sysid.data.join import join_logs


def log(name: str, runs: int, **changes: Any) -> Log:
    """A log of short runs whose depth tells log, run and row."""
    rows, first = 5, 10.0 * ord(name[-1])
    depth = np.concatenate([first + k + 0.1 * np.arange(rows) for k in range(runs)])
    meta = {
        "vehicle": {"name": name, "mass": 2.0},
        "initial_state": [{"position": [first, k, 0.0]} for k in range(runs)],
    }
    return Log(
        name=name,
        columns={"t": np.tile(0.01 * np.arange(rows), runs), "depth": depth},
        segment=np.repeat(np.arange(runs), rows),
        meta={**meta, **changes},
    )


def test_one_log_is_a_list_of_one() -> None:
    """A single log comes back as it is, alone or in a list."""
    one = log("a", 2)
    assert join_logs(one) is one
    assert join_logs([one]) is one


def test_runs_follow_each_other_with_their_own_starts() -> None:
    """Two runs and three make five, each with its rows and its start state."""
    one, two = log("a", 2), log("b", 3)
    both = join_logs([one, two])
    parts = both.segments()
    assert len(parts) == 5
    expected = [p.columns["depth"] for p in (*one.segments(), *two.segments())]
    assert all(np.array_equal(p.columns["depth"], e) for p, e in zip(parts, expected, strict=True))
    starts = [s["position"][:2] for s in both.meta["initial_state"]]
    assert starts == [[970.0, 0], [970.0, 1], [980.0, 0], [980.0, 1], [980.0, 2]]


def test_a_log_cut_in_two_is_put_together_again() -> None:
    """Halves of a log of runs, joined, are that log, row by row."""
    whole = log("a", 4)
    starts = whole.meta["initial_state"]
    halves = [
        Log(
            name=f"half {k}",
            columns=dict(whole.select(mask).columns),
            segment=whole.segment[mask],
            meta={**whole.meta, "initial_state": some},
        )
        for k, (mask, some) in enumerate(
            [(whole.segment < 2, starts[:2]), (whole.segment >= 2, starts[2:])]
        )
    ]
    joined = join_logs(halves)
    assert np.array_equal(joined.segment, whole.segment)
    assert all(np.array_equal(joined.columns[k], v) for k, v in whole.columns.items())
    assert {k: v for k, v in joined.meta.items() if k != "logs"} == whole.meta


def test_logs_of_other_vehicles_are_refused() -> None:
    """Another mass is said; another name of the vehicle does not matter."""
    one = log("a", 1)
    with pytest.raises(LogError, match="state different vehicle"):
        join_logs([one, log("b", 1, vehicle={"name": "b", "mass": 2.1})])
    with pytest.raises(LogError, match="no log is given"):
        join_logs([])


def test_a_channel_that_one_log_lacks_has_no_samples_there() -> None:
    """The rows of the log without a velocity hold no number of it."""
    both = join_logs([log("a", 1), log("b", 1).with_columns({"velocity_x": np.ones(5)})])
    assert np.isnan(both.columns["velocity_x"][:5]).all()
    assert (both.columns["velocity_x"][5:] == 1.0).all()


def test_what_differs_between_logs_is_kept_for_each() -> None:
    """Waves and noise are those of each log; rows and one clock tell the logs apart."""
    waves = [
        [{"name": "waves", "parameters": {"amplitude": 0.1, "period": 2.0, "phase": phase}}]
        for phase in (0.0, 1.0)
    ]
    logs = [
        log(
            name,
            1,
            baseline=sea,
            sensors={"channels": {"depth": {"sigma": sigma}}},
            vehicle={"mass": 2.0},
        )
        for name, sea, sigma in zip("ab", waves, (0.01, 0.02), strict=True)
    ]
    parts = join_logs(logs).meta["logs"]
    assert [p["baseline"] for p in parts] == waves
    assert [p["sigma"]["depth"] for p in parts] == [0.01, 0.02]
    assert [p["rows"] for p in parts] == [5, 5]
    assert parts[1]["begin"] > parts[0]["begin"] + 0.04


def test_other_currents_are_refused() -> None:
    """Of the surroundings only waves may differ from log to log."""
    drift = [{"name": "current", "medium": "water", "parameters": {"velocity_x": 0.1}}]
    with pytest.raises(LogError, match="state different baseline"):
        join_logs([log("a", 1), log("b", 1, vehicle={"mass": 2.0}, baseline=drift)])
