"""Numeric columns of Parquet and CSV files; malformed files raise a `LogError`.

The page sizes that a Parquet file declares are checked before anything is unpacked.
"""

from __future__ import annotations

import io
import os
import re
import struct
import sys
from collections.abc import Collection
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.channels import CHANNELS, stem_of
from seals.untrusted_io import read_bytes, regular_file

MOST_FOOTER_BYTES = 1 << 22
"""Largest description at the end of a Parquet file that is read [byte]."""
MOST_PAGES = 200_000
"""Largest number of pages of a file."""
_HEADER_BYTES = 1 << 14
_SLACK = 1 << 20
_WIDEST = 16
"""Bytes that one number takes at most, levels and the entry of a dictionary counted [byte]."""
MOST_ENTRIES = 50_000
"""Longest list in the description of a file: room for it is made before its entries are read."""
_MOST_FIELDS = 2_000
_DEEPEST = 8
_COUNTED = {0: 5, 2: 7, 3: 8}
"""Field of a page's header that holds its count of values, by the kind of the page."""
_FIXED = {1: 0, 2: 0, 3: 1, 7: 8}
_WHOLE, _INTEGERS, _TEXT, _LISTS, _STRUCT = 5, (4, 5, 6), 8, (9, 10), 12


def _refuse_large_footer(file: Path) -> None:
    """Refuse a file with a large footer, which would be expanded in memory.

    Raises:
        LogError: it is larger than the file, or than allowed.
    """
    with file.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        stream.seek(max(size - 8, 0))
        tail = stream.read(8)
    declared = struct.unpack("<I", tail[:4])[0] if len(tail) == 8 else 0
    if tail[4:] in (b"PAR1", b"PARE") and declared > min(MOST_FOOTER_BYTES, size):
        raise LogError(
            f"'{file}' declares a description of {declared:,} bytes, it has {size:,} and allowed "
            f"are {MOST_FOOTER_BYTES:,}.\nWrite it again with fewer row groups."
        )


def _refuse_bombs(file: Path, metadata: Any, column: int) -> None:
    """Refuse a numeric column whose pages unpack to more bytes than its values need.

    A few kilobytes may declare, and hold, gigabytes. What the footer says of the size of the pages
    is not believed: the header of each page is read.

    Raises:
        LogError: the sizes do not fit, or a header cannot be read.
    """
    pages = 0
    with file.open("rb") as stream:
        for number in range(metadata.num_row_groups):
            group = metadata.row_group(number)
            chunk = group.column(column)
            if chunk.num_values != group.num_rows:
                raise _unsound(file, f"{chunk.num_values:,} values in {group.num_rows:,} rows")
            pages += _walk(stream, file, chunk, MOST_PAGES - pages)


def _walk(stream: BinaryIO, file: Path, chunk: Any, most: int) -> int:
    """Check the pages of a column chunk and return their number."""
    starts = [chunk.data_page_offset]
    if chunk.has_dictionary_page and chunk.dictionary_page_offset:
        starts.append(chunk.dictionary_page_offset)
    place, held, values, count = min(starts), 0, 0, 0
    end = place + chunk.total_compressed_size
    while place < end and values < chunk.num_values:
        if count >= most or place < 0:
            raise _unsound(file, f"more than {MOST_PAGES:,} pages")
        stream.seek(place)
        try:
            header, length = read_struct(stream.read(_HEADER_BYTES))
            unpacked, packed = int(header[2]), int(header[3])
            counted = _COUNTED.get(int(header[1]))
            more = int(header[counted][1]) if counted else 0
        except (IndexError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise _unsound(file, "a page without a valid header") from error
        held, count = held + unpacked, count + 1
        if min(unpacked, packed, more) < 0 or held > _WIDEST * chunk.num_values + _SLACK:
            raise _unsound(
                file,
                f"{chunk.num_values:,} numbers that decompress to {max(held, unpacked):,} bytes",
            )
        if more > chunk.num_values:
            raise _unsound(file, f"{more:,} values in a page of {chunk.num_values:,}")
        # the entries of a dictionary are no values of the column
        values += 0 if counted == _COUNTED[2] else more
        place += length + packed
    return count


def _unsound(file: Path, what: str) -> LogError:
    return LogError(
        f"'{file}' is not a valid Parquet file: it declares {what}.\nWas it copied completely?"
    )


def read_struct(raw: bytes) -> tuple[dict[int, Any], int]:
    """Return the fields of a struct in Thrift's compact protocol, and the bytes that it takes.

    Whole numbers of 32 bits are read; all else is stepped over and stands as None.

    Raises:
        IndexError: it is cut short.
        ValueError: it is nested too deep, has too many fields or one twice, or a number is too
            large: readers differ in what they make of these.
    """
    return _struct(raw, 0, 0)


def _struct(raw: bytes, place: int, depth: int) -> tuple[dict[int, Any], int]:
    found: dict[int, Any] = {}
    number = 0
    for _ in range(_MOST_FIELDS):
        sign, place = raw[place], place + 1
        if sign == 0:
            return found, place
        if sign >> 4:
            number += sign >> 4
        else:
            number, place = _zigzag(raw, place)
        if number in found:
            raise ValueError("a field twice")
        found[number], place = _value(raw, place, sign & 15, depth)
    raise ValueError("too many fields")


def _value(raw: bytes, place: int, kind: int, depth: int) -> tuple[Any, int]:
    if depth > _DEEPEST:
        raise ValueError("nested too deep")
    if kind in _FIXED:
        return None, place + _FIXED[kind]
    if kind in _INTEGERS:
        value, place = _zigzag(raw, place)
        if kind == _WHOLE and not -(1 << 31) <= value < 1 << 31:
            raise ValueError("a number of more than 32 bits")
        return (value if kind == _WHOLE else None), place
    if kind == _TEXT:
        length, place = _varint(raw, place)
        return None, place + length
    if kind in _LISTS:
        size, place = raw[place], place + 1
        count, inner = size >> 4, size & 15
        if count == 15:
            count, place = _varint(raw, place)
        if count > _MOST_FIELDS:
            raise ValueError("too many entries")
        for _ in range(count):
            _, place = _value(raw, place, 3 if inner in (1, 2) else inner, depth + 1)
        return None, place
    if kind == _STRUCT:
        return _struct(raw, place, depth + 1)
    raise ValueError(f"unknown kind {kind}")


def _varint(raw: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while shift < 64:
        byte, place = raw[place], place + 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, place
        shift += 7
    raise ValueError("a number without end")


def _zigzag(raw: bytes, place: int) -> tuple[int, int]:
    value, place = _varint(raw, place)
    return (value >> 1) ^ -(value & 1), place


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
        LogError: the file is damaged or too large, or a known channel does not contain numbers.
    """
    import pyarrow as pa
    from pyarrow import parquet

    file = regular_file(path)
    _refuse_large_footer(file)
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
            _refuse_bombs(file, content.metadata, place)
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
            raise LogError(f"'{path}' has only one column, '{names[0][:80]}'.\n{layout}")
    elif missing := [name for name in wanted if name not in names]:
        there = _layout_hint(raw, missing[0], delimiter, skip_lines)
        there = there or suggestion(missing[0], names, label="Columns there")
        raise LogError(f"'{path}' has no column '{missing[0]}'.\n{there}")
    forced = _must_be_numbers(names) if wanted is None else list(wanted)
    picked = None if wanted is None else forced
    kinds = {name: pa.float64() for name in forced}
    if clock in kinds:
        place = names.index(clock)
        lines = raw[: 1 << 20].split(b"\n", skip_lines + 2)
        cells = (
            lines[skip_lines + 1].split(delimiter.encode()) if len(lines) > skip_lines + 1 else []
        )
        found = _DATE.fullmatch(cells[place].strip(b'" \r')) if place < len(cells) else None
        kinds[clock] = (
            pa.timestamp("ns", "UTC" if found["zone"] else None) if found else pa.float64()
        )
    try:
        from pyarrow import csv

        # the header is parsed above: blanks around names and a byte-order mark are common
        reading = csv.ReadOptions(skip_rows=skip_lines + 1, column_names=names, use_threads=False)
        converting = csv.ConvertOptions(column_types=dict(kinds), include_columns=picked)
        parsing = csv.ParseOptions(delimiter=delimiter)
        table = csv.read_csv(
            io.BytesIO(raw), read_options=reading, parse_options=parsing, convert_options=converting
        )
    except (pa.ArrowException, ValueError) as error:
        raise LogError(
            f"'{path}' cannot be read as a table of numbers: {_short(error)}\n"
            "Numbers need a decimal point; a missing sample is an empty field or nan."
        ) from error
    return _numbers(Path(path), table, clock)


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
        f"'{file}' has {width:,} columns; the limit is {MOST_COLUMNS:,}.\nSplit the log first."
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
    return f"{found}\nUse {', '.join(said)}" if said else ""


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
            # seconds since 1970-01-01
            whole = column.cast(pa.timestamp("us"), safe=False).cast(pa.int64())
            columns[name] = _floats(whole.cast(pa.float64(), safe=False)) * 1e-6
            continue
        # a column without a single value has the type null: no sample at all
        if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)):
            _refuse_text(file, name, kind)
            continue
        columns[name] = _floats(column.cast(pa.float64()))
    return columns


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
            f"'{file}' declares {rows:,} rows of {width} columns; the limit is {MOST_VALUES:,} "
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
