"""Parquet files that unpack to far more than they hold: refused before anything is unpacked."""

from __future__ import annotations

import resource
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs import table
from seals.logs.table import read_parquet

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")
PATIENCE = 5.0
"""Longest that reading or refusing may take [s]."""
ROOM = 300 << 20
"""Memory that reading or refusing may take on top of what the process has [byte]."""
ROWS = 2_000
TIME = np.arange(ROWS) * 0.01


def _write(file: Path, columns: dict[str, Any], **how: Any) -> None:
    parquet.write_table(pa.table(columns), file, **{"compression": "zstd", **how})


def _lists(file: Path, name: str = "notes") -> None:
    """A few kilobytes that stand for sixty million numbers in lists."""
    inner, ends = pa.array(np.zeros(3_000_000)), np.linspace(0, 3_000_000, 101).astype(np.int64)
    lists = pa.LargeListArray.from_arrays(pa.array(ends), inner)
    part = pa.table({"t": TIME[:100], name: lists})
    with parquet.ParquetWriter(file, part.schema, compression="zstd") as out:
        for _ in range(ROWS // 100):
            out.write_table(part)


def _texts(file: Path) -> None:
    """One text of a megabyte, in a dictionary, for every row."""
    words = pa.DictionaryArray.from_arrays(pa.array(np.zeros(ROWS, np.int32)), ["x" * (1 << 20)])
    _write(file, {"t": TIME, "notes": words})


def _within(read: Callable[[], Any]) -> Any:
    """Read with little time and little memory on top of what is there."""
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    try:
        return read()
    finally:
        assert time.process_time() - start < PATIENCE
        assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 < ROOM


@pytest.mark.parametrize("build", [_lists, _texts])
def test_columns_that_nobody_wants_are_not_unpacked(
    tmp_path: Path, build: Callable[[Path], None]
) -> None:
    """Lists and texts stay packed; the numbers beside them are read."""
    build(tmp_path / "log.parquet")
    assert (tmp_path / "log.parquet").stat().st_size < 200_000
    read = _within(lambda: read_parquet(tmp_path / "log.parquet"))
    assert list(read) == ["t"]
    assert read["t"].shape == TIME.shape


def test_a_known_channel_of_lists_is_refused_unread(tmp_path: Path) -> None:
    """The schema says enough."""
    _lists(tmp_path / "log.parquet", "depth")
    with pytest.raises(LogError, match="'depth' must hold numbers, it holds lists"):
        _within(lambda: read_parquet(tmp_path / "log.parquet"))


KINDS: dict[str, Any] = {
    "text": lambda: pa.array(["a"] * ROWS),
    "bytes": lambda: pa.array([b"a"] * ROWS),
    "truth": lambda: pa.array([True] * ROWS),
    "structure": lambda: pa.array([{"x": 1.0, "y": "a"}] * ROWS),
    "lists of structures": lambda: pa.array([[{"x": 1.0}]] * ROWS),
    "map": lambda: pa.array([[("a", 1.0)]] * ROWS, pa.map_(pa.string(), pa.float64())),
    "decimals": lambda: pa.array([1] * ROWS).cast(pa.decimal128(30, 2)),
    "dictionary of numbers": lambda: pa.array(["1.0"] * ROWS).dictionary_encode(),
    "dates": lambda: pa.array(np.arange(ROWS), pa.timestamp("ns")),
    "times of day": lambda: pa.array(np.arange(ROWS), pa.time64("ns")),
    "durations": lambda: pa.array(["1"] * ROWS, pa.large_string()),
    "fixed lists": lambda: pa.array([[1.0, 2.0]] * ROWS, pa.list_(pa.float64(), 2)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_other_kinds_are_left_out_or_refused_by_name(tmp_path: Path, kind: str) -> None:
    """Under a strange name a column that holds no numbers is left out, as a channel refused."""
    _write(tmp_path / "a.parquet", {"t": TIME, "other": KINDS[kind]()})
    assert list(read_parquet(tmp_path / "a.parquet")) == ["t"]
    _write(tmp_path / "b.parquet", {"t": TIME, "depth": KINDS[kind]()})
    with pytest.raises(LogError, match="'depth' must hold numbers"):
        read_parquet(tmp_path / "b.parquet")


def test_every_kind_of_number_is_read(tmp_path: Path) -> None:
    """Whole numbers, floats of each width, columns without a sample; packed in every way."""
    whole = np.arange(ROWS)
    columns = {
        "t": TIME,
        **{f"i{k}": pa.array(whole % 100, f"int{k}") for k in (8, 16, 32, 64)},
        **{f"u{k}": pa.array(whole % 100, f"uint{k}") for k in (8, 16, 32, 64)},
        "half": pa.array((whole % 8).astype(np.float16)),
        "single": pa.array(whole.astype(np.float32)),
        "none": pa.nulls(ROWS),
        "gaps": pa.array([None, 1.0] * (ROWS // 2)),
    }
    for compression in ("zstd", "snappy", "gzip", "none"):
        for page in ("1.0", "2.0"):
            file = tmp_path / f"{compression}{page}.parquet"
            _write(file, columns, compression=compression, data_page_version=page)
            read = read_parquet(file)
            assert list(read) == list(columns)
            np.testing.assert_array_equal(read["i16"], whole % 100)
            assert np.isnan(read["none"]).all()
            assert np.isnan(read["gaps"]).sum() == ROWS // 2
    assert list(read_parquet(file, wanted=["half"])) == ["half"]


def _bomb(file: Path, *, zeros: int) -> None:
    """A column of ten numbers whose page holds, packed, that many zero bytes."""
    import zstandard

    _write(file, {"t": np.arange(10.0)}, use_dictionary=False, write_statistics=False)
    raw, about = file.read_bytes(), parquet.ParquetFile(file).metadata.row_group(0).column(0)
    start, length = about.data_page_offset, about.total_compressed_size
    header, taken = table.read_struct(raw[start:])
    packed = zstandard.compress(bytes(zeros))
    sizes = b"\x15" + _zigzag(zeros) + b"\x15" + _zigzag(len(packed))
    old = b"\x15" + _zigzag(header[2]) + b"\x15" + _zigzag(header[3])
    assert raw[start : start + taken].count(old) == 1
    page = raw[start : start + taken].replace(old, sizes) + packed
    file.write_bytes(raw[:start] + page.ljust(length, b"\0") + raw[start + length :])


def _zigzag(number: int) -> bytes:
    number, out = number << 1, b""
    while number > 127:
        out, number = out + bytes([number & 127 | 128]), number >> 7
    return out + bytes([number])


def test_a_page_that_unpacks_to_more_than_its_numbers_is_refused(tmp_path: Path) -> None:
    """The footer keeps silent about it; the header of the page is believed."""
    _bomb(tmp_path / "log.parquet", zeros=1 << 29)
    with pytest.raises(LogError, match="10 numbers that decompress to 536,870,912 bytes"):
        _within(lambda: read_parquet(tmp_path / "log.parquet"))


def test_a_large_footer_is_refused(tmp_path: Path) -> None:
    """The description of a file is unfolded to objects: it is measured first."""
    file = tmp_path / "log.parquet"
    for size in (1 << 23, (1 << 32) - 1):
        file.write_bytes(b"PAR1" + bytes(1 << 23) + struct.pack("<I", size) + b"PAR1")
        with pytest.raises(LogError, match="declares a description"):
            _within(lambda: read_parquet(file))


def test_many_pages_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A page may hold one number; their count is bounded."""
    assert table.MOST_PAGES == 200_000
    monkeypatch.setattr(table, "MOST_PAGES", 9)
    _write(tmp_path / "a.parquet", {"t": np.random.default_rng(0).random(100)}, row_group_size=10)
    with pytest.raises(LogError, match="more than 9 pages"):
        read_parquet(tmp_path / "a.parquet")


def test_declared_rows_are_bounded(tmp_path: Path) -> None:
    """One repeated value may stand for more rows than the memory holds."""
    _write(tmp_path / "a.parquet", {"t": np.zeros(10_000_000), "x": np.zeros(10_000_000)})
    assert table.MOST_VALUES < 11 * 10_000_000
    many = {f"c{k}": pa.array(np.zeros(10_000_000, np.int8)) for k in range(10)}
    _write(tmp_path / "b.parquet", {"t": np.zeros(10_000_000), **many})
    with pytest.raises(LogError, match="10,000,000 rows of 11 columns"):
        _within(lambda: read_parquet(tmp_path / "b.parquet"))


def test_the_time_of_a_large_table_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody waits a minute without a word; small tables are read in silence."""
    _write(tmp_path / "a.parquet", {f"c{k}": np.zeros(1_100_000, np.int8) for k in range(5)})
    read_parquet(tmp_path / "a.parquet", wanted=["c0"])
    assert capsys.readouterr().err == ""
    read_parquet(tmp_path / "a.parquet")
    assert "1,100,000 rows of 5 columns, 44 MB of memory" in capsys.readouterr().err
    (tmp_path / "a.csv").write_text("t,x,y,z,a,b\n" + "1,2,3,4,5,6\n" * 900_000)
    table.read_csv_columns(tmp_path / "a.csv")
    assert "takes about 5 s" in capsys.readouterr().err


def test_a_table_takes_little_more_memory_than_its_numbers(tmp_path: Path) -> None:
    """Columns are unpacked one at a time: no second copy of the whole table."""
    rows = 2_000_000
    _write(tmp_path / "a.parquet", {f"c{k}": np.zeros(rows) for k in range(20)})
    script = (
        "import resource, sys; from seals.logs.table import read_parquet; import pyarrow.parquet; "
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024; "
        "before = peak(); read = read_parquet(sys.argv[1]); "
        "print((peak() - before) / sum(column.nbytes for column in read.values()))"
    )
    words = [sys.executable, "-c", script, str(tmp_path / "a.parquet")]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert float(done.stdout) < 1.6


def test_a_damaged_page_header_is_refused(tmp_path: Path) -> None:
    """Cut short, without end, or nested: no header is read beyond its bounds."""
    for raw in (b"", b"\x15", b"\x15" + b"\xff" * 20, b"\x1c" * 100, b"\x19\xf8\xff\xff\xff\x0f"):
        with pytest.raises((IndexError, ValueError)):
            table.read_struct(raw)
