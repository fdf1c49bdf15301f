"""Long logs: the time of a diagnosis is said, or refused before any work."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs import Log
from seals.sysid.report.given_logs import MOST_ROWS, _tell_time, places_of


def test_two_million_rows_are_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before the log is checked, with the time that it would take and what is allowed."""
    import pyarrow as pa
    from pyarrow import parquet

    monkeypatch.chdir(tmp_path)
    stamps = pa.array(np.arange(2_000_000) * 0.001)
    (tmp_path / "log").mkdir()
    parquet.write_table(pa.table({"t": stamps}), tmp_path / "log" / "log.parquet")
    (tmp_path / "log" / "meta.yaml").write_text("format: hidden-effect-log\nformat_version: 1\n")
    code = main(["diagnose", "log=log", "out=out", "plan=false"])
    said = capsys.readouterr().out
    assert code == 20
    assert "bad data: log 'log' has 2,000,000 rows" in said
    assert "would take about 17 h" in said
    assert f"up to {MOST_ROWS:,} rows" in said


def test_the_time_of_a_long_log_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    """Short ones begin in silence."""
    for rows, words in ((1_000, ""), (40_000, "log 'a': 40,000 rows; about 20 minutes or more.\n")):
        _tell_time(Log(name="a", columns={"t": np.arange(float(rows))}))
        assert capsys.readouterr().err == words


def test_no_log_and_one_given_twice_are_refused(tmp_path: Path) -> None:
    """An empty list says what to give; the same readings never count twice, by whatever path."""
    one, other = tmp_path / "a", tmp_path / "b"
    one.mkdir()
    other.mkdir()
    assert places_of([str(one), str(other)], key="log") == [one, other]
    with pytest.raises(ConfigError, match=r"^log=\[\] holds no log\.\nGive a log folder"):
        places_of([], key="log")
    again = tmp_path / "b" / ".." / "a"
    with pytest.raises(ConfigError, match=r"twice: its readings would count twice\.\nGive every"):
        places_of([str(one), str(again)], key="log")
