"""The native log format, read from files written by hand and written for other readers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.errors import LogError
from seals.logs import Log, read_native, write_native
from seals.plugins.readers.native import ReaderNative

META = "format: hidden-effect-log\nformat_version: 1\nvehicle: {name: drop, mass: 1.5}\n"
CSV = "t,segment,depth,comment\n0.0,0,0.5,start\n0.1,0,,middle\n0.0,1,0.75,again\n"


def _folder(place: Path, *, csv: str = CSV, meta: str = META) -> Path:
    place.mkdir()
    (place / "log.csv").write_text(csv)
    (place / "meta.yaml").write_text(meta)
    return place


def test_reads_a_csv_folder_written_by_hand(tmp_path: Path) -> None:
    """Segments, missing samples and meta come out; a text column is left out."""
    log = read_native(_folder(tmp_path / "a"))
    assert log.segment.tolist() == [0, 0, 1]
    assert log.channels() == ["depth"]
    assert np.isnan(log.columns["depth"][1])
    assert log.meta["vehicle"]["mass"] == 1.5


def test_reads_a_parquet_folder_written_by_pandas(tmp_path: Path) -> None:
    """Narrow floats and whole-number segments come out as float64 and int64."""
    import pandas as pd

    place = _folder(tmp_path / "a")
    (place / "log.csv").unlink()
    table = pd.DataFrame(
        {"t": [0.0, 0.1], "segment": [2.0, 2.0], "depth": np.array([0.5, 0.25], dtype=np.float32)}
    )
    table.to_parquet(place / "log.parquet")
    log = read_native(place)
    assert log.columns["depth"].dtype == np.float64
    assert log.columns["depth"].tolist() == [0.5, 0.25]
    assert log.segment.dtype == np.int64


@pytest.mark.parametrize("table", ["log.parquet", "log.csv"])
def test_written_folder_is_readable_by_others(tmp_path: Path, table: str) -> None:
    """Pandas and PyYAML find the exact numbers in a folder written by SEALS."""
    import pandas as pd

    values = np.array([0.1, np.nan, 1.0 / 3.0])
    log = Log(
        name="x",
        columns={"t": np.array([0.0, 0.1, 0.2]), "depth": values},
        segment=np.array([0, 0, 1]),
        meta={"vehicle": {"mass": np.float64(2.0)}},
        licence="CC0",
    )
    place = write_native(log, tmp_path / "out", table=table, urdf="<robot/>")
    read = pd.read_parquet if table.endswith("parquet") else pd.read_csv
    frame = read(place / table)
    assert np.array_equal(frame["depth"].to_numpy(), values, equal_nan=True)
    assert frame["segment"].tolist() == [0, 0, 1]
    meta = yaml.safe_load((place / "meta.yaml").read_text())
    assert meta["format_version"] == 1
    assert meta["vehicle"] == {"mass": 2.0}
    assert read_native(place).licence == "CC0"
    assert (place / "vehicle.urdf").read_text() == "<robot/>"


def test_existing_folder_is_not_overwritten(tmp_path: Path) -> None:
    """Writing over a folder needs to be asked for."""
    place = _folder(tmp_path / "a")
    log = read_native(place)
    with pytest.raises(LogError, match="exists already"):
        write_native(log, place)
    assert (place / "log.csv").read_text() == CSV
    write_native(log, place, replace=True)
    assert not (place / "log.csv").exists()


def test_reader_takes_a_folder_of_folders(tmp_path: Path) -> None:
    """A folder of log folders gives one log each, in the order of their names."""
    _folder(tmp_path / "b")
    _folder(tmp_path / "a")
    assert [log.name for log in ReaderNative(path=str(tmp_path)).read()] == ["a", "b"]


def test_reader_without_a_path_says_what_it_needs() -> None:
    """Nothing given: refused, naming the option."""
    with pytest.raises(LogError, match="path=FOLDER"):
        ReaderNative().read()


def test_missing_pieces_are_named(tmp_path: Path) -> None:
    """No folder, no table, no meta: each is named."""
    with pytest.raises(LogError, match="no such file or folder"):
        read_native(tmp_path / "nowhere")
    (tmp_path / "note.txt").touch()
    with pytest.raises(LogError, match="not a log folder"):
        read_native(tmp_path / "note.txt")
    with pytest.raises(LogError, match=r"neither log\.parquet nor log\.csv"):
        read_native(tmp_path)
    (tmp_path / "log.csv").write_text(CSV)
    with pytest.raises(LogError, match=r"holds no meta\.yaml"):
        read_native(tmp_path)
