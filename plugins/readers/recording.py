"""Readers of recorded messages: MCAP, rosbag2 (SQLite or MCAP) and bags of ROS 1 (format 2.0).

Sizes and counts are bounded. Layout of bags: http://wiki.ros.org/Bags/Format/2.0. Their index is
not used, so bags that were never closed are read as well.
"""

from __future__ import annotations

import bz2
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, BinaryIO, ClassVar

from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.log import Log
from seals.plugins.readers.mcap_file import MOST_BYTES, most_unpacked, unpacked, unpacked_lz4
from seals.plugins.readers.mcap_file import messages as mcap_messages
from seals.plugins.readers.ros_streams import Choice, Message, gather
from seals.plugins.readers.streams import ReaderTopics, by_topic, finished
from seals.untrusted_io import read_yaml, regular_file

Wants = Callable[[str, str, str], bool]
_MAGIC = b"SQLite format 3\0"
_STORAGES = (".db3", ".mcap")
_MOST_MESSAGE = 1 << 22
_MOST_FILES = 1000
# steps of SQLite's machine between two looks, and looks before a query is given up
_STEPS, _LOOKS = 1_000_000, 200
_TABLES = {
    "topics": {"id", "name", "type", "serialization_format"},
    "messages": {"topic_id", "timestamp", "data"},
}


def _storages(place: Path) -> list[Path]:
    """Return the files of a recording: those that its ``metadata.yaml`` names, or the one given.

    Raises:
        LogError: there is none, one lies elsewhere, or they are packed.
    """
    if not place.is_dir():
        if place.suffix not in _STORAGES:
            raise LogError(
                f"'{regular_file(place, most=MOST_BYTES)}' is not a rosbag2.\n"
                "Give its folder (with metadata.yaml), or a file .db3 or .mcap"
            )
        return [place]
    content = read_yaml(place / "metadata.yaml").get("rosbag2_bagfile_information")
    if not isinstance(content, dict):
        raise LogError(f"'{place / 'metadata.yaml'}' does not describe a rosbag2.")
    if str(content.get("compression_mode") or "none").lower() != "none":
        raise LogError(f"'{place}' is packed.\nDecompress it: ros2 bag convert")
    names = content.get("relative_file_paths")
    if not isinstance(names, list) or not names or len(names) > _MOST_FILES:
        raise LogError(f"'{place / 'metadata.yaml'}' names no files.")
    # early versions wrote paths from elsewhere: the last part is the file beside metadata.yaml
    files = [place / PurePath(str(name)).name for name in names]
    for file in files:
        if file.suffix not in _STORAGES or not file.resolve().is_relative_to(place.resolve()):
            raise LogError(
                f"'{place}': '{file.name}' is not a .db3 or .mcap file inside the folder."
            )
    return files


def _rosbag2_messages(place: Path, wants: Wants, present: dict[str, str]) -> Iterator[Message]:
    """Yield the wanted messages of a rosbag2.

    Args:
        place: folder, or one file of it.
        wants: whether a topic counts, of its name, type and encoding.
        present: receives every topic and its type.

    Raises:
        LogError: a file is absent, damaged, or larger than allowed.
    """
    for file in _storages(place):
        if file.suffix == ".mcap":
            yield from mcap_messages(file, wants, present)
        else:
            yield from _database(regular_file(file, most=MOST_BYTES), wants, present)


def _database(file: Path, wants: Wants, present: dict[str, str]) -> Iterator[Message]:
    with file.open("rb") as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise LogError(f"'{file}' is not a rosbag2 file: it lacks the file signature.")
    try:
        with closing(_opened(file)) as base:
            _check_tables(base, file)
            topics: dict[int, tuple[str, str, str]] = {}
            for number, *words in base.execute(
                "SELECT id, name, type, serialization_format FROM topics LIMIT 4096"
            ):
                if not isinstance(number, int) or not all(isinstance(one, str) for one in words):
                    raise LogError(f"'{file}' is damaged: its table of topics holds no names.")
                topics[number] = (words[0], words[1], words[2])
                present[words[0]] = words[1]
            for number in [number for number, topic in topics.items() if wants(*topic)]:
                topic = topics[number]
                query = (
                    "SELECT timestamp, length(data), CASE WHEN length(data) <= ? THEN data END "
                    "FROM messages WHERE topic_id = ?"
                )
                for stamp, size, data in base.execute(query, (_MOST_MESSAGE, number)):
                    if not isinstance(stamp, int) or not isinstance(data, bytes):
                        raise LogError(
                            f"'{file}': a message of '{topic[0]}' has {size} bytes or no stamp; "
                            f"the limit is {_MOST_MESSAGE:,} bytes."
                        )
                    yield Message(*topic, stamp, data)
    except (sqlite3.Error, UnicodeDecodeError, OverflowError) as error:
        raise LogError(
            f"'{file}' is not a valid rosbag2 file ({error}).\nCopy it again, or: ros2 bag reindex"
        ) from error


def _opened(file: Path) -> sqlite3.Connection:
    base = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
    base.text_factory = lambda raw: raw.decode("utf-8", errors="replace")
    looks = iter(range(_LOOKS))
    base.set_progress_handler(lambda: int(next(looks, None) is None), _STEPS)
    base.execute("PRAGMA trusted_schema = OFF")
    return base


def _check_tables(base: sqlite3.Connection, file: Path) -> None:
    """Refuse views and virtual tables in place of tables: a query of a view may never end."""
    kinds = dict(base.execute("SELECT name, type || ' ' || substr(sql, 1, 14) FROM sqlite_master"))
    for table, wanted in _TABLES.items():
        if not str(kinds.get(table, "")).upper().startswith("TABLE CREATE TABLE"):
            raise LogError(f"'{file}' holds no table '{table}': it is not a rosbag2.")
        columns: list[Any] = list(base.execute(f"PRAGMA table_xinfo({table})"))
        # the last number tells columns that are computed
        plain = {row[1] for row in columns if row[6] == 0}
        if not wanted <= plain:
            raise LogError(
                f"'{file}': the table '{table}' lacks {', '.join(sorted(wanted - plain))}."
            )


MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7
_MOST_HEADER = 1 << 16
_MOST_RECORD = 1 << 26
_MOST_CONNECTIONS = 4096
_MOST_EMPTY = 4096
_ENCODING = "ros1"


@dataclass(kw_only=True)
class _State:
    """Connections so far, and bytes unpacked."""

    wants: Wants
    present: dict[str, str]
    most: int
    topics: dict[int, tuple[str, str]] = field(default_factory=dict)
    unpacked: int = 0


def _rosbag1_messages(path: Path, wants: Wants, present: dict[str, str]) -> Iterator[Message]:
    """Yield the wanted messages of a bag.

    A file that ends within a record, as after a loss of power, is read up to its last whole one.

    Args:
        path: the file.
        wants: whether a topic counts, of its name, type and encoding.
        present: receives every topic met and its type.

    Raises:
        LogError: it is no bag, is damaged, or decompresses to more than it may.
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
        packing = header.get("compression", b"none").decode("latin-1")
        size, plain = _whole(header, "size"), packing == "none"
        raw = unpacked(data, size, "" if plain else packing, {"bz2": _bz2, "lz4": unpacked_lz4})
        state.unpacked += len(raw)
        if state.unpacked > state.most:
            raise ValueError(f"it decompresses to more than {state.most:,} bytes")
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


def _bz2(raw: bytes, size: int) -> bytes:
    return bz2.BZ2Decompressor().decompress(raw, max_length=size + 1)


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
    """Yield header and data of each record that is whole.

    Records of nothing are padding, as some recorders write before the index.
    """
    empty = 0
    while left >= 8:
        parts = []
        for most in (_MOST_HEADER, _MOST_RECORD):
            raw = stream.read(4)
            size = struct.unpack("<I", raw)[0] if len(raw) == 4 else left
            left -= 4
            if size > left:
                return
            if size > most:
                raise ValueError(f"a record declares {size:,} bytes; the limit is {most:,}")
            parts.append(stream.read(size))
            left -= size
        if empty < _MOST_EMPTY and not any(parts):
            empty += 1
            continue
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


Source = Callable[[Path, Callable[[str, str, str], bool], dict[str, str]], Iterator[Message]]
"""Yields the wanted messages of a path, and fills in which topics it has."""


@roles(data="clock")
@dataclass(kw_only=True)
class Recording(ReaderTopics):
    """Base of readers of recorded messages; subclasses interpret the messages.

    Args:
        topics: known topics to read; empty for all.
        columns: ``TOPIC/FIELD`` (``/tank/level/data``, ``/wheels/speed[2]``) -> column of the log.
        clock: ``header`` takes the stamp inside a message, ``record`` the time of recording.
    """

    source: ClassVar[Source]
    clock: str = "header"

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the recording.

        Raises:
            LogError: nothing was given, or the recording cannot be used.
            MissingExtra: the packages of the extra ``logs`` are absent.
        """
        path, chosen, present = self.given(source), self.chosen(), dict[str, str]()
        choice = Choice(topics=self.topics, fields=by_topic(chosen), map=chosen, clock=self.clock)
        streams = gather(
            type(self).source(path, choice.wants, present), present, choice, where=str(path)
        )
        return [finished(streams, path, meta=self.meta, name=self.name, licence=self.licence)]


@dataclass(kw_only=True)
class ReaderMcap(Recording):
    """Recordings in one MCAP file: ROS 2 messages and JSON topics.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped``, ``TransformStamped``,
        ``Imu``, ``JointState``, ``BatteryState``, ``MagneticField`` and ``Range``; others by
        ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 2 ships, and Protobuf, are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: the file.
    """

    source: ClassVar[Source] = staticmethod(mcap_messages)
    kind: ClassVar[str] = "MCAP"


@dataclass(kw_only=True)
class ReaderRosbag2(Recording):
    """Recordings of ROS 2: a folder with ``metadata.yaml``, or one file ``.db3`` or ``.mcap``.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped``, ``TransformStamped``,
        ``Imu``, ``JointState``, ``BatteryState``, ``MagneticField`` and ``Range``; others by
        ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 2 ships are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: folder or file.
    """

    source: ClassVar[Source] = staticmethod(_rosbag2_messages)
    kind: ClassVar[str] = "rosbag2"


@dataclass(kw_only=True)
class ReaderRosbag1(Recording):
    """Recordings of ROS 1 (``.bag``, format 2.0), packed or not.

    Channels:
        Of ``Odometry``, ``PoseStamped``, ``PoseWithCovarianceStamped``, ``TransformStamped``,
        ``Imu``, ``JointState``, ``BatteryState``, ``MagneticField`` and ``Range``; others by
        ``columns``.
    Units:
        SI, ENU and FLU, as ROS prescribes (REP 103); mapped fields as declared.
    Limitations:
        Messages of other types than ROS 1 ships (Noetic) are not decoded: definitions inside
        a recording are never turned into code. Poses count as those of the body origin.

    Args:
        path: the file.
    """

    source: ClassVar[Source] = staticmethod(_rosbag1_messages)
    kind: ClassVar[str] = "bag"
