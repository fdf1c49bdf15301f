"""Reader of ULog files, the flight logs of PX4; sizes and counts are bounded.

Layout: https://docs.px4.io/main/en/dev_log/ulog_file_format.html
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.logs.log import Log
from seals.logs.merge import Stream
from seals.plugins.readers.ned import enu, flu, flu_in_enu, in_body, orientation
from seals.plugins.readers.streams import ReaderTopics, vector
from seals.untrusted_io import read_bytes

MAGIC = b"ULog\x01\x12\x35"
_HEADER = 16
_TYPES = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4",
    "uint32_t": "<u4", "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8",
    "bool": "<u1", "char": "<u1",
}  # fmt: skip
_FIELD = re.compile(r"^(?P<type>\w{1,64})(?:\[(?P<size>\d{1,5})\])? (?P<name>\w{1,128})$")
_MOST_FIELDS = 4096
_DEEPEST = 8
_MOST_MESSAGES = 10_000_000
"""Messages of a log: hours of flight, and all that 256 MB of usual ones can be."""
_KNOWN = frozenset(b"ABCDFILMOPQRS")
Samples = NDArray[Any]
"""A structured array, one entry for each message, named by field."""


@dataclass(kw_only=True)
class _State:
    """Parser state: declarations so far, and the bytes of the selected topics."""

    formats: dict[str, str] = field(default_factory=dict)
    topics: dict[int, tuple[str, int]] = field(default_factory=dict)
    payload: dict[int, list[bytes]] = field(default_factory=dict)
    known: int = 0
    strange: int = 0

    def data(self, number: int, pieces: list[bytes], where: str) -> Samples:
        name, _ = self.topics[number]
        layout = _layout(self.formats, name, where=where)
        packed = np.dtype(layout)
        # padding at the end of a message is not written
        while layout and layout[-1][0].startswith("_padding"):
            layout.pop()
        least = np.dtype(layout)
        small, large = least.itemsize, packed.itemsize
        kept = [piece[:small] for piece in pieces if small <= len(piece) <= large]
        if least.names is None or "timestamp" not in least.names or not kept:
            return np.zeros(0, dtype=least)
        return np.frombuffer(b"".join(kept), dtype=least)


def _parse(raw: bytes, *, where: str) -> dict[tuple[str, int], Samples]:
    """Return the samples of each topic and instance.

    A file that ends within a message, as after a loss of power, is read up to its last whole one.

    Args:
        raw: content of the file.
        where: the file, for refusals.

    Raises:
        LogError: it is not a ULog, is damaged, or declares more than it may.
    """
    if raw[: len(MAGIC)] != MAGIC or len(raw) < _HEADER:
        raise LogError(f"'{where}' is not a ULog file: it lacks the file signature.")
    state = _State()
    start = _HEADER
    for stop in [*_appended(raw, where), len(raw)]:
        _messages(raw, start, stop, state, where)
        start = stop
    if state.strange > state.known // 10:
        raise LogError(
            f"'{where}' is damaged: {state.strange} of {state.strange + state.known} messages "
            "are of "
            "unknown type.\nCopy it from the card again."
        )
    found = {}
    for number, pieces in state.payload.items():
        samples = state.data(number, pieces, where)
        if samples.size:
            found[state.topics[number]] = samples
    return found


def _appended(raw: bytes, where: str) -> list[int]:
    """Return the offsets at which data were appended (after a crash of the autopilot), rising."""
    if raw[_HEADER + 2 : _HEADER + 3] != b"B" or len(raw) < _HEADER + 3 + 40:
        return []
    flags = raw[_HEADER + 11 : _HEADER + 19]
    if flags[0] & ~1 or any(flags[1:]):
        raise LogError(f"'{where}' is a ULog of a newer version (flags {flags.hex()}).")
    offsets = struct.unpack_from("<3Q", raw, _HEADER + 19)
    return sorted({place for place in offsets if _HEADER < place < len(raw)} if flags[0] else ())


def _messages(raw: bytes, start: int, stop: int, state: _State, where: str) -> None:
    place = start
    while place + 3 <= stop:
        size, kind = struct.unpack_from("<HB", raw, place)
        body = raw[place + 3 : min(place + 3 + size, stop)]
        place += 3 + size
        if len(body) < size:
            return
        if state.known + state.strange > _MOST_MESSAGES:
            raise LogError(f"'{where}' holds more than {_MOST_MESSAGES:,} messages.\nCut it.")
        if kind in _KNOWN:
            state.known += 1
        else:
            state.strange += 1
        if kind == ord("D") and size > 2:
            pieces = state.payload.get(body[0] | body[1] << 8)
            if pieces is not None:
                pieces.append(body[2:])
        elif kind == ord("F"):
            name, _, fields = _text(body, where).partition(":")
            state.formats[name] = fields
        elif kind == ord("A") and size > 3:
            number = struct.unpack_from("<H", body, 1)[0]
            topic = (_text(body[3:], where), body[0])
            if state.topics.setdefault(number, topic) != topic:
                raise LogError(f"'{where}' gives the number {number} to two topics: damaged.")
            state.payload.setdefault(number, [])


def _text(body: bytes, where: str) -> str:
    try:
        return body.decode("ascii")
    except UnicodeDecodeError as error:
        raise LogError(
            f"'{where}' is damaged: a name in it is not text ({error.reason})."
        ) from error


def _layout(
    formats: dict[str, str], name: str, *, where: str, prefix: str = "", depth: int = 0
) -> list[tuple[str, str]]:
    if name not in formats or depth > _DEEPEST:
        reason = "nested too deep" if name in formats else "not declared"
        raise LogError(f"'{where}' is damaged: the message '{name[:64]}' is {reason}.")
    layout: list[tuple[str, str]] = []
    for part in filter(None, formats[name].split(";")):
        match = _FIELD.match(part)
        if match is None:
            raise LogError(f"'{where}' is damaged: '{part[:64]}' declares no field of '{name}'.")
        size, label = match["size"], prefix + match["name"]
        labels = [label] if size is None else [f"{label}[{k}]" for k in range(int(size))]
        for one in labels:
            if match["type"] in _TYPES:
                layout.append((one, _TYPES[match["type"]]))
            else:
                inner = _layout(
                    formats, match["type"], where=where, prefix=f"{one}.", depth=depth + 1
                )
                if not inner:
                    # a huge array of nothing would be counted out for ever
                    raise LogError(f"'{where}' is damaged: '{match['type']}' declares no field.")
                layout += inner
            if len(layout) > _MOST_FIELDS:
                raise LogError(f"'{where}': '{name}' declares more than {_MOST_FIELDS} fields.")
    if len({label for label, _ in layout}) < len(layout):
        raise LogError(f"'{where}' is damaged: '{name}' declares a field twice.")
    return layout


_GAUSS = 1e-4
_NO_OFFSET = 0x7FFFFFFF
_RPM = 2.0 * np.pi / 60.0


@dataclass(kw_only=True)
class ReaderUlog(ReaderTopics):
    """Flight logs of PX4 (``.ulg``): known topics automatically, other fields by a map.

    Channels:
        ``sensor_combined`` (else ``vehicle_angular_velocity``, ``vehicle_acceleration``),
        ``vehicle_attitude``, ``vehicle_local_position``, ``battery_status``, ``actuator_motors``,
        ``actuator_outputs``, ``esc_status``, ``vehicle_magnetometer``; others by ``columns``.
    Units:
        Body forward-right-down and world north-east-down become FLU and ENU; gauss, rpm and
        microseconds become SI. The velocity is turned into body axes with the attitude of the log.
    Limitations:
        ``motor_pwm`` is the wanted share of thrust that ``actuator_motors`` holds; of firmware
        before 1.13 the pulse widths of ``actuator_outputs``. A robot's rotors make speeds of them.
        Pose and velocity are those of the autopilot's own filter, with its lag. The body origin is
        that of the autopilot's frame: state the centre of gravity in ``meta``.

    Args:
        topics: known topics to read; empty for all.
        columns: ``TOPIC/FIELD`` (``esc_status/esc[0].esc_rpm``; ``TOPIC:1/FIELD`` for a second
            instance) -> column of the log.
    """

    kind: ClassVar[str] = "ULog"

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
        """
        given, chosen = self.given(source), self.chosen()
        where = str(given)
        samples = {
            (topic if instance == 0 else f"{topic}:{instance}"): found
            for (topic, instance), found in _parse(read_bytes(given), where=where).items()
        }
        shares = {"motor_command": "thrust_share"} if "actuator_motors" in samples else {}
        return [
            self.log_of(
                given,
                samples,
                chosen,
                field_of=lambda topic, name: _column(samples[topic], name, topic),
                stamps_of=lambda topic: _stamps(samples[topic]),
                known={
                    topic: partial(make, all_samples=samples) for topic, make in _TOPICS.items()
                },
                meta=shares,
            )
        ]


def _stamps(samples: Samples) -> NDArray[np.int64]:
    return samples["timestamp"].astype(np.int64)


def _column(samples: Samples, name: str, topic: str) -> Floats:
    names = samples.dtype.names or ()
    refuse_unlisted(name, names, f"'{topic}' has no field '{name}'", error=LogError)
    return samples[name].astype(np.float64)


def _triple(samples: Samples, name: str, topic: str) -> Floats:
    """Return a body vector of three fields, from FRD to FLU."""
    return flu(*(_column(samples, f"{name}[{k}]", topic) for k in range(3)))


def _combined(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    stamps = _stamps(samples)
    gyro = _triple(samples, "gyro_rad", topic)
    streams = [Stream(name=topic, stamps=stamps, columns=vector("angular_velocity", gyro))]
    later = np.zeros(stamps.size, dtype=np.int64)
    there = np.ones(stamps.size, dtype=bool)
    if "accelerometer_timestamp_relative" in (samples.dtype.names or ()):
        later = samples["accelerometer_timestamp_relative"].astype(np.int64)
        there = later != _NO_OFFSET
    force = _triple(samples, "accelerometer_m_s2", topic)[there]
    columns = vector("specific_force", force)
    return [*streams, Stream(name=f"{topic} ", stamps=(stamps + later)[there], columns=columns)]


def _body(stem: str, name: str, scale: float = 1.0) -> Callable[..., list[Stream]]:
    def make(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
        samples = all_samples[topic]
        columns = vector(stem, scale * _triple(samples, name, topic))
        return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]

    return make


def _attitude(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    columns = orientation(_turned(samples, topic))
    return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]


def _turned(samples: Samples, topic: str) -> Floats:
    return flu_in_enu(*(_column(samples, f"q[{k}]", topic) for k in range(4)))


def _place(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    stamps = _stamps(samples)
    x, y, z, vx, vy, vz = (
        np.where(_valid(samples, flag), _column(samples, name, topic), np.nan)
        for name, flag in (
            ("x", "xy_valid"), ("y", "xy_valid"), ("z", "z_valid"),
            ("vx", "v_xy_valid"), ("vy", "v_xy_valid"), ("vz", "v_z_valid"),
        )
    )  # fmt: skip
    columns = vector("position", enu(x, y, z))
    attitude = all_samples.get("vehicle_attitude")
    if attitude is not None:
        q = _turned(attitude, "vehicle_attitude")
        columns |= vector("velocity", in_body(enu(vx, vy, vz), stamps, _stamps(attitude), q))
    return [Stream(name=topic, stamps=stamps, columns=columns)]


def _valid(samples: Samples, flag: str) -> Any:
    return samples[flag] != 0 if flag in (samples.dtype.names or ()) else True


def _battery(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    samples = all_samples[topic]
    columns = {}
    for column, name in (
        ("battery_voltage", "voltage_v"),
        ("battery_current", "current_a"),
        ("battery_charge", "remaining"),
    ):
        if name in (samples.dtype.names or ()):
            values = _column(samples, name, topic)
            # -1 stands for unknown
            columns[column] = np.where(values >= 0.0, values, np.nan)
    return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]


def _numbered(stem: str, pattern: str, scale: float = 1.0) -> Callable[..., list[Stream]]:
    def make(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
        samples = all_samples[topic]
        names = samples.dtype.names or ()
        there = [k for k in range(16) if pattern.format(k) in names]
        found = {k: scale * _column(samples, pattern.format(k), topic) for k in there}
        # slots that nothing is connected to hold zero or NaN throughout
        used = [k for k, values in found.items() if np.any(np.nan_to_num(values) != 0.0)]
        columns = {f"{stem}_{k + 1}": found[k] for k in used}
        return [Stream(name=topic, stamps=_stamps(samples), columns=columns)]

    return make


def _outputs(topic: str, all_samples: dict[str, Samples]) -> list[Stream]:
    """Pulse widths of the motors, unless newer firmware logs the motors' thrust fractions."""
    if "actuator_motors" in all_samples:
        return []
    return _numbered("motor_pwm", "output[{}]")(topic, all_samples)


_TOPICS: dict[str, Callable[..., list[Stream]]] = {
    "sensor_combined": _combined,
    "vehicle_angular_velocity": _body("angular_velocity", "xyz"),
    "vehicle_acceleration": _body("specific_force", "xyz"),
    "vehicle_attitude": _attitude,
    "vehicle_local_position": _place,
    "battery_status": _battery,
    "actuator_motors": _numbered("motor_pwm", "control[{}]"),
    "actuator_outputs": _outputs,
    "esc_status": _numbered("rotor_speed", "esc[{}].esc_rpm", _RPM),
    "vehicle_magnetometer": _body("magnetic_field", "magnetometer_ga", _GAUSS),
}
"""Known topics, the preferred one first where two give the same channel."""
