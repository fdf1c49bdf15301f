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
    assert joined.meta == whole.meta


def test_logs_of_other_vehicles_or_channels_are_refused() -> None:
    """Another mass and another channel are said; another name of the vehicle does not matter."""
    one = log("a", 1)
    with pytest.raises(LogError, match="state different vehicle"):
        join_logs([one, log("b", 1, vehicle={"name": "b", "mass": 2.1})])
    with pytest.raises(LogError, match="different columns: velocity_x"):
        join_logs([one, log("b", 1).with_columns({"velocity_x": np.zeros(5)})])
    with pytest.raises(LogError, match="no log is given"):
        join_logs([])
