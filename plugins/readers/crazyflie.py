"""Reader of Crazyflie micro-SD logs (format versions 1 and 2), the published flights among them."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.field_roles import roles
from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.units import STANDARD_GRAVITY, to_si
from seals.plugins.readers.published import ReaderPublished
from seals.untrusted_io import read_bytes

_MAGIC = 0xBC
_MOST_EVENTS = 64
_MOST_VARIABLES = 64
_CHECKSUM_BYTES = 4
_STAMPS = {1: ("I", 1e-3), 2: ("Q", 1e-6)}
"""Format version -> type of the time stamp and its unit [s]."""


@dataclass(frozen=True, kw_only=True)
class _Event:
    name: str
    variables: tuple[str, ...]
    layout: struct.Struct

    def table(self, rows: list[tuple[float, ...]], unit: float) -> dict[str, Floats]:
        values = np.asarray(rows, dtype=np.float64)
        named = {name: values[:, k + 1] for k, name in enumerate(self.variables)}
        return {"t": values[:, 0] * unit, **named}


class _Cursor:
    """Read position in the bytes; reading past the end is refused."""

    def __init__(self, content: bytes, where: str) -> None:
        self.content, self.where, self.place = content, where, 0

    def number(self, code: str) -> int:
        layout = struct.Struct("<" + code)
        if self.place + layout.size > len(self.content):
            raise LogError(f"'{self.where}' is truncated inside its header.\nFetch it again.")
        (value,) = layout.unpack_from(self.content, self.place)
        self.place += layout.size
        return int(value)

    def text(self) -> str:
        end = self.content.find(b"\0", self.place, self.place + 256)
        if end < 0:
            raise LogError(
                f"'{self.where}': a name in the header is not terminated: this is "
                "not a Crazyflie log."
            )
        raw, self.place = self.content[self.place : end], end + 1
        if not raw or not raw.isascii():
            raise LogError(
                f"'{self.where}': a name in the header is not text: not a Crazyflie log."
            )
        return raw.decode("ascii")


def parse(
    content: bytes, *, where: str, allow_truncated: bool = False
) -> dict[str, dict[str, Floats]]:
    """Return the events of a log: name -> variable -> values, with ``t`` [s].

    Args:
        content: the bytes of the file.
        where: what to call the file in messages.
        allow_truncated: whether a file that was cut short is read up to the cut.

    Raises:
        LogError: it is not a Crazyflie log, is cut short, or its checksum is wrong.
    """
    cursor = _Cursor(content, where)
    if cursor.number("B") != _MAGIC:
        raise LogError(f"'{where}' is not a Crazyflie log: it does not begin with 0x{_MAGIC:X}.")
    version = cursor.number("H")
    if version not in _STAMPS:
        raise LogError(f"'{where}' has format version {version}.\nAllowed: 1, 2")
    count = cursor.number("H")
    if not 0 < count <= _MOST_EVENTS:
        raise LogError(f"'{cursor.where}' declares {count} events.\nAllowed: 1 to {_MOST_EVENTS}")
    events = dict(_event(cursor) for _ in range(count))
    # the writer closes the file with a CRC-32 of all that went before
    sound = struct.unpack("<I", content[-4:])[0] == zlib.crc32(content[:-_CHECKSUM_BYTES])
    if not sound and not allow_truncated:
        raise LogError(
            f"'{where}' is truncated or damaged: its checksum does not match.\n"
            "Download it again, or read the intact part with allow_truncated=true."
        )
    end = len(content) - _CHECKSUM_BYTES if sound else len(content)
    rows = _records(cursor, events, version=version, end=end, strict=sound)
    if not any(rows.values()):
        raise LogError(f"'{where}' holds no records.")
    return {
        event.name: event.table(rows[key], _STAMPS[version][1])
        for key, event in events.items()
        if rows[key]
    }


def _event(cursor: _Cursor) -> tuple[int, _Event]:
    key, name, count = cursor.number("H"), cursor.text(), cursor.number("H")
    if count > _MOST_VARIABLES:
        raise LogError(
            f"'{cursor.where}': event '{name}' declares {count} variables.\n"
            f"Allowed: up to {_MOST_VARIABLES}"
        )
    variables, codes = [], []
    for _ in range(count):
        text = cursor.text()
        # written as name(type), the type a code of Python's struct module
        if text[-3:-2] != "(" or text[-1] != ")" or text[-2] not in "bBhHiIlLqQefd":
            raise LogError(f"'{cursor.where}': the variable '{text}' has no known type.")
        variables.append(text[:-3])
        codes.append(text[-2])
    layout = struct.Struct("<" + "".join(codes))
    return key, _Event(name=name, variables=tuple(variables), layout=layout)


def _records(
    cursor: _Cursor, events: dict[int, _Event], *, version: int, end: int, strict: bool
) -> dict[int, list[tuple[float, ...]]]:
    rows: dict[int, list[tuple[float, ...]]] = {key: [] for key in events}
    stamp = struct.Struct("<H" + _STAMPS[version][0])
    place, content = cursor.place, cursor.content
    while place < end:
        if place + stamp.size > end:
            break
        key, time = stamp.unpack_from(content, place)
        event = events.get(key)
        if event is None or place + stamp.size + event.layout.size > end:
            break
        rows[key].append((time, *event.layout.unpack_from(content, place + stamp.size)))
        place += stamp.size + event.layout.size
    if strict and place != end:
        raise LogError(f"'{cursor.where}': byte {place} does not begin a known record.")
    return rows


DATASET = read_dataset("seals.plugins.readers", "crazyflie-sysid")
_FULL_PWM = 65535.0
_MOST_BYTES = 1 << 25
_COLUMNS = {
    **{f"acc.{axis}": (f"specific_force_{axis}", "g") for axis in "xyz"},
    **{f"gyro.{axis}": (f"angular_velocity_{axis}", "deg/s") for axis in "xyz"},
    **{f"motor.m{k}": (f"motor_pwm_{k}", "pwm") for k in (1, 2, 3, 4)},
    **{f"stateEstimate.{axis}": (f"position_{axis}", "m") for axis in "xyz"},
    **{f"stateEstimate.q{axis}": (f"orientation_{axis}", "1") for axis in "xyzw"},
    "pm.vbat": ("battery_voltage", "V"),
    "pm.vbatMV": ("battery_voltage", "mV"),
}


@roles(data="event allow_truncated")
@dataclass(kw_only=True)
class ReaderCrazyflie(ReaderPublished):
    """Flights of a 27 g quadrotor, recorded on board; one log for each file.

    Channels:
        ``specific_force_x/y/z``, ``angular_velocity_x/y/z``, ``motor_pwm_1..4``; where they were
        recorded, the estimates ``position_x/y/z`` and ``orientation_x/y/z/w`` of the filter on
        board, and ``battery_voltage``.
    Units:
        g -> m/s^2 with 9.80665, deg/s -> rad/s, 16-bit pulse width -> share of full.
    Source:
        https://github.com/arplaboratory/data-driven-system-identification, 3 flights of 47 to 62 s
        at about 1.01 kHz with rest, take-off, landing and crashes.
    Licence:
        MIT.
    Limitations:
        In the published ones no position, no attitude, no battery voltage: thrust at one pulse
        width falls as the battery empties, and nothing in the log tells. Rotor speeds are not
        measured.

    Args:
        path: a log file, a folder that holds the published ones, or the name of one of them.
        event: the event block to read; empty takes the one with the accelerometer, or the only one.
        allow_truncated: whether a file that was cut short is read up to the cut.
    """

    dataset: ClassVar[Dataset] = DATASET

    event: str = ""
    allow_truncated: bool = False

    def log_of(self, path: Path) -> Log:
        """Return one flight."""
        content = read_bytes(path, most=_MOST_BYTES)
        events = parse(content, where=str(path), allow_truncated=self.allow_truncated)
        found = [name for name in events if "acc.z" in events[name] or len(events) == 1]
        name = self.event or next(iter(found), "")
        if name not in events:
            what = f"event '{name}'" if name else "event with an accelerometer (acc.z)"
            listed = suggestion(name, events, label="reader.event= selects one of")
            raise LogError(f"'{path}' has no {what}.\n{listed}")
        time = events[name]["t"]
        rate = float(1.0 / np.median(np.diff(time))) if time.size > 1 else 0.0
        # standard deviations at rest with the motors off; in flight vibration adds to them
        force = {"sigma": 0.0011 * STANDARD_GRAVITY, "rate": rate, "unit": "m/s^2"}
        turn = {"sigma": 0.0021, "rate": rate, "unit": "rad/s"}
        columns = _columns(events[name])
        stated = {"specific_force": force, "angular_velocity": turn}
        channels = {key: value for key, value in stated.items() if f"{key}_z" in columns}
        meta = {"sensors": {"channels": channels}} if channels else {}
        return self.described(path.name, columns, of=path, meta=meta)


def _columns(event: dict[str, Floats]) -> dict[str, Floats]:
    columns = {"t": event["t"]}
    for theirs, values in event.items():
        ours, unit = _COLUMNS.get(theirs, (theirs.replace(".", "_"), ""))
        if unit == "pwm":
            columns[ours] = values / _FULL_PWM
        elif theirs != "t":
            columns[ours] = to_si(values, unit) if unit else values
    return columns
