"""Check of the declared page sizes of a Parquet file before unpacking."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any, BinaryIO

from seals.errors import LogError

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


def refuse_large_footer(file: Path) -> None:
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


def refuse_bombs(file: Path, metadata: Any, column: int) -> None:
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
            raise _unsound(file, "a page without a sound header") from error
        held, count = held + unpacked, count + 1
        if min(unpacked, packed, more) < 0 or held > _WIDEST * chunk.num_values + _SLACK:
            raise _unsound(
                file, f"{chunk.num_values:,} numbers that unpack to {max(held, unpacked):,} bytes"
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
