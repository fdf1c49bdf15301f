"""Parquet files forged byte by byte: what the library would read is what was checked."""

from __future__ import annotations

import contextlib
import struct
import time
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.table import (
    MOST_COLUMNS,
    MOST_FOOTER_BYTES,
    read_csv_columns,
    read_parquet,
    read_struct,
)

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")
zstandard = pytest.importorskip("zstandard")
ROWS = 400
HUGE = 1 << 29
"""What a page declares to unpack to [byte]."""


def varint(number: int) -> bytes:
    """Return a number as Thrift writes it, seven bits a byte."""
    out = b""
    while number > 127:
        out, number = out + bytes([number & 127 | 128]), number >> 7
    return out + bytes([number])


def field(step: int, number: int, kind: int = 5) -> bytes:
    """Return a field with a whole number: of 32 bits, of 64 where the kind is 6."""
    return bytes([step << 4 | kind]) + varint((number << 1) ^ (number >> 63))


def counted(step: int, values: int, encoding: int = 0) -> bytes:
    """Return the part of a header that counts values, so many fields after the one before."""
    return bytes([step << 4 | 12]) + field(1, values) + field(1, encoding) + b"\0"


def page(kind: int, unpacked: int, data: bytes, *rest: bytes) -> bytes:
    """Return a page: kind, sizes, further fields, data."""
    head = field(1, kind) + field(1, unpacked) + field(1, len(data))
    return head + b"".join(rest) + b"\0" + data


ONE = zstandard.compress(bytes(8))
BOMB = page(0, HUGE, zstandard.compress(bytes(1 << 20)), counted(2, ROWS))
SOUND = page(0, 8, ONE, counted(2, 1))
FORGED: dict[str, tuple[bytes, str]] = {
    "a bomb": (BOMB, "decompress to"),
    "a bomb after a dictionary that counts as data": (
        page(2, 8, ONE, counted(2, ROWS), counted(2, 1)) + BOMB,
        "decompress to",
    ),
    "a bomb after an index that counts as data": (
        page(1, 8, ONE, counted(2, ROWS)) + BOMB,
        "decompress",
    ),
    "a bomb after a page of the second kind that counts as the first": (
        page(3, 8, ONE, counted(2, ROWS), counted(3, 1)) + BOMB,
        "decompress to",
    ),
    "a bomb after a count of more than 32 bits": (
        page(0, 8, ONE, counted(2, (1 << 32) + ROWS)) + BOMB,
        "without a valid header",
    ),
    "a bomb after more values than there are": (
        page(0, 8, ONE, counted(2, ROWS + 1)) + BOMB,
        f"{ROWS + 1} values in a page of {ROWS}",
    ),
    "a size twice, the second of 64 bits": (
        field(1, 0) + field(1, HUGE) + b"\x06" + varint(4) + varint(20) + field(1, 8)
        + counted(2, ROWS) + b"\0" + ONE,
        "without a valid header",
    ),
    "a size of 64 bits": (
        field(1, 0) + field(1, 8, kind=6) + field(1, len(ONE)) + counted(2, ROWS) + b"\0" + ONE,
        "without a valid header",
    ),
    "a size twice": (
        field(1, 0) + field(1, HUGE) + b"\x05" + varint(4) + varint(20) + field(1, 8)
        + counted(2, ROWS) + b"\0" + ONE,
        "without a valid header",
    ),
    "a dictionary of two billion entries": (
        page(2, 8, ONE, counted(4, (1 << 31) - 1)) + SOUND,
        "2,147,483,647 values in a page",
    ),
    "a dictionary without a count": (page(2, 8, ONE) + SOUND, "without a valid header"),
    "a data page without a count": (page(0, 8, ONE), "without a valid header"),
    "less than nothing": (page(0, -8, ONE, counted(2, ROWS)), "decompress to"),
    "a page of a negative length": (
        field(1, 0) + field(1, 8) + field(1, -60) + counted(2, 1) + b"\0",
        "decompress to",
    ),
    "structures without end": (b"\x1c" * 2000, "without a valid header"),
    "a list of a million": (b"\x19\xf5" + varint(1_000_000), "without a valid header"),
    "a number without end": (b"\x15" + b"\xff" * 100, "without a valid header"),
}  # fmt: skip


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, int, int]:
    """Return a file with one column, and where its only chunk begins and how long it is."""
    file = tmp_path_factory.mktemp("honest") / "log.parquet"
    time_ = np.random.default_rng(0).random(ROWS)
    parquet.write_table(
        pa.table({"t": time_}), file, compression="zstd", use_dictionary=False,
        write_statistics=False,
    )  # fmt: skip
    chunk = parquet.ParquetFile(file).metadata.row_group(0).column(0)
    return file.read_bytes(), chunk.data_page_offset, chunk.total_compressed_size


@pytest.mark.parametrize("name", FORGED)
def test_forged_pages_are_refused_before_they_are_unpacked(
    tmp_path: Path, honest: tuple[bytes, int, int], name: str
) -> None:
    """The library takes fields by kind and number; the check does as well."""
    (raw, start, length), (pages, words) = honest, FORGED[name]
    assert len(pages) < length
    file = tmp_path / "log.parquet"
    file.write_bytes(raw[:start] + pages.ljust(length, b"\0") + raw[start + length :])
    with pytest.raises(LogError, match=words):
        read_parquet(file)


def test_the_forger_writes_what_the_library_reads(
    tmp_path: Path, honest: tuple[bytes, int, int]
) -> None:
    """A page of one's own, unforged, is read: refusals above are no slips of the pen."""
    raw, start, length = honest
    values = np.arange(ROWS) * 0.5
    levels = struct.pack("<I", 3) + varint(ROWS << 1) + b"\1"
    content = levels + values.tobytes()
    rest = bytes([0x2C]) + field(1, ROWS) + field(1, 0) + field(1, 3) + field(1, 3) + b"\0"
    whole = page(0, len(content), zstandard.compress(content), rest)
    assert read_struct(whole)[0][5][1] == ROWS
    (tmp_path / "log.parquet").write_bytes(
        raw[:start] + whole.ljust(length, b"\0") + raw[start + length :]
    )
    np.testing.assert_array_equal(read_parquet(tmp_path / "log.parquet")["t"], values)


def many(kind: int, count: int) -> bytes:
    """Return the head of a list that declares so many entries."""
    return bytes([0xF0 | kind]) + varint(count)


_SCHEMA = b"\x15\x02\x19\x2c\x48\x01r\x15\x02\x00\x15\x0a\x25\x00\x18\x01t\x00\x16\x02"
FOOTERS = {
    "columns": b"\x15\x02\x19" + many(12, 999_000) + b"\x48\x01a\x15\x02\x00",
    "groups of rows": _SCHEMA + b"\x19" + many(12, 999_000) + b"\x26\x00",
    "chunks": _SCHEMA + b"\x19\x1c\x19" + many(12, 999_000) + b"\x26\x00",
    "nothing": b"\0",
    "structures without end": b"\x1c" * 5000,
    "a text of two gigabytes": b"\x15\x02\x18" + varint((1 << 31) - 1),
}


@pytest.mark.parametrize("name", FOOTERS)
def test_forged_descriptions_take_no_memory(tmp_path: Path, name: str) -> None:
    """Room for a list is made before its entries are read: some bytes asked for a gigabyte."""
    raw = FOOTERS[name]
    (tmp_path / "log.parquet").write_bytes(b"PAR1" + raw + struct.pack("<I", len(raw)) + b"PAR1")
    before, start = _peak(), time.process_time()
    with pytest.raises(LogError, match="not a valid Parquet file"):
        read_parquet(tmp_path / "log.parquet")
    assert _peak() - before < 150e6
    assert time.process_time() - start < 5.0


def _peak() -> int:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


@pytest.mark.parametrize("end", [b"PAR1", b"PARE"])
def test_large_descriptions_are_refused_whatever_their_kind(tmp_path: Path, end: bytes) -> None:
    """Encrypted ones, too: their end is spelled otherwise."""
    size = MOST_FOOTER_BYTES + 1
    (tmp_path / "log.parquet").write_bytes(end + bytes(size) + struct.pack("<I", size) + end)
    with pytest.raises(LogError, match="declares a description"):
        read_parquet(tmp_path / "log.parquet")


def test_more_columns_than_a_log_has_are_refused(tmp_path: Path) -> None:
    """Each column is read by itself, which takes its time even when it is empty."""
    names = [f"c{k}" for k in range(MOST_COLUMNS + 1)]
    empty = pa.table({name: pa.array([], pa.int8()) for name in names})
    parquet.write_table(empty, tmp_path / "log.parquet", write_statistics=False)
    (tmp_path / "log.csv").write_text(",".join(names) + "\n")
    tracemalloc.start()
    for read in (read_parquet, read_csv_columns):
        with pytest.raises(LogError, match="4,097 columns; the limit is 4,096"):
            read(tmp_path / f"log.{'csv' if read is read_csv_columns else 'parquet'}")
    tracemalloc.stop()


def test_types_that_only_the_description_names_run_nothing(tmp_path: Path) -> None:
    """An extension type may name a pickle; the numbers below it are read as numbers."""
    mark = tmp_path / "mark"
    # a pickle that makes a folder, as text
    evil = f"cposix\nmkdir\n(V{mark}\ntR.".encode()
    name, value = "ARROW:extension:name", "ARROW:extension:metadata"
    meta = {name.encode(): b"arrow.py_extension_type", value.encode(): evil}
    schema = pa.schema([pa.field("t", pa.float64(), metadata=meta)])
    table: Any = pa.table({"t": np.arange(3.0)}).cast(schema)
    parquet.write_table(table, tmp_path / "log.parquet")
    np.testing.assert_array_equal(read_parquet(tmp_path / "log.parquet")["t"], np.arange(3.0))
    assert not mark.exists()


@pytest.mark.parametrize("zone", ["../../../etc/passwd", "/etc/passwd", "nowhere", "a\0b"])
def test_a_time_zone_names_no_file(tmp_path: Path, zone: str) -> None:
    """The name of a zone is looked up in a list: the column is read, or refused in words."""
    stamps = pa.array([0, 1_000_000]).view(pa.timestamp("us", zone))
    parquet.write_table(pa.table({"t": stamps}), tmp_path / "log.parquet")
    found: list[int] = []
    with contextlib.suppress(LogError):
        found.append(read_parquet(tmp_path / "log.parquet")["t"].size)
    assert found in ([2], [])
