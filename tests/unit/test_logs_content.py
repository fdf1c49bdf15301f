"""The reader is chosen by what a file holds, whatever it is called."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import shutil
import sqlite3
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from seals.cli.main import main
from seals.errors import LogError
from seals.logs.reader import foreign_reader_of, reader_of
from seals.logs.shipped import find_log

TABLE = "t,depth\n" + "".join(f"{0.1 * k:.1f},{1 + k % 3}\n" for k in range(20))
MAVLINK = struct.pack(">Q", 1_700_000_000_000_000) + b"\xfd\x09\0\0\0\1\1\0\0\0" + bytes(11)
WIT = "StartTime: 2023\nTime(s)\tax(g)\tay(g)\taz(g)\n 0.01\t0.5\t0.2\t1\n"
CRAZYFLIE = b"\xbc\2\0\1\0" + b"\0\0event\0\0\0"
BLACKBOX = b"H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\n"


def _sqlite() -> bytes:
    base = sqlite3.connect(":memory:")
    base.execute("CREATE TABLE topics (id)")
    return base.serialize() if hasattr(base, "serialize") else b"SQLite format 3\0" + bytes(90)


def _matlab() -> bytes:
    out = io.BytesIO()
    savemat(out, {"t": np.arange(3.0)})
    return out.getvalue()


def _zipped() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("log.csv", TABLE)
    return out.getvalue()


def _shipped(name: str) -> Callable[[], bytes]:
    def take() -> bytes:
        raw = find_log(name).read_bytes()
        return gzip.decompress(raw) if name.endswith(".gz") else raw

    return take


@pytest.mark.parametrize(
    ("make", "reader"),
    [
        (_shipped("own_flight/flight_1.ulg.gz"), "ulog"),
        (_shipped("own_flight/flight_2.mcap"), "mcap"),
        (_sqlite, "rosbag2"),
        (lambda: b"#ROSBAG V2.0\n" + bytes(50), "rosbag1"),
        (lambda: b"\xa3\x95\x80\x80\x59FMT\0BBnNZ", "dataflash"),
        (lambda: MAVLINK, "tlog"),
        (_matlab, "matlab"),
        (lambda: b"\0" * 512 + b"\x89HDF\r\n\x1a\n", "matlab"),
        (lambda: b"loopIteration, time (us), axisP[0]\n0, 1, 2\n", "betaflight"),
        (lambda: b'"Product","Blackbox flight data recorder"\n', "betaflight"),
        (WIT.encode, "witmotion"),
        (lambda: CRAZYFLIE, "crazyflie"),
        (TABLE.encode, "csv"),
        (("\ufeff" + TABLE.replace(",", ";")).encode, "csv"),
    ],
)
@pytest.mark.parametrize("name", ["a.dat", "a.ulg", "a.csv.gz"])
def test_the_content_decides(
    make: Callable[[], bytes], reader: str, name: str, tmp_path: Path
) -> None:
    """Under any name, packed with gzip or not."""
    raw = make()
    (tmp_path / name).write_bytes(gzip.compress(raw) if name.endswith(".gz") else raw)
    assert foreign_reader_of(tmp_path / name) == reader
    assert reader_of(tmp_path / name) == reader


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (BLACKBOX, "blackbox_decode --unit-rotation deg/s --unit-acceleration g FILE"),
        (b"#ROSBAG V1.2\n", "rosbag migrate"),
        (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\n", r"Use the \.bin"),
        (_zipped(), "Decompress it"),
        (bz2.compress(b"a" * 99), "bunzip2"),
        (lzma.compress(b"a" * 99), "unxz"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
        (b"PAR1" + bytes(40), r"Name it log\.parquet"),
        (b'{"topic": "imu", "time": 1}\n', "JSON"),
        (b"<!DOCTYPE html><html>, </html>\n", "Download the log itself"),
    ],
)
def test_what_no_reader_takes_has_a_next_step(
    raw: bytes,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit code 2, and the program that makes it readable, whatever the name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.ulg").write_bytes(raw)
    with pytest.raises(LogError, match=words):
        foreign_reader_of(tmp_path / "a.ulg")
    assert main(["convert", "log=a.ulg", "out=b"]) == 2
    said = capsys.readouterr().err
    assert "which no reader accepts" in said
    assert "Traceback" not in said


def test_a_name_helps_where_the_content_does_not(tmp_path: Path) -> None:
    """A damaged file is refused by the reader of its name; without one a reader is asked for."""
    for name, reader in (("a.tlog", "tlog"), ("a.MAT", "matlab"), ("a.bin", None)):
        (tmp_path / name).write_bytes(bytes(range(128, 256)))
        assert foreign_reader_of(tmp_path / name) == reader
    (tmp_path / "empty.ulg").write_bytes(b"")
    with pytest.raises(LogError, match="is empty"):
        foreign_reader_of(tmp_path / "empty.ulg")
    (tmp_path / "b.csv.gz").write_bytes(b"\x1f\x8b" + b"\7" * 40)
    with pytest.raises(LogError, match=r"not a valid \.gz"):
        foreign_reader_of(tmp_path / "b.csv.gz")


def test_converting_needs_no_name_of_a_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log of PX4 under another name, and a table whose columns are called as ours."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(find_log("own_flight/flight_1.ulg.gz"), "flight.gz")
    assert main(["convert", "log=flight.gz", "out=a"]) == 0
    (tmp_path / "table.txt").write_text(TABLE)
    assert main(["convert", "log=table.txt", "out=b"]) == 0
    assert "b: 20 rows, depth" in capsys.readouterr().out
