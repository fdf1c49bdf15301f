"""What benchmarks/fuzz.py found, each as the smallest file that showed it."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from seals.errors import ConfigError, LogError
from seals.logs.arrays import read_npy
from seals.plugins.readers.mcap import ReaderMcap
from seals.plugins.readers.rosbag2 import ReaderRosbag2
from seals.teleop.track import read_track


def _npy(header: bytes) -> bytes:
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(96)


@pytest.mark.parametrize(
    "header",
    [b"{'descr': '<f8', 'shape': FaFaF", b"{'descr': '''<f8'}\n", b"{'a\0': (\n\n", b"[" * 9000],
)
def test_a_damaged_array_header(header: bytes, tmp_path: Path) -> None:
    """The header is a Python literal; its tokeniser has errors of its own."""
    file = tmp_path / "a.npy"
    file.write_bytes(_npy(header))
    with pytest.raises(LogError, match="not a sound NumPy"):
        read_npy(file)


def test_a_cell_of_a_script_longer_than_a_table_allows(tmp_path: Path) -> None:
    """An open quote swallows the rest of the file, up to the limit of the reader of tables."""
    file = tmp_path / "keys.csv"
    file.write_text('t,control,value\n0.5,"' + "w" * 140_000 + "\n")
    with pytest.raises(ConfigError, match="is no table"):
        read_track(file)


def _record(kind: int, body: bytes, length: int | None = None) -> bytes:
    return bytes([kind]) + struct.pack("<Q", len(body) if length is None else length) + body


def _chunk(size: int) -> bytes:
    return _record(6, struct.pack("<QQQII", 0, 0, 16, 0, 0) + struct.pack("<Q", size) + bytes(16))


@pytest.mark.parametrize(
    "record",
    [
        _chunk(1 << 32),
        _chunk(1 << 63),
        _record(5, b"", 1 << 25),
        _record(4, struct.pack("<HHI", 1, 1, 0xFFFFFFF0) + b"/a"),
        _record(0x7A, b"", 1 << 63),
        _record(6, struct.pack("<QQQII", 0, 0, 9, 0, 0) + struct.pack("<QBQ", 9, 5, 1 << 63)),
    ],
)  # fmt: skip
def test_a_length_that_the_file_does_not_have(record: bytes, tmp_path: Path) -> None:
    """No room is made for what a record of MCAP only claims to hold."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    import resource

    file = tmp_path / "a.mcap"
    file.write_bytes(b"\x89MCAP0\r\n" + _record(1, bytes(8)) + record)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(LogError, match="not a sound MCAP"):
        ReaderMcap().read(file)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


def _renamed(path: Path) -> None:
    raw = path.read_bytes()
    path.write_bytes(raw.replace(b"serialization_format", b"serialization_\xb7\xff\xfemat", 1))


def _nulled(path: Path) -> None:
    raw = path.read_bytes()
    path.write_bytes(raw.replace(b"CREATE TABLE topics", b"CREATE TABLE top\xb7cs", 1))


@pytest.mark.parametrize("spoil", [_renamed, _nulled])
def test_names_in_a_database_that_are_no_text(
    spoil: Callable[[Path], None], tmp_path: Path
) -> None:
    """SQLite hands out names of columns as they are; they may be no UTF-8."""
    file = tmp_path / "a.db3"
    base = sqlite3.connect(file)
    base.execute("CREATE TABLE topics(id, name, type, serialization_format)")
    base.execute("CREATE TABLE messages(id, topic_id, timestamp, data)")
    base.commit()
    base.close()
    spoil(file)
    with pytest.raises(LogError):
        ReaderRosbag2().read(file)
