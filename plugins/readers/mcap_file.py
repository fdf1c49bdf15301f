"""Parser of MCAP files, with bounds on sizes and counts: messages in the order of the file."""

from __future__ import annotations

import contextlib
import dataclasses
import struct
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from seals.errors import LogError, optional_import
from seals.plugins.readers.ros_streams import Message
from seals.untrusted_io import regular_file

MAGIC = b"\x89MCAP0\r\n"
MOST_BYTES = 1 << 34
"""Largest recording [byte]; it is read piece by piece."""
_MOST_RECORD = 1 << 26
_MOST_UNPACKED, _RATIO, _FREE = 1 << 32, 200, 1 << 23
"""Most bytes that chunks unpack to: in all, for each byte of the file, and for a small file. They
are read record by record: a few kilobytes of nothing would take an hour."""


def messages(
    path: Path, wants: Callable[[str, str, str], bool], present: dict[str, str]
) -> Iterator[Message]:
    """Yield the wanted messages of an MCAP file.

    Args:
        path: the file.
        wants: whether a topic counts, of its name, type and encoding.
        present: receives every topic met and its type.

    Raises:
        LogError: it is not an MCAP file, is damaged, or decompresses to more than it may.
        MissingExtra: the package for MCAP is absent.
    """
    file = regular_file(path, most=MOST_BYTES)
    with file.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise LogError(f"'{file}' is not an MCAP file: it lacks the file signature.")
        stream.seek(0)
        with _damage(file):
            yield from _wanted(_records(_Bounded(stream, file), file), wants, present)


class _Bounded:
    """Stream that refuses a read beyond the end of the file before it allocates memory."""

    def __init__(self, stream: BinaryIO, file: Path) -> None:
        self._stream, self._left = stream, file.stat().st_size

    def read(self, size: int) -> bytes:
        """Return that many bytes."""
        if size > self._left:
            raise ValueError(f"a record declares {size:,} bytes, {self._left:,} are left")
        self._left -= size
        return self._stream.read(size)


@contextlib.contextmanager
def _damage(file: Path) -> Iterator[None]:
    with optional_import("MCAP files need mcap", "Install it: pip install 'aam-seals[logs]'"):
        from mcap.exceptions import McapError
    try:
        yield
    except (
        McapError,
        struct.error,
        UnicodeDecodeError,
        EOFError,
        ValueError,
        OverflowError,
    ) as error:
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise LogError(
            f"'{file}' is not a valid MCAP file ({reason}).\nRepair it: mcap recover FILE"
        ) from error


def _wanted(
    records: Iterator[Any], wants: Callable[[str, str, str], bool], present: dict[str, str]
) -> Iterator[Message]:
    from mcap.records import Channel, Schema
    from mcap.records import Message as Record

    kinds: dict[int, str] = {}
    channels: dict[int, tuple[str, str, str]] = {}
    for record in records:
        if isinstance(record, Schema):
            kinds[record.id] = record.name
        elif isinstance(record, Channel):
            topic = (record.topic, kinds.get(record.schema_id, ""), record.message_encoding)
            channels[record.id] = topic
            present[record.topic] = topic[1] or record.message_encoding
        elif isinstance(record, Record):
            if record.channel_id not in channels:
                raise ValueError(f"a message of channel {record.channel_id}, which is not declared")
            name, kind, encoding = channels[record.channel_id]
            if wants(name, kind, encoding):
                yield Message(name, kind, encoding, record.log_time, record.data)


def most_unpacked(size: int) -> int:
    """Return how many bytes the chunks of a recording of so many bytes may unpack to."""
    return min(_MOST_UNPACKED, _FREE + _RATIO * size)


def _records(stream: Any, file: Path) -> Iterator[Any]:
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    total, most = 0, most_unpacked(file.stat().st_size)
    for record in StreamReader(stream, emit_chunks=True, record_size_limit=_MOST_RECORD).records:
        if not isinstance(record, Chunk):
            yield record
            continue
        size, packing = int(record.uncompressed_size), record.compression
        data = unpacked(record.data, size, packing, {"zstd": _zstd, "lz4": unpacked_lz4})
        total += len(data)
        if total > most:
            raise LogError(
                f"'{file}' decompresses to more than {most:,} bytes, which is more than is "
                "allowed for "
                "a file of its size.\nCut it."
            )
        yield from breakup_chunk(dataclasses.replace(record, compression="", data=data))


def unpacked(
    raw: bytes, size: int, packing: str, unpackers: Mapping[str, Callable[[bytes, int], bytes]]
) -> bytes:
    """Return the content of a chunk, unpacked within a bound on its size.

    Args:
        raw: as it stands in the file.
        size: that the chunk declares [byte].
        packing: name of the compression; empty for none.
        unpackers: by that name; each returns up to one byte more than the given size.

    Raises:
        ValueError: it declares too much or another size, or is damaged.
    """
    if size > _MOST_RECORD:
        raise ValueError(f"a chunk declares {size:,} bytes; the limit is {_MOST_RECORD:,}")
    if packing and packing not in unpackers:
        raise ValueError(f"compression '{packing[:16]}' is not known")
    raw = unpackers[packing](raw, size) if packing else raw
    if len(raw) != size:
        raise ValueError(f"a chunk does not hold the {size:,} bytes that it declares")
    return raw


def _zstd(raw: bytes, size: int) -> bytes:
    import zstandard

    try:
        with zstandard.ZstdDecompressor(max_window_size=_MOST_RECORD).stream_reader(raw) as stream:
            return bytes(stream.read(size + 1))
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error


def unpacked_lz4(raw: bytes, size: int) -> bytes:
    """Return the content of a frame of LZ4, up to one byte more than the given size.

    Raises:
        MissingExtra: the package for it is absent.
        ValueError: it is damaged.
    """
    with optional_import("this recording needs lz4", "Install it: pip install 'aam-seals[logs]'"):
        from lz4.frame import LZ4FrameDecompressor

    try:
        return bytes(LZ4FrameDecompressor().decompress(raw, max_length=size + 1))
    except RuntimeError as error:
        raise ValueError(str(error)) from error
