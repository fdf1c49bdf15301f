"""Parser of bags of ROS 1 (format 2.0), with bounds on sizes and counts: messages as they stand.

Layout: http://wiki.ros.org/Bags/Format/2.0. The index is not used, so bags that were never closed
are read as well.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from seals.errors import LogError, optional_import
from seals.plugins.readers.mcap_file import MOST_BYTES, most_unpacked, unpacked_lz4
from seals.plugins.readers.ros_streams import Message
from seals.untrusted_io import regular_file

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7
_MOST_HEADER = 1 << 16
_MOST_RECORD = 1 << 26
_MOST_CONNECTIONS = 4096
_ENCODING = "ros1"
Wants = Callable[[str, str, str], bool]


@dataclass(kw_only=True)
class _State:
    """Connections so far, and bytes unpacked."""

    wants: Wants
    present: dict[str, str]
    most: int
    topics: dict[int, tuple[str, str]] = field(default_factory=dict)
    unpacked: int = 0


def messages(path: Path, wants: Wants, present: dict[str, str]) -> Iterator[Message]:
    """Yield the wanted messages of a bag.

    A file that ends within a record, as after a loss of power, is read up to its last whole one.

    Args:
        path: the file.
        wants: whether a topic counts, of its name, type and encoding.
        present: receives every topic met and its type.

    Raises:
        LogError: it is no bag, is damaged, or unpacks to more than it may.
        MissingExtra: the package for chunks packed with lz4 is absent.
    """
    file = regular_file(path, most=MOST_BYTES)
    state = _State(wants=wants, present=present, most=most_unpacked(file.stat().st_size))
    with file.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise LogError(
                f"'{file}' is not a bag of ROS 1 (format 2.0): it lacks the file signature.\n"
                "An older bag: rosbag migrate; a rosbag2: reader=rosbag2"
            )
        try:
            for header, data in _records(stream, file.stat().st_size - len(MAGIC)):
                yield from _taken(header, data, state)
        except (ValueError, struct.error, OSError, EOFError) as error:
            reason = " ".join(str(error).split())[:160]
            raise LogError(
                f"'{file}' is not a valid bag ({reason}).\nRepair it: rosbag reindex, rosbag fix"
            ) from error


def _taken(header: dict[str, bytes], data: bytes, state: _State) -> Iterator[Message]:
    """Yield the wanted messages of one record, and of the records that a chunk packs."""
    if not header.get("op"):
        raise ValueError("a record does not state its type")
    kind = header["op"][0]
    if kind == _CHUNK:
        raw = _unpacked(header, data)
        state.unpacked += len(raw)
        if state.unpacked > state.most:
            raise ValueError(f"it unpacks to more than {state.most:,} bytes")
        for inner, part in _parts(raw):
            if inner.get("op") != bytes([_CHUNK]):
                yield from _taken(inner, part, state)
    elif kind == _BAG and header.get("encryptor"):
        raise ValueError("it is encrypted")
    elif kind == _CONNECTION:
        _connect(header, data, state)
    elif kind == _MESSAGE:
        topic = state.topics.get(_whole(header, "conn"))
        if topic is None:
            raise ValueError("a message of a connection that is not declared")
        if state.wants(*topic, _ENCODING):
            seconds, nanoseconds = struct.unpack("<II", header.get("time", b""))
            stamp = seconds * 1_000_000_000 + nanoseconds
            yield Message(*topic, _ENCODING, stamp, data)


def _connect(header: dict[str, bytes], data: bytes, state: _State) -> None:
    inner = _fields(data)
    topic = header.get("topic", b"").decode("utf-8", "replace")[:256]
    kind = inner.get("type", b"").decode("utf-8", "replace")[:256]
    # packages of ROS 2 have a part more
    kind = "/msg/".join(kind.split("/")) if kind.count("/") == 1 else kind
    state.topics[_whole(header, "conn")] = (topic, kind)
    state.present[topic] = kind
    if len(state.topics) > _MOST_CONNECTIONS:
        raise ValueError(f"more than {_MOST_CONNECTIONS:,} connections")


def _records(stream: BinaryIO, left: int) -> Iterator[tuple[dict[str, bytes], bytes]]:
    """Yield header and data of each record that is whole."""
    while left >= 8:
        parts = []
        for most in (_MOST_HEADER, _MOST_RECORD):
            raw = stream.read(4)
            size = struct.unpack("<I", raw)[0] if len(raw) == 4 else left
            left -= 4
            if size > left:
                return
            if size > most:
                raise ValueError(f"a record declares {size:,} bytes, allowed are {most:,}")
            parts.append(stream.read(size))
            left -= size
        yield _fields(parts[0]), parts[1]


def _parts(raw: bytes) -> Iterator[tuple[dict[str, bytes], bytes]]:
    """Yield header and data of each record in a chunk."""
    place = 0
    while place < len(raw):
        found = []
        for _ in range(2):
            (size,) = struct.unpack_from("<I", raw, place)
            if place + 4 + size > len(raw):
                raise ValueError("a record reaches beyond its chunk")
            found.append(raw[place + 4 : place + 4 + size])
            place += 4 + size
        yield _fields(found[0]), found[1]


def _fields(raw: bytes) -> dict[str, bytes]:
    """Return the entries ``name=value`` of a header."""
    found, place = {}, 0
    while place < len(raw):
        (size,) = struct.unpack_from("<I", raw, place)
        entry = raw[place + 4 : place + 4 + size]
        name, mark, value = entry.partition(b"=")
        if len(entry) < size or not mark:
            raise ValueError("a header has an entry without a name")
        found[name.decode("latin-1")] = value
        place += 4 + size
    return found


def _whole(header: dict[str, bytes], name: str) -> int:
    return int(struct.unpack("<I", header.get(name, b""))[0])


def _unpacked(header: dict[str, bytes], data: bytes) -> bytes:
    """Return the content of a chunk, unpacked within a bound on its size."""
    size, packing = _whole(header, "size"), header.get("compression", b"none")
    if size > _MOST_RECORD:
        raise ValueError(f"a chunk declares {size:,} bytes, allowed are {_MOST_RECORD:,}")
    if packing == b"bz2":
        data = bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
    elif packing == b"lz4":
        with optional_import("this bag needs lz4", "Install it: pip install 'aam-seals[logs]'"):
            data = unpacked_lz4(data, size)
    elif packing != b"none":
        raise ValueError(f"compression '{packing[:16].decode('latin-1')}' is not known")
    if len(data) != size:
        raise ValueError(f"a chunk holds other than the {size:,} bytes that it declares")
    return data
