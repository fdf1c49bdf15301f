"""Conversion of recorded messages to sample streams: topics, fields, clock.

Messages of ROS and JSON are decoded by their type where that is known, others by a path.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from seals.errors import LogError, optional_import, refuse_unlisted
from seals.logs.column_map import ColumnMap
from seals.logs.merge import Stream
from seals.plugins.readers.streams import refuse_unknown
from seals.untrusted_io import plain_json

_PART = re.compile(r"^(?P<name>[A-Za-z]\w*)(?P<indices>(?:\[\d{1,5}\])*)$")
_MOST_JOINTS = 64


def _axes(stem: str, path: str, letters: str = "xyz") -> dict[str, str]:
    return {f"{stem}_{axis}": f"{path}.{axis}" for axis in letters}


KNOWN: dict[str, dict[str, str]] = {
    "nav_msgs/msg/Odometry": {
        **_axes("position", "pose.pose.position"),
        **_axes("orientation", "pose.pose.orientation", "wxyz"),
        **_axes("velocity", "twist.twist.linear"),
    },
    "geometry_msgs/msg/PoseStamped": {
        **_axes("position", "pose.position"),
        **_axes("orientation", "pose.orientation", "wxyz"),
    },
    "geometry_msgs/msg/PoseWithCovarianceStamped": {
        **_axes("position", "pose.pose.position"),
        **_axes("orientation", "pose.pose.orientation", "wxyz"),
    },
    "geometry_msgs/msg/TransformStamped": {
        **_axes("position", "transform.translation"),
        **_axes("orientation", "transform.rotation", "wxyz"),
    },
    "sensor_msgs/msg/Imu": {
        **_axes("angular_velocity", "angular_velocity"),
        **_axes("specific_force", "linear_acceleration"),
        **_axes("orientation", "orientation", "wxyz"),
    },
    "sensor_msgs/msg/JointState": {},
    "sensor_msgs/msg/BatteryState": {
        "battery_voltage": "voltage",
        "battery_current": "current",
        "battery_charge": "percentage",
    },
    "sensor_msgs/msg/MagneticField": _axes("magnetic_field", "magnetic_field"),
    "sensor_msgs/msg/Range": {"range": "range"},
}
"""Type -> column -> path in the message; where two types give a column, the first one does."""


def _decode(raw: bytes, kind: str, encoding: str, *, where: str) -> Any:
    """Decode a message to an object, or to plain data for JSON.

    Types are those that ROS ships. Definitions inside a recording are never used: the package
    that reads them would turn them into code and run it.

    Raises:
        LogError: it cannot be decoded.
        MissingExtra: the package for ROS messages is absent.
    """
    if encoding == "json":
        try:
            return plain_json(raw)
        except ValueError as error:
            raise LogError(f"{where}: a message is not JSON ({str(error)[:80]}).") from error
    store = _store(encoding)
    if store is None or kind not in store.types:
        raise LogError(
            f"{where}: messages of type '{kind}' ({encoding}) cannot be decoded.\n"
            "Allowed: JSON, cdr and ros1 of the types that ROS ships (sensor_msgs, nav_msgs ...)."
        )
    from rosbags.serde import SerdeError

    try:
        return (store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1)(raw, kind)
    except (SerdeError, ValueError, IndexError, TypeError, MemoryError, OverflowError) as error:
        reason = " ".join(str(error).split())[:120]
        raise LogError(f"{where}: a message of type '{kind}' is damaged ({reason}).") from error


@functools.cache
def _store(encoding: str) -> Any:
    """Return the types that ROS ships, by the encoding of their messages; None for others."""
    with optional_import("ROS messages need rosbags", "Install it: pip install 'aam-seals[logs]'"):
        from rosbags.typesys import Stores, get_typestore
    kinds = {"cdr": Stores.ROS2_HUMBLE, "ros1": Stores.ROS1_NOETIC}
    return get_typestore(kinds[encoding]) if encoding in kinds else None


def number(message: Any, path: str, *, where: str) -> float:
    """Return the number at a path such as ``pose.pose.position.x`` or ``data[2]``.

    Raises:
        LogError: there is nothing, or no number.

    Example:
        >>> number({"wheel": [{"speed": 2}]}, "wheel[0].speed", where="x")
        2.0
    """
    found = message
    for part in path.split("."):
        match = _PART.match(part)
        if match is None:
            raise LogError(f"{where}: '{path}' is not a path.\nWrite a.b[0].c")
        found = _member(found, match["name"], path, where)
        for index in re.findall(r"\d+", match["indices"]):
            found = _entry(found, int(index), path, where)
    try:
        value = float(found)
    except (TypeError, ValueError, OverflowError) as error:
        kind = type(found).__name__
        raise LogError(f"{where}: '{path}' holds a {kind}, a number is needed.") from error
    return value


def _member(found: Any, name: str, path: str, where: str) -> Any:
    if isinstance(found, Mapping):
        if name in found:
            return found[name]
        present = list(found)
    else:
        # only declared fields: any other attribute of the object is none of the file's business
        present = list(getattr(found, "__dataclass_fields__", ()))
        if name in present:
            return getattr(found, name)
    shown = ", ".join(str(one)[:32] for one in present[:12] if not str(one).isupper())
    raise LogError(f"{where}: there is no '{name}' in '{path}'.\nThere: {shown or '(nothing)'}")


def _entry(found: Any, index: int, path: str, where: str) -> Any:
    if isinstance(found, str | bytes) or not hasattr(found, "__getitem__"):
        raise LogError(f"{where}: '{path}' indexes a value that is not a list.")
    try:
        return found[index]
    except (IndexError, KeyError) as error:
        raise LogError(f"{where}: '{path}' has no entry {index} in some message.") from error


def channels(message: Any, kind: str, *, where: str) -> dict[str, float]:
    """Return the values of a message of a known type, by column of the log.

    Raises:
        LogError: a field is absent or holds no number.
    """
    if kind == "sensor_msgs/msg/JointState":
        return _joints(message, where)
    found = {column: number(message, path, where=where) for column, path in KNOWN[kind].items()}
    if kind == "sensor_msgs/msg/BatteryState":
        # there, a current out of the battery is negative
        found["battery_current"] = -found["battery_current"]
    unknown = kind == "sensor_msgs/msg/Imu" and (
        # the first covariance is -1 where a device has no orientation
        _first_covariance(message, where) == -1.0
    )
    if unknown or all(found.get(f"orientation_{axis}") == 0.0 for axis in "wxyz"):
        found |= {f"orientation_{axis}": math.nan for axis in "wxyz"}
    return found


def _first_covariance(message: Any, where: str) -> float:
    if isinstance(message, Mapping) and "orientation_covariance" not in message:
        return 0.0
    return number(message, "orientation_covariance[0]", where=where)


def _joints(message: Any, where: str) -> dict[str, float]:
    names = _member(message, "name", "name", where)
    if not hasattr(names, "__len__") or len(names) > _MOST_JOINTS:
        raise LogError(f"{where}: a message names more than {_MOST_JOINTS} joints.")
    found = {}
    for stem, path in (("joint_position", "position"), ("joint_velocity", "velocity")):
        values = _member(message, path, path, where)
        if hasattr(values, "__len__") and len(values) == len(names):
            for k in range(len(names)):
                found[f"{stem}_{k + 1}"] = number(message, f"{path}[{k}]", where=where)
    return found


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
        # whether the type has known channels and an encoding that can be read
        return (kind in KNOWN and encoding in ("cdr", "ros1", "json")) and (
            not self.topics or topic in self.topics
        )


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
    content = _decode(message.raw, kind, message.encoding, where=place)
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
