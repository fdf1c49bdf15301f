"""Time stamps in other units than seconds, dates, and spans that no run has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs import Log, check_log, read_native, refuse_if_bad
from seals.logs.clock import in_seconds
from seals.logs.column_map import ColumnMap
from seals.logs.csv import read_csv

META = "format: hidden-effect-log\nformat_version: 1\n"
ROWS = 60
STEP = 0.01
SECONDS = np.arange(ROWS) * STEP
QUIET = 9.81 + 0.01 * np.sin(37.0 * np.arange(ROWS))
YEAR_2024 = 1_704_067_200


def _folder(place: Path, stamps: list[Any], name: str = "t") -> Path:
    rows = (f"{stamp},{value}" for stamp, value in zip(stamps, QUIET, strict=True))
    (place / "log.csv").write_text(f"{name},specific_force_z\n" + "\n".join(rows) + "\n")
    (place / "meta.yaml").write_text(META)
    return place


def _at(factor: int, *, start: int = 0, step: float = STEP) -> list[int]:
    return [start * factor + round(k * step * factor) for k in range(ROWS)]


STAMPS: dict[str, tuple[list[Any], str]] = {
    "ns from zero": (_at(10**9), "ns"),
    "us from zero": (_at(10**6), "us"),
    "ms from zero": (_at(10**3), "ms"),
    "ns since 1970": (_at(10**9, start=YEAR_2024), "ns"),
    "us since 1970": (_at(10**6, start=YEAR_2024), "us"),
    "ms since 1970": (_at(10**3, start=YEAR_2024), "ms"),
    "ns at 1 Hz, since 1970": (_at(10**9, start=YEAR_2024, step=1.0), "ns"),
    "us at 1 kHz, since 1970": (_at(10**6, start=YEAR_2024, step=0.001), "us"),
    "ns at 10 Hz": (_at(10**9, step=0.1), "ns"),
    "us at 4 Hz": (_at(10**6, step=0.25), "us"),
    "ns since start, negative": ([stamp - 10**9 for stamp in _at(10**9)], "ns"),
}


@pytest.mark.parametrize("name", STAMPS)
def test_stamps_in_another_unit_are_converted_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The log has seconds; the error stream, its meta and its check say what was done."""
    stamps, unit = STAMPS[name]
    log = read_native(_folder(tmp_path, stamps))
    factor = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3}[unit]
    np.testing.assert_allclose(log.time, (np.array(stamps) - stamps[0]) * factor, atol=1e-6)
    assert log.meta["clock"] == {"unit": unit, "start": pytest.approx(stamps[0] * factor)}
    assert f"the time stamps are in {unit}" in capsys.readouterr().err
    found = {finding.code: str(finding) for finding in refuse_if_bad(log)}
    assert f"in {unit} and were converted" in found["time_converted"]


@pytest.mark.parametrize(
    ("first", "later"),
    [
        ("2024-01-01T00:00:00.000", "2024-01-01T00:00:{:06.3f}"),
        ("2024-01-01 00:00:00", "2024-01-01 00:00:{:06.3f}"),
        ("2024-01-01T00:00:00.000Z", "2024-01-01T00:00:{:06.3f}Z"),
        ("2024-01-01T01:00:00+01:00", "2024-01-01T01:00:{:06.3f}+01:00"),
    ],
)
def test_dates_are_read_as_seconds(tmp_path: Path, first: str, later: str) -> None:
    """Dates of ISO 8601, with and without a zone."""
    stamps = [first, *(later.format(time) for time in SECONDS[1:])]
    log = read_native(_folder(tmp_path, stamps))
    np.testing.assert_allclose(log.time - YEAR_2024, SECONDS, atol=1e-6)
    refuse_if_bad(log)


def test_dates_of_a_mapped_column_and_in_parquet(tmp_path: Path) -> None:
    """The column of times may have any name, and a type of its own."""
    import pyarrow as pa
    from pyarrow import parquet

    stamps = [f"2024-01-01T00:00:{time:06.3f}" for time in SECONDS]
    _folder(tmp_path, stamps, "when")
    columns = {"when": "t", "specific_force_z": "specific_force_z"}
    log = read_csv(tmp_path / "log.csv", ColumnMap(columns=columns))
    np.testing.assert_allclose(log.time - YEAR_2024, SECONDS, atol=1e-6)
    (tmp_path / "log.csv").unlink()
    nanoseconds = pa.array(np.array(_at(10**9, start=YEAR_2024)), pa.timestamp("ns"))
    parquet.write_table(
        pa.table({"t": nanoseconds, "specific_force_z": QUIET}), tmp_path / "log.parquet"
    )
    np.testing.assert_allclose(read_native(tmp_path).time - YEAR_2024, SECONDS, atol=1e-6)


def test_a_name_tells_the_unit_and_a_given_unit_counts_first(tmp_path: Path) -> None:
    """A column called stamp_ms is in milliseconds; what the user says is believed."""
    stamps = [k * 3 for k in range(ROWS)]
    _folder(tmp_path, stamps, "stamp_ms")
    columns = {"stamp_ms": "t", "specific_force_z": "depth"}
    read = read_csv(tmp_path / "log.csv", ColumnMap(columns=columns))
    np.testing.assert_allclose(read.time, np.array(stamps) * 1e-3)
    read = read_csv(tmp_path / "log.csv", ColumnMap(columns=columns, units={"stamp_ms": "s"}))
    np.testing.assert_allclose(read.time, stamps)
    assert "clock" not in read.meta


@pytest.mark.parametrize("step", [0.0001, 0.01, 1.0, 2.0])
def test_seconds_stay_as_they_are(tmp_path: Path, step: float) -> None:
    """Neither from zero nor since 1970 are seconds touched."""
    for start in (0, YEAR_2024):
        stamps = [start + k * step for k in range(ROWS)]
        log = read_native(_folder(tmp_path, stamps))
        np.testing.assert_array_equal(log.time, stamps)
        assert "clock" not in log.meta


def test_slow_seconds_without_fast_channels_are_kept_with_a_warning() -> None:
    """A glider that notes its depth every ten seconds is no log in milliseconds."""
    time, clock = in_seconds(np.arange(60) * 10.0, np.zeros(0), channels=["depth"])
    assert not clock
    found = check_log(Log(name="a", columns={"t": time, "depth": np.arange(60.0)}))
    assert "Is the time in ms?" in next(f.message for f in found if f.code == "time_unit")


ABSURD: dict[str, tuple[Any, str]] = {
    "us or ns": (np.arange(ROWS) * 1e6, "in us or ns"),
    "steps of days": (np.arange(ROWS) * 86_400.0, "in us"),
    "one stamp far away": ([*SECONDS[:-1], 1e12], "span 1e\\+12 s"),
    "one stamp since 1970": ([0.0, *(YEAR_2024 + SECONDS[1:])], "span"),
    "two runs in one": ([*SECONDS[:30], *(SECONDS[30:] + 1e7)], "usual steps"),
    "three centuries": (np.linspace(0.0, 1e10, ROWS), "in ns"),
    "ten years": (SECONDS * 6e8, "days"),
    "tiny steps": ([*SECONDS[:-1] * 1e-9, 1.0], "usual steps"),
    "far past": ([-1e14, *SECONDS[1:]], "span"),
    "beyond all": ([*SECONDS[:-1], 1e300], "not finite, or beyond"),
}


@pytest.mark.parametrize("name", ABSURD)
def test_absurd_times_are_refused_in_words(name: str) -> None:
    """Nothing that computes along the time gets to see them."""
    stamps, words = ABSURD[name]
    columns = {"t": np.array(stamps, dtype=float), "specific_force_z": QUIET}
    with pytest.raises(LogError, match=words):
        refuse_if_bad(Log(name="a", columns=columns))


def test_runs_far_apart_are_no_absurd_span() -> None:
    """Each run counts for itself."""
    stamps = [*SECONDS[:30], *(SECONDS[30:] + 1e8)]
    segment = np.repeat([0, 1], 30)
    log = Log(name="a", columns={"t": stamps, "specific_force_z": QUIET}, segment=segment)
    refuse_if_bad(log)


@pytest.mark.parametrize(
    "clock", [{"unit": "ns"}, {"unit": [1], "start": 1}, {"unit": "ns", "start": "x"}, "ns", 1, []]
)
def test_a_strange_note_of_the_clock_does_no_harm(clock: Any) -> None:
    """The entry of a stranger's meta.yaml is not believed to be ours."""
    columns = {"t": SECONDS, "specific_force_z": QUIET}
    found = check_log(Log(name="a", columns=columns, meta={"clock": clock}))
    assert "time_converted" not in [finding.code for finding in found]


@pytest.mark.parametrize("step", [5e-324, 1e-300, 1e-12, 1.0 / 86_400_000 / 2])
def test_steps_that_no_sensor_takes_are_refused(step: float) -> None:
    """Times in days, or near zero: whatever divides by the step overflows."""
    columns = {"t": np.arange(ROWS) * step, "specific_force_z": QUIET}
    with pytest.raises(LogError, match=r"no sensor is that fast|one after|same time"):
        refuse_if_bad(Log(name="a", columns=columns))


def test_samples_of_one_channel_may_be_too_close() -> None:
    """The usual step of the log says nothing of the rows in which a channel has samples."""
    time = np.sort(np.concatenate([np.arange(40) * 1e-300, 0.01 + np.arange(41) * STEP]))
    force = np.where(time < 1e-200, 9.81, np.nan)
    check_log(Log(name="a", columns={"t": time, "specific_force_z": force, "depth": time}))
