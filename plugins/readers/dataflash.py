"""Reader of DataFlash files, the logs that ArduPilot writes on board."""

from __future__ import annotations

import re
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
from seals.plugins.readers.ardupilot import motor_pulses
from seals.plugins.readers.dataflash_file import Messages, parse
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
        ``motor_pwm`` stays in microseconds; motors are those of the parameters SERVOn_FUNCTION.
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
        raise LogError(f"'{topic}/{name}' holds text or lists; a number is needed.")
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


def _rate(topic: str, about: _Known) -> dict[str, Floats]:
    return _vector("angular_velocity", "R P Y", np.pi / 180.0)(topic, about)


_TOPICS: dict[str, Callable[..., dict[str, Floats]]] = {
    "IMU": _imu,
    "GYR": _vector("angular_velocity", "GyrX GyrY GyrZ"),
    "ACC": _vector("specific_force", "AccX AccY AccZ"),
    "RATE": _rate,
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
