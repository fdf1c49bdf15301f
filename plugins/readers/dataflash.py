"""Reader of DataFlash files (``.bin``), the logs that ArduPilot writes on board.

Sizes and counts are bounded. Layout:
https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html; each message is
0xA3 0x95, its type and a packed structure, which messages FMT (type 128) declare.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError, refuse_unlisted
from seals.logs.log import Log
from seals.logs.merge import Stream
from seals.plugins.readers.ardupilot import motor_pulses, reversed_motors
from seals.plugins.readers.ned import (
    enu,
    flu,
    flu_in_enu,
    from_first,
    in_body,
    orientation,
    quaternion_of,
)
from seals.plugins.readers.streams import ReaderTopics, vector
from seals.untrusted_io import read_bytes

HEAD = b"\xa3\x95"
_FMT, _FMT_SIZE = 128, 89
_TYPES: dict[str, tuple[str, float]] = {
    "a": ("<i2", 1.0), "b": ("<i1", 1.0), "B": ("<u1", 1.0), "h": ("<i2", 1.0), "H": ("<u2", 1.0),
    "i": ("<i4", 1.0), "I": ("<u4", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0), "g": ("<f2", 1.0),
    "n": ("S4", 0.0), "N": ("S16", 0.0), "Z": ("S64", 0.0), "M": ("<u1", 1.0),
    "c": ("<i2", 1e-2), "C": ("<u2", 1e-2), "e": ("<i4", 1e-2), "E": ("<u4", 1e-2),
    "L": ("<i4", 1e-7), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
}  # fmt: skip
"""Letter of a format -> type of NumPy, and what a number is multiplied by; 0 for text."""
_LIST = "a"
_LIST_LENGTH = 32
_MOST_MESSAGES = 20_000_000
_MOST_STRANGE = 0.1
"""Largest share of bytes that belong to no message."""


@dataclass(frozen=True, kw_only=True)
class Messages:
    """All messages of one name.

    Args:
        rows: structured array, one entry for each message.
        letters: field -> its letter in the declaration.
    """

    rows: NDArray[Any]
    letters: dict[str, str]

    def column(self, field: str) -> NDArray[Any]:
        """Return the numbers of a field in the unit that the declaration means, or its text."""
        kind, scale = _TYPES[self.letters[field]]
        values = self.rows[field]
        return values if kind.startswith("S") else values.astype(np.float64) * scale


def parse(raw: bytes, *, where: str) -> dict[str, Messages]:
    """Return the messages of a log by name.

    Bytes between messages, as after a loss of power, are passed over.

    Args:
        raw: content of the file.
        where: the file, for refusals.

    Raises:
        LogError: it is not a DataFlash log, or is damaged.
    """
    if raw[:2] != HEAD:
        raise LogError(f"'{where}' is not a DataFlash log: it lacks the file signature.")
    sizes: dict[int, int] = {_FMT: _FMT_SIZE}
    declared: dict[int, bytes] = {}
    places: dict[int, array[int]] = {}
    place, strange, end, count = 0, 0, len(raw), 0
    while place + 3 <= end and strange <= _MOST_STRANGE * end:
        size = sizes.get(raw[place + 2], 0) if raw[place : place + 2] == HEAD else 0
        if not size:
            after = raw.find(HEAD, place + 1)
            after = end if after < 0 else after
            strange += after - place
            place = after
            continue
        if place + size > end:
            break
        kind = raw[place + 2]
        if kind == _FMT:
            _declare(raw[place + 3 : place + size], sizes, declared, where)
        else:
            places.setdefault(kind, array("q")).append(place)
        place += size
        count += 1
        if count > _MOST_MESSAGES:
            raise LogError(f"'{where}' holds more than {_MOST_MESSAGES:,} messages.\nCut it.")
    if strange > _MOST_STRANGE * end:
        raise LogError(
            f"'{where}' is damaged: at least {strange:,} of {end:,} bytes belong to no message.\n"
            "Download it from the vehicle again."
        )
    content = np.frombuffer(raw, dtype=np.uint8)
    found: dict[str, Messages] = {}
    for kind, starts in places.items():
        name, layout = _layout(declared[kind])
        if layout and name not in found:
            packed = np.dtype([(field, f"({_LIST_LENGTH},)<i2" if letter == _LIST else
                                _TYPES[letter][0]) for field, letter in layout])  # fmt: skip
            # the structures that stand 3 bytes behind the given places
            rows = np.empty((len(starts), packed.itemsize), dtype=np.uint8)
            first = np.frombuffer(starts, dtype=np.int64) + 3
            for k in range(packed.itemsize):
                rows[:, k] = content[first + k]
            found[name] = Messages(rows=rows.view(packed)[:, 0], letters=dict(layout))
    return found


def _declare(body: bytes, sizes: dict[int, int], declared: dict[int, bytes], where: str) -> None:
    """Take a declaration; one that does not fit itself leaves its messages unread."""
    kind, size = body[0], body[1]
    if declared.setdefault(kind, body) != body:
        raise LogError(f"'{where}' declares the message {kind} twice, differently: damaged.")
    if kind != _FMT and size >= 3:
        sizes[kind] = size


def _layout(body: bytes) -> tuple[str, list[tuple[str, str]]]:
    """Return the name, and field and letter of each entry; none where they do not fit."""
    name, letters, labels = (
        part.split(b"\0", 1)[0].decode("latin-1") for part in (body[2:6], body[6:22], body[22:86])
    )
    fields = [label.strip() for label in labels.split(",")]
    fits = len(fields) == len(letters) == len(set(fields)) and set(letters) <= set(_TYPES)
    if not fits or 3 + sum(map(_width, letters)) != body[1] or not all(fields):
        return name, []
    return name, list(zip(fields, letters, strict=True))


def _width(letter: str) -> int:
    size = np.dtype(_TYPES[letter][0]).itemsize
    return size * _LIST_LENGTH if letter == _LIST else size


_INSTANCES = ("I", "C", "Instance", "Inst")
_RPM = 2.0 * np.pi / 60.0
_MILLIGAUSS = 1e-7
_FIX_3D = 3
_GOOD_RANGE = 4


@dataclass(kw_only=True)
class ReaderDataflash(ReaderTopics):
    """Logs of ArduPilot on board (``.bin``): known messages automatically, other fields by a map.

    Channels:
        ``IMU`` (else ``GYR``, ``ACC``, ``RATE``), ``ATT``, ``XKF1`` (else ``NKF1``, ``EKF1``),
        ``GPS``, ``BAT`` (else ``CURR``), ``RCOU``, ``ESC``, ``MAG``, ``RFND``; of ArduSub
        ``CTUN.BAlt`` as depth. Others by ``columns``.
    Units:
        deg, centidegrees, rpm, mGauss and microseconds become SI; body forward-right-down and world
        north-east-down become FLU and ENU. The velocity is turned into body axes with ``ATT``.
        ``motor_pwm`` stays in microseconds; motors are those of the parameters SERVOn_FUNCTION,
        reversed thrusters those of MOT_n_DIRECTION.
    Limitations:
        First instance of each sensor and first core of the filter; pose and velocity have the lag
        of the filter, the first position is that of its origin. Fields of a map have the factor of
        their declaration (c, C, e, E: 0.01, L: 1e-7), as in MAVExplorer. Text logs (``.log``) are
        not read.

    Args:
        topics: known messages to read; empty for all.
        columns: ``MESSAGE/FIELD`` (``BARO/Press``; ``BARO:1/Press`` for a second instance) ->
            column of the log.
    """

    kind: ClassVar[str] = "DataFlash"

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the file.

        Raises:
            LogError: nothing was given, or the file cannot be used.
        """
        given, chosen = self.given(source), self.chosen()
        where = str(given)
        found = parse(read_bytes(given), where=where)
        samples = dict(_instances(found))
        about = _Known(samples, _parameters(found), _vehicle(found))

        def streams(topic: str) -> list[Stream]:
            columns = _TOPICS[topic](topic, about)
            return [Stream(name=topic, stamps=_stamps(samples[topic]), columns=columns)]

        meta: dict[str, Any] = {"motor_command": "pwm"} if "RCOU" in samples else {}
        if turned := reversed_motors(about.parameters):
            meta["motor_reverse"] = turned
        if about.vehicle:
            meta["firmware"] = about.vehicle
        return [
            self.log_of(
                given,
                samples,
                chosen,
                field_of=lambda topic, name: _column(samples[topic], name, topic),
                stamps_of=lambda topic: _stamps(samples[topic]),
                known=dict.fromkeys(_TOPICS, streams),
                meta=meta,
            )
        ]


@dataclass(frozen=True)
class _Known:
    """What makers of channels look at."""

    samples: dict[str, Messages]
    parameters: dict[str, float]
    vehicle: str


def _instances(found: dict[str, Messages]) -> Iterator[tuple[str, Messages]]:
    """Yield messages by name; those of a second sensor under ``NAME:1``, the first one bare."""
    for name, messages in found.items():
        if _clock(messages) is None:
            continue
        own = next((k for k in _INSTANCES if messages.letters.get(k) == "B"), None)
        if own is None:
            yield name, messages
            continue
        numbers = np.unique(messages.rows[own])
        for number in numbers[:16]:
            part = messages.rows[messages.rows[own] == number]
            label = name if number == numbers[0] else f"{name}:{number}"
            yield label, Messages(rows=part, letters=messages.letters)


def _clock(messages: Messages) -> tuple[str, int] | None:
    """Return the field of the time since the start, and its microseconds."""
    if {"TimeMS", "Week", "T"} <= messages.letters.keys() and _counts(messages, "T"):
        # before 3.3 TimeMS of a GPS counted from the start of the week
        return "T", 1000
    clocks = (("TimeUS", 1), ("TimeMS", 1000))
    return next((clock for clock in clocks if _counts(messages, clock[0])), None)


def _counts(messages: Messages, name: str) -> bool:
    """Return whether a field is declared as a whole number."""
    return messages.rows.dtype[name].kind in "iu" if name in messages.letters else False


def _stamps(messages: Messages) -> NDArray[np.int64]:
    clock = _clock(messages)
    assert clock is not None, "messages without a time were left out"
    return messages.rows[clock[0]].astype(np.int64) * clock[1]


def _parameters(found: dict[str, Messages]) -> dict[str, float]:
    """Return the last value of each parameter."""
    messages = found.get("PARM")
    if messages is None or not {"Name", "Value"} <= messages.letters.keys():
        return {}
    if messages.letters["Name"] != "N" or messages.letters["Value"] in "nNZa":
        return {}
    names = [bytes(one).decode("latin-1") for one in messages.rows["Name"]]
    return dict(zip(names, messages.column("Value").tolist(), strict=True))


def _vehicle(found: dict[str, Messages]) -> str:
    """Return the firmware that the log names, such as ``ArduSub V4.1.0``."""
    messages = found.get("MSG")
    if messages is None or messages.letters.get("Message") != "Z":
        return ""
    for one in messages.rows["Message"][:200]:
        text = bytes(one).decode("latin-1")
        if re.match(r"(Ardu|APM:|Blimp|AntennaTracker)[\w: .()-]{1,60}$", text):
            return text
    return ""


def _column(messages: Messages, name: str, topic: str) -> Floats:
    refuse_unlisted(name, messages.letters, f"'{topic}' has no field '{name}'", error=LogError)
    values = messages.column(name)
    if values.dtype.kind != "f" or values.ndim != 1:
        raise LogError(f"'{topic}/{name}' contains text or lists; a number is needed.")
    return values


def _all(messages: Messages, topic: str, names: str) -> list[Floats]:
    return [_column(messages, name, topic) for name in names.split()]


def _vector(stem: str, names: str, scale: float = 1.0) -> Callable[..., dict[str, Floats]]:
    def make(topic: str, about: _Known) -> dict[str, Floats]:
        return vector(stem, scale * flu(*_all(about.samples[topic], topic, names)))

    return make


def _imu(topic: str, about: _Known) -> dict[str, Floats]:
    gyro = _vector("angular_velocity", "GyrX GyrY GyrZ")(topic, about)
    return gyro | _vector("specific_force", "AccX AccY AccZ")(topic, about)


def _attitude(topic: str, about: _Known) -> dict[str, Floats]:
    return orientation(_turned(about.samples[topic], topic))


def _turned(messages: Messages, topic: str) -> Floats:
    angles = (np.radians(values) for values in _all(messages, topic, "Roll Pitch Yaw"))
    return flu_in_enu(*quaternion_of(*angles))


def _filter(topic: str, about: _Known) -> dict[str, Floats]:
    messages = about.samples[topic]
    columns = vector("position", enu(*_all(messages, topic, "PN PE PD")))
    attitude = about.samples.get("ATT")
    if attitude is not None:
        world = enu(*_all(messages, topic, "VN VE VD"))
        turned = _turned(attitude, "ATT")
        columns |= vector("velocity", in_body(world, _stamps(messages), _stamps(attitude), turned))
    return columns


def _gps(topic: str, about: _Known) -> dict[str, Floats]:
    messages = about.samples[topic]
    fix = _column(messages, "Status", topic) >= _FIX_3D
    lat, lon, up = (np.where(fix, one, np.nan) for one in _all(messages, topic, "Lat Lng Alt"))
    columns = vector("gps_position", from_first(np.radians(lat), np.radians(lon), up))
    if {"Spd", "GCrs", "VZ"} <= messages.letters.keys():
        speed, course, down = _all(messages, topic, "Spd GCrs VZ")
        north, east = (speed * turn(np.radians(course)) for turn in (np.cos, np.sin))
        velocity = np.where(fix[:, None], enu(north, east, down), np.nan)
        columns |= vector("gps_velocity", velocity)
    return columns


def _battery(topic: str, about: _Known) -> dict[str, Floats]:
    messages = about.samples[topic]
    columns = {}
    for column, name, scale in (
        ("battery_voltage", "Volt", 1.0),
        ("battery_current", "Curr", 1.0),
        ("battery_charge", "RemPct", 1e-2),
    ):
        # before 3.3 they were whole numbers of hundredths
        if messages.letters.get(name, "h") in "fgB":
            columns[column] = scale * _column(messages, name, topic)
    return columns


def _outputs(topic: str, about: _Known) -> dict[str, Floats]:
    """Pulse widths of the motors [us]: by the parameters, else of all outputs in use."""
    messages = about.samples[topic]
    outputs = {
        int(match[1]): name
        for name in messages.letters
        if (match := re.fullmatch(r"C(?:h|han)?(\d{1,2})", name))
    }
    widths = {n: _column(messages, name, topic) for n, name in outputs.items()}
    return motor_pulses(widths, about.parameters)


def _speed(number: int) -> Callable[..., dict[str, Floats]]:
    def make(topic: str, about: _Known) -> dict[str, Floats]:
        return {f"rotor_speed_{number}": _RPM * _column(about.samples[topic], "RPM", topic)}

    return make


def _depth(topic: str, about: _Known) -> dict[str, Floats]:
    messages = about.samples[topic]
    under = "Sub" in about.vehicle and "BAlt" in messages.letters
    return {"depth": -_column(messages, "BAlt", topic)} if under else {}


def _range(topic: str, about: _Known) -> dict[str, Floats]:
    messages = about.samples[topic]
    name, state = ("Dist", "Stat") if "Dist" in messages.letters else ("Dist1", "Stat1")
    if state not in messages.letters:
        return {}
    good = _column(messages, state, topic) == _GOOD_RANGE
    return {"range": np.where(good, _column(messages, name, topic), np.nan)}


_TOPICS: dict[str, Callable[..., dict[str, Floats]]] = {
    "IMU": _imu,
    "GYR": _vector("angular_velocity", "GyrX GyrY GyrZ"),
    "ACC": _vector("specific_force", "AccX AccY AccZ"),
    "RATE": _vector("angular_velocity", "R P Y", np.pi / 180.0),
    "ATT": _attitude,
    "XKF1": _filter,
    "NKF1": _filter,
    "EKF1": _filter,
    "GPS": _gps,
    "BAT": _battery,
    "CURR": _battery,
    "RCOU": _outputs,
    "ESC": _speed(1),
    **{f"ESC:{k}": _speed(k + 1) for k in range(1, 12)},
    "MAG": _vector("magnetic_field", "MagX MagY MagZ", _MILLIGAUSS),
    "CTUN": _depth,
    "RFND": _range,
}
"""Known messages, the preferred one first where two give the same channel."""
