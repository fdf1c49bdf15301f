"""The log object and the table of channels."""

from __future__ import annotations

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs import CHANNELS, Log
from seals.logs.channels import columns_of, stem_of, unit_of

TIME = np.array([0.0, 0.1, 0.2, 0.0, 0.1])


def _log(**columns: object) -> Log:
    return Log(name="case", columns={"t": TIME, **columns}, segment=[0, 0, 0, 4, 4])  # type: ignore[arg-type,dict-item]


def test_vector_channel_keeps_component_order() -> None:
    """A vector comes out as x, y, z whatever the order of the columns."""
    log = _log(position_z=TIME + 3, position_x=TIME + 1, position_y=TIME + 2)
    assert log.channel("position")[0].tolist() == [1.0, 2.0, 3.0]


def test_absent_component_is_nan_not_dropped() -> None:
    """A log with height only still has three position columns, so z stays column 2."""
    position = _log(position_z=TIME).channel("position")
    assert position.shape == (5, 3)
    assert np.isnan(position[:, :2]).all()
    assert np.array_equal(position[:, 2], TIME)


def test_numbered_channel_is_sorted_by_number() -> None:
    """Rotor 10 comes after rotor 9, not after rotor 1."""
    columns = {
        f"rotor_speed_cmd_{k}": np.full(5, float(k)) for k in (10, 2, 1, 3, 4, 5, 6, 7, 8, 9)
    }
    speeds = _log(**columns).channel("rotor_speed_cmd")
    assert speeds[0].tolist() == [float(k) for k in range(1, 11)]


def test_orientation_order_is_w_first() -> None:
    """The quaternion comes out as w, x, y, z."""
    columns = {f"orientation_{x}": np.full(5, float(k)) for k, x in enumerate("xyzw")}
    assert _log(**columns).channel("orientation")[0].tolist() == [3.0, 0.0, 1.0, 2.0]


def test_scalar_channel_has_one_column() -> None:
    """A scalar comes out with shape (rows, 1)."""
    assert _log(depth=TIME).channel("depth").shape == (5, 1)


def test_segments_keep_their_number_and_rows() -> None:
    """Each separate run becomes a log of its own with its own number."""
    first, second = _log(depth=TIME).segments()
    assert (first.rows, second.rows) == (3, 2)
    assert set(second.segment.tolist()) == {4}


def test_select_and_with_columns_leave_the_original_alone() -> None:
    """Selecting rows and adding columns make new logs."""
    log = _log(depth=TIME)
    early = log.select(log.time < 0.15)
    more = log.with_columns({"pitch": np.zeros(5)})
    assert (early.rows, log.rows) == (4, 5)
    assert more.has("pitch")
    assert not log.has("pitch")


def test_arrays_are_read_only_and_the_callers_stay_writable() -> None:
    """Nobody changes a log by accident; the array given in is not locked."""
    mine = TIME.copy()
    log = Log(name="case", columns={"t": mine})
    with pytest.raises(ValueError, match="read-only"):
        log.time[0] = 5.0
    mine[0] = 1.0


@pytest.mark.parametrize(
    ("columns", "meta", "words"),
    [
        ({"position_x": [1.0]}, {}, "no time column"),
        ({"t": []}, {}, "no rows"),
        ({"t": [0.0, 1.0], "depth": [1.0]}, {}, "depth"),
        ({"t": [0.0], "depth": ["deep"]}, {}, "does not contain numbers"),
        ({"t": [[0.0, 1.0]]}, {}, "shape"),
        ({"t": [0.0], "segment": [0.0]}, {}, "segment="),
        ({"t": [0.0]}, {"vehicle": {"mass": float("inf")}}, "meta.vehicle.mass"),
    ],
)
def test_impossible_logs_are_refused(columns: dict, meta: dict, words: str) -> None:  # type: ignore[type-arg]
    """Each impossible log is refused, and the message names the cause."""
    with pytest.raises(LogError, match=words):
        Log(name="case", columns=columns, meta=meta)


def test_unknown_channel_suggests_the_nearest() -> None:
    """A misspelt channel is refused with the right name."""
    log = _log(specific_force_z=TIME)
    with pytest.raises(LogError, match="Did you mean 'specific_force'"):
        log.channel("specfic_force")


def test_meta_that_contains_itself_is_refused() -> None:
    """A mapping that contains itself ends in a refusal, not in an endless walk."""
    meta: dict[str, object] = {}
    meta["again"] = meta
    with pytest.raises(LogError, match="contains itself"):
        Log(name="case", columns={"t": TIME}, meta=meta)


def test_every_channel_states_unit_and_meaning() -> None:
    """The table of channels is complete, and its columns lead back to it."""
    for stem, channel in CHANNELS.items():
        assert channel.unit
        assert channel.meaning
        column = f"{stem}_1" if channel.numbered else "_".join([stem, *channel.suffixes[:1]])
        assert stem_of(column) == stem
        assert unit_of(column) == channel.unit


def test_absurd_component_number_does_not_fill_the_memory() -> None:
    """A column numbered by billions is carried as it is, not padded up to its number."""
    assert columns_of("motor_pwm", ["motor_pwm_4000000000"]) == ("motor_pwm_4000000000",)
