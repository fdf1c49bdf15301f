"""Numeric columns of Parquet and CSV files; malformed files raise a `LogError`."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.channels import CHANNELS, stem_of
from seals.logs.parquet_pages import MOST_ENTRIES, refuse_bombs, refuse_large_footer
from seals.untrusted_io import read_bytes, regular_file

MOST_VALUES = 100_000_000
"""Largest table that is read, in values."""
MOST_COLUMNS = 4096
"""Most columns of a table."""
_LARGE = 5_000_000
"""Values above which the time that a table takes is said."""
_PACE = 1e-6
"""Time to read and check one value, measured on seven columns of ten million rows [s]."""
_DELIMITERS = ",;\t|"
_FIRST_LINES = 100
"""Lines among which a header is looked for."""
_NUMBERS = ("int32", "int64", "float", "double", "float16", "unknown")
_DATES = ("timestamp", "date")
_DATE = re.compile(
    rb"\d{4}-\d\d-\d\d(?:[T ]\d\d:?\d\d(?::?\d\d(?:\.\d*)?)?(?P<zone>Z|[-+]\d\d:?\d\d)?)?"
)


def read_parquet(path: str | Path, *, wanted: Collection[str] | None = None) -> dict[str, Floats]:
    """Return the numeric columns of a Parquet file, each of shape (rows,); missing values are NaN.

    The schema is read first; of the rest only flat columns of numbers are unpacked, one at a time.
    A date is returned in seconds since 1970-01-01.

    Args:
        path: the file.
        wanted: columns to read; None takes every numeric column.

    Raises:
        LogError: the file is damaged or too large, or a known channel does not hold numbers.
    """
    import pyarrow as pa
    from pyarrow import parquet

    file = regular_file(path)
    refuse_large_footer(file)
    columns: dict[str, Floats] = {}
    try:
        content = parquet.ParquetFile(
            file, pre_buffer=False, thrift_container_size_limit=MOST_ENTRIES
        )
        if len(content.schema) > MOST_COLUMNS:
            raise _too_wide(file, len(content.schema))
        places = _plain(file, content.schema, wanted)
        _check_size(file, content.metadata.num_rows, len(places))
        for name, place in places.items():
            refuse_bombs(file, content.metadata, place)
            table = content.reader.read_all(column_indices=[place], use_threads=False)
            columns |= _numbers(file, table.rename_columns([name]))
    except (pa.ArrowException, OSError, ValueError, OverflowError) as error:
        raise LogError(
            f"'{file}' is not a valid Parquet file: {_short(error)}\nWas it copied completely?"
        ) from error
    return columns


def _plain(file: Path, schema: Any, wanted: Collection[str] | None) -> dict[str, int]:
    """Return the index of each flat numeric column, from the schema alone."""
    found: dict[str, int] = {}
    for place in range(len(schema)):
        column = schema.column(place)
        name = str(column.path)
        kind = str(column.logical_type.type).lower()
        kind = str(column.physical_type).lower() if kind in ("none", "int") else kind
        nested = column.max_repetition_level > 0 or column.max_definition_level > 1
        flat = not nested and (kind in _NUMBERS or (kind in _DATES and name == "t"))
        if flat and (wanted is None or name in wanted):
            found.setdefault(name, place)
        elif not flat:
            top = name.partition(".")[0] if nested else name
            _refuse_text(file, top, "lists" if column.max_repetition_level > 0 else kind)
    return found


def read_csv_columns(
    path: str | Path,
    *,
    delimiter: str = ",",
    skip_lines: int = 0,
    wanted: Collection[str] | None = None,
    clock: str = "t",
) -> dict[str, Floats]:
    """Return the numeric columns of a CSV file (plain or ``.gz``), each of shape (rows,).

    Args:
        path: the file.
        delimiter: one character between values.
        skip_lines: lines before the header.
        wanted: columns that must be there and hold numbers; None takes every numeric column.
        clock: column that may hold dates in place of numbers; they become seconds since 1970.

    Raises:
        LogError: the file is damaged, a wanted column is missing, or a cell is not a number.
    """
    import pyarrow as pa

    raw = read_bytes(path)
    names = header(path, raw, delimiter=delimiter, skip_lines=skip_lines)
    _check_size(Path(path), raw.count(b"\n"), len(names))
    if wanted is None:
        layout = _layout_hint(raw, "", delimiter, skip_lines) if len(names) == 1 else ""
        if layout:
            raise LogError(f"'{path}' has one column only, '{names[0][:80]}'.\n{layout}")
    elif missing := [name for name in wanted if name not in names]:
        there = _layout_hint(raw, missing[0], delimiter, skip_lines)
        there = there or suggestion(missing[0], names, label="Columns there")
        raise LogError(f"'{path}' has no column '{missing[0]}'.\n{there}")
    forced = _must_be_numbers(names) if wanted is None else list(wanted)
    picked = None if wanted is None else forced
    kinds = {name: pa.float64() for name in forced}
    if clock in kinds:
        kinds[clock] = _kind_of_time(raw, names.index(clock), delimiter, skip_lines)
    try:
        table = _parse_csv(
            raw, names, kinds=kinds, picked=picked, delimiter=delimiter, skip_lines=skip_lines
        )
    except (pa.ArrowException, ValueError) as error:
        raise LogError(
            f"'{path}' cannot be read as a table of numbers: {_short(error)}\n"
            "Numbers need a decimal point; a missing sample is an empty field or nan."
        ) from error
    return _numbers(Path(path), table, clock)


def _kind_of_time(raw: bytes, place: int, delimiter: str, skip_lines: int) -> Any:
    """Return the type of the time column, numbers or dates, by its first cell."""
    import pyarrow as pa

    lines = raw[: 1 << 20].split(b"\n", skip_lines + 2)
    cells = lines[skip_lines + 1].split(delimiter.encode()) if len(lines) > skip_lines + 1 else []
    found = _DATE.fullmatch(cells[place].strip(b'" \r')) if place < len(cells) else None
    return pa.timestamp("ns", "UTC" if found["zone"] else None) if found else pa.float64()


def _parse_csv(
    raw: bytes,
    names: list[str],
    *,
    kinds: Mapping[str, Any],
    picked: list[str] | None,
    delimiter: str,
    skip_lines: int,
) -> Any:
    from pyarrow import csv

    # the header is parsed above: blanks around names and a byte-order mark are common
    reading = csv.ReadOptions(skip_rows=skip_lines + 1, column_names=names, use_threads=False)
    converting = csv.ConvertOptions(column_types=dict(kinds), include_columns=picked)
    parsing = csv.ParseOptions(delimiter=delimiter)
    return csv.read_csv(
        io.BytesIO(raw), read_options=reading, parse_options=parsing, convert_options=converting
    )


def header(path: str | Path, raw: bytes, *, delimiter: str = ",", skip_lines: int = 0) -> list[str]:
    """Return the column names of a CSV file's first line.

    Raises:
        LogError: it is not UTF-8 text, has no header, or names a column twice.
    """
    line = (raw[: 1 << 20].split(b"\n", skip_lines + 1) + [b""] * (skip_lines + 1))[skip_lines]
    try:
        text = line.decode("utf-8-sig").strip("\r")
    except UnicodeDecodeError as error:
        raise LogError(
            f"'{path}' is not UTF-8 text ({error.reason}).\nSave it again as UTF-8."
        ) from error
    names = [name.strip().strip('"') for name in text.split(delimiter)]
    if len(names) > MOST_COLUMNS:
        raise _too_wide(path, len(names))
    twice = sorted({name for name in names if names.count(name) > 1})
    if "\0" in text or not text.strip():
        raise LogError(f"'{path}' has no header line of column names.")
    if twice:
        raise LogError(f"'{path}' names these columns twice: {', '.join(twice)}.")
    return names


def _too_wide(file: str | Path, width: int) -> LogError:
    return LogError(
        f"'{file}' has {width:,} columns, allowed are {MOST_COLUMNS:,}.\nSplit the log first."
    )


def _layout_hint(raw: bytes, sought: str, delimiter: str, skip_lines: int) -> str:
    """Say by which delimiter and in which line a header seems to stand; empty if as it is read.

    Args:
        raw: the file.
        sought: a column of the header; empty takes the first line of most cells for the header.
        delimiter: as it is read.
        skip_lines: as they are read.
    """
    lines = [line.decode("utf-8", "replace") for line in raw[: 1 << 16].splitlines()[:_FIRST_LINES]]
    cells = [max(map(line.count, _DELIMITERS)) * (sought in line) for line in lines]
    if not any(cells):
        return ""
    first = cells.index(max(cells))
    mark = max(_DELIMITERS, key=lines[first].count)
    said = [f"delimiter={mark!r}"] if mark != delimiter else []
    said += [f"skip_lines={first}"] if first != skip_lines else []
    found = f"Line {first + 1} looks like the header: {lines[first][:80]}"
    return f"{found}\nSay {', '.join(said)}" if said else ""


def _must_be_numbers(names: list[str]) -> list[str]:
    return [name for name in names if name in ("t", "segment") or stem_of(name) in CHANNELS]


def _numbers(file: Path, table: Any, clock: str = "t") -> dict[str, Floats]:
    import pyarrow as pa

    columns: dict[str, Floats] = {}
    first: dict[str, int] = {}
    for place, name in enumerate(table.column_names):  # a list of all names, made anew each time
        first.setdefault(name, place)
    for name, place in first.items():
        column = table.column(place)
        kind = column.type
        if pa.types.is_temporal(kind) and name == clock:
            columns[name] = _seconds(column)
            continue
        # a column without a single value has the type null: no sample at all
        if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)):
            _refuse_text(file, name, kind)
            continue
        columns[name] = _floats(column.cast(pa.float64()))
    return columns


def _seconds(column: Any) -> Floats:
    """Return dates as seconds since 1970-01-01."""
    import pyarrow as pa

    whole = column.cast(pa.timestamp("us"), safe=False).cast(pa.int64())
    return _floats(whole.cast(pa.float64(), safe=False)) * 1e-6


def _floats(column: Any) -> Floats:
    """Return a column of doubles, a missing one as NaN."""
    if not len(column):
        return np.empty(0)
    import pyarrow as pa

    # to_numpy and a scalar made of a number would import pandas
    missing = pa.Array.from_buffers(pa.float64(), 1, [None, pa.py_buffer(np.array([np.nan]))])[0]
    whole = column.fill_null(missing).combine_chunks()
    found: Floats = np.frombuffer(whole.buffers()[1], float, len(whole), 8 * whole.offset).copy()
    return found


def _refuse_text(file: Path, name: str, kind: object) -> None:
    if _must_be_numbers([name]):
        raise LogError(f"'{file}': column '{name}' must hold numbers, it holds {kind}.")


def _check_size(file: Path, rows: int, width: int) -> None:
    """Refuse a table above the bound; print the expected memory and time of a large one."""
    if rows * max(width, 1) > MOST_VALUES:
        raise LogError(
            f"'{file}' declares {rows:,} rows of {width} columns, allowed are {MOST_VALUES:,} "
            "values.\nSplit the log first."
        )
    if rows * width > _LARGE:
        print(
            f"'{file}': {rows:,} rows of {width} columns, {rows * width * 8e-6:.0f} MB of memory; "
            f"reading and checking them takes about {rows * width * _PACE:.0f} s.",
            file=sys.stderr,
            flush=True,
        )


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:240]
