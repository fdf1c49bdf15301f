"""Conversion of recorded messages to sample streams: topics, fields, clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from seals.errors import LogError, refuse_unlisted
from seals.logs.column_map import ColumnMap
from seals.logs.merge import Stream
from seals.plugins.readers.ros_messages import KNOWN, channels, decodable, decode, number
from seals.plugins.readers.streams import refuse_unknown

CLOCKS = ("header", "record")
_MOST_MESSAGES = 5_000_000


class Message(NamedTuple):
    """One recorded message, not yet decoded; ``stamp`` is its recording time [ns]."""

    topic: str
    kind: str
    encoding: str
    stamp: int
    raw: bytes


@dataclass(kw_only=True)
class Choice:
    """Selection of topics and fields of a recording.

    Args:
        topics: known topics to read; empty for all.
        fields: topic -> field -> column of the log.
        map: what becomes of ``TOPIC/FIELD``.
        clock: ``header`` takes the stamp inside a message, ``record`` the time of recording.
    """

    topics: list[str]
    fields: dict[str, dict[str, str]]
    map: ColumnMap
    clock: str

    def __post_init__(self) -> None:
        refuse_unlisted(self.clock, CLOCKS, f"clock={self.clock!r} is not allowed", error=LogError)

    def wants(self, topic: str, kind: str, encoding: str) -> bool:
        """Return whether messages of a topic are to be decoded."""
        if topic in self.fields:
            return True
        return decodable(kind, encoding) and (not self.topics or topic in self.topics)


@dataclass(kw_only=True)
class _Gathered:
    """Samples of one topic so far."""

    kind: str
    stamps: list[int] = field(default_factory=list)
    known: list[dict[str, float]] = field(default_factory=list)
    chosen: list[list[float]] = field(default_factory=list)


def gather(
    messages: Iterable[Message], present: Mapping[str, str], choice: Choice, *, where: str
) -> list[Stream]:
    """Return the streams of the wanted topics.

    Args:
        messages: those of the wanted topics, in any order.
        present: all topics of the recording -> their types; complete once the messages are read.
        choice: what is wanted.
        where: the file, for refusals.

    Raises:
        LogError: a topic or field is absent, a message damaged, or two topics give one channel.
    """
    found: dict[str, _Gathered] = {}
    for count, message in enumerate(messages):
        if count >= _MOST_MESSAGES:
            raise LogError(f"'{where}' holds more than {_MOST_MESSAGES:,} messages.\nCut it.")
        _take(message, found, choice, where)
    refuse_unknown([*choice.topics, *choice.fields], present, where=where)
    if not found:
        shown = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(present.items())[:12])
        raise LogError(
            f"'{where}' holds no topic with a known type.\n"
            + (
                f"Map fields with columns. There: {shown}"
                if shown
                else "It holds no topic at all: take a complete copy."
            )
        )
    streams = [_chosen(topic, got, choice) for topic, got in found.items() if got.chosen]
    taken = {column for stream in streams for column in stream.columns}
    for kind in KNOWN:
        own = [_known(topic, got) for topic, got in found.items() if got.known and got.kind == kind]
        for stream in own:
            left = {name: v for name, v in stream.columns.items() if name not in taken}
            streams.append(replace(stream, columns=left))
        taken |= {column for stream in own for column in stream.columns}
    return streams


def _take(message: Message, found: dict[str, _Gathered], choice: Choice, where: str) -> None:
    topic, kind = message.topic, message.kind
    place = f"'{where}', topic '{topic}'"
    content = decode(message.raw, kind, message.encoding, where=place)
    got = found.setdefault(topic, _Gathered(kind=kind))
    if got.kind != kind:
        raise LogError(f"{place} has two types, '{got.kind}' and '{kind}'.\nRecord it again.")
    got.stamps.append(_stamp(content, message.stamp, choice.clock, place))
    if topic in choice.fields:
        fields = choice.fields[topic]
        got.chosen.append([number(content, path, where=place) for path in fields])
    if kind in KNOWN and (topic in choice.topics or not (choice.topics or topic in choice.fields)):
        got.known.append(channels(content, kind, where=place))


def _stamp(content: Any, recorded: int, clock: str, place: str) -> int:
    """Return the time stamp of a message [us]; without one, its recording time."""
    own = _header_stamp(content) if clock == "header" else None
    if own is None:
        return recorded // 1000
    if not all(isinstance(part, int) and 0 <= part < 1 << 40 for part in own):
        raise LogError(f"{place} has an impossible stamp, {own!r:.60}.\nTry clock=record")
    seconds, nanoseconds = own
    return (seconds * 1_000_000 + nanoseconds // 1000) or recorded // 1000


def _header_stamp(content: Any) -> tuple[Any, Any] | None:
    if isinstance(content, Mapping):
        header = content.get("header")
        stamp = header.get("stamp") if isinstance(header, Mapping) else None
        if not isinstance(stamp, Mapping):
            return None
        return stamp.get("sec"), stamp.get("nanosec", stamp.get("nsec", 0))
    if "header" not in getattr(content, "__dataclass_fields__", ()):
        return None
    return content.header.stamp.sec, content.header.stamp.nanosec


def _chosen(topic: str, got: _Gathered, choice: Choice) -> Stream:
    values = np.array(got.chosen, dtype=np.float64)
    columns = {}
    for k, (path, column) in enumerate(choice.fields[topic].items()):
        columns[column] = choice.map.converted(values[:, k], f"{topic}/{path}", column)
    return Stream(name=topic, stamps=np.array(got.stamps, dtype=np.int64), columns=columns)


def _known(topic: str, got: _Gathered) -> Stream:
    names = dict.fromkeys(name for sample in got.known for name in sample)
    columns = {name: np.array([sample.get(name, np.nan) for sample in got.known]) for name in names}
    held = {name: values for name, values in columns.items() if np.isfinite(values).any()}
    return Stream(name=topic, stamps=np.array(got.stamps, dtype=np.int64), columns=held)
