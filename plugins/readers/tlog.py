"""Reader of telemetry logs (``.tlog``): MAVLink as a ground station received it.

Layout: https://mavlink.io/en/guide/serialization.html; before each packet stands its time of
arrival since 1970 in microseconds, eight bytes, the highest first. Fields of messages are those of
pymavlink.
"""

from __future__ import annotations

import functools
import re
import struct
from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import LogError, optional_import, refuse_unlisted, suggestion
from seals.field_roles import roles
from seals.logs.log import Log
from seals.logs.merge import Stream
from seals.logs.units import STANDARD_GRAVITY
from seals.plugins.readers.ardupilot import motor_pulses
from seals.plugins.readers.ned import (
    enu,
    flu,
    flu_in_enu,
    from_first,
    in_body,
    orientation,
    quaternion_of,
)
from seals.plugins.readers.ros_streams import CLOCKS
from seals.plugins.readers.streams import ReaderTopics, vector
from seals.untrusted_io import read_bytes

_STAMP = 8
_V1, _V2 = 0xFE, 0xFD
_HEADER = {_V1: 6, _V2: 10}
_SIGNED = 1
_SIGNATURE = 13
_STAMPS = (946_684_800_000_000, 4_102_444_800_000_000)
"""Times since 1970 from the year 2000 to 2100 [us]."""
_MOST_STRANGE = 0.5
"""Largest share of bytes that belong to no packet; links of radios lose some."""
_MOST_KINDS = 4096
_MOST_PACKETS = 8_000_000
_NEXT = re.compile(rb"\x00[\x03-\x0e].{6}[\xfd\xfe]", re.DOTALL)
"""A time of this century and the first byte of a packet."""


@dataclass(frozen=True, kw_only=True)
class Packets:
    """All packets of one message from one sender.

    Args:
        rows: structured array, one entry for each packet, named by field.
        arrived: time of arrival since 1970 [us], shape (packets,).
    """

    rows: NDArray[Any]
    arrived: NDArray[np.int64]


def _looks_like(raw: bytes) -> bool:
    """Return whether bytes begin with a time of this century and a packet."""
    if len(raw) < _STAMP + 3 or raw[_STAMP] not in _HEADER:
        return False
    stamp = int(struct.unpack_from(">Q", raw)[0])
    return _STAMPS[0] < stamp < _STAMPS[1]


def parse(raw: bytes, *, where: str) -> dict[tuple[int, int, str], Packets]:
    """Return the packets of a log by system, component and name of the message.

    Packets with a wrong checksum and of unknown messages are passed over.

    Args:
        raw: content of the file.
        where: the file, for refusals.

    Raises:
        LogError: it is not a telemetry log, or is damaged.
        MissingExtra: pymavlink, which knows the fields of messages, is absent.
    """
    if not _looks_like(raw):
        raise LogError(f"'{where}' is not a telemetry log: it lacks the file signature.")
    known = _definitions()
    places: dict[tuple[int, int, int, int, int], array[int]] = {}
    place, strange, end, count = 0, 0, len(raw), 0
    while place + _STAMP + 3 <= end:
        count += 1
        if count > _MOST_PACKETS:
            raise LogError(
                f"'{where}' holds more than {_MOST_PACKETS:,} packets and gaps.\nCut it."
            )
        begin = place + _STAMP
        header = _HEADER.get(raw[begin])
        if header is None or not _looks_like(raw[place : begin + 3]):
            size = 0
        else:
            signed = raw[begin] == _V2 and raw[begin + 2] & _SIGNED
            size = _STAMP + header + raw[begin + 1] + 2 + (_SIGNATURE if signed else 0)
        if not size or place + size > end:
            after = _NEXT.search(raw, place + 1)
            strange += (after.start() if after else end) - place
            place = after.start() if after else end
            continue
        start = place + _STAMP
        if raw[start] == _V1:
            key = (raw[start + 3], raw[start + 4], raw[start + 5], _V1, raw[start + 1])
        else:
            number = raw[start + 7] | raw[start + 8] << 8 | raw[start + 9] << 16
            key = (raw[start + 5], raw[start + 6], number, _V2, raw[start + 1])
        if key[2] in known and (key in places or len(places) < _MOST_KINDS):
            places.setdefault(key, array("q")).append(place)
        place += size
    if strange > _MOST_STRANGE * end or len(places) == _MOST_KINDS:
        raise LogError(
            f"'{where}' is damaged: {strange:,} of {end:,} bytes belong to no packet.\n"
            "Use the original file of the ground station."
        )
    return _joined(np.frombuffer(raw, dtype=np.uint8), places, known)


def _joined(
    content: NDArray[np.uint8],
    places: dict[tuple[int, int, int, int, int], array[int]],
    known: dict[int, _Definition],
) -> dict[tuple[int, int, str], Packets]:
    """Return packets of all lengths of a message together, in the order of their arrival."""
    parts: dict[tuple[int, int, str], list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]]] = {}
    for (system, component, number, version, length), starts in places.items():
        first = np.frombuffer(starts, dtype=np.int64)
        header = _HEADER[version]
        body = _taken(content, first + _STAMP + 1, header - 1 + length + 2)
        first = first[_sound(body, known[number].extra)]
        # zeros at the end of a payload are not sent; version 1 has no extensions
        packed = np.zeros((first.size, known[number].packed.itemsize), dtype=np.uint8)
        used = min(length, packed.shape[1])
        packed[:, :used] = _taken(content, first + _STAMP + header, used)
        rows = packed.view(known[number].packed)[:, 0]
        arrived = _taken(content, first, _STAMP).view(">i8")[:, 0].astype(np.int64)
        key = (system, component, known[number].name)
        parts.setdefault(key, []).append((first, rows, arrived))
    found = {}
    for key, pieces in parts.items():
        order = np.argsort(np.concatenate([first for first, _, _ in pieces]))
        rows = np.concatenate([rows for _, rows, _ in pieces])[order]
        arrived = np.concatenate([arrived for _, _, arrived in pieces])[order]
        if rows.size:
            found[key] = Packets(rows=rows, arrived=arrived)
    return found


def _taken(content: NDArray[np.uint8], first: NDArray[np.int64], size: int) -> NDArray[np.uint8]:
    """Return so many bytes from each place on, shape (places, size)."""
    out = np.empty((first.size, size), dtype=np.uint8)
    for k in range(size):
        out[:, k] = content[first + k]
    return out


def _sound(body: NDArray[np.uint8], extra: int) -> NDArray[np.bool_]:
    """Return which packets have the right checksum (CRC-16/MCRF4XX).

    Args:
        body: header without its first byte, payload and checksum, shape (packets, bytes).
        extra: byte of the message's definition, which is summed last.
    """
    crc = np.full(body.shape[0], 0xFFFF, dtype=np.uint16)
    last = np.full((body.shape[0], 1), extra, dtype=np.uint8)
    for column in np.concatenate([body[:, :-2], last], axis=1).T:
        low = column ^ (crc & 0xFF).astype(np.uint8)
        low = (low ^ (low << 4)).astype(np.uint16)
        crc = (crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)
    sent = body[:, -2].astype(np.uint16) | body[:, -1].astype(np.uint16) << 8
    matches: NDArray[np.bool_] = crc == sent
    return matches


@dataclass(frozen=True, kw_only=True)
class _Definition:
    """Name, byte of the checksum and layout of a message."""

    name: str
    extra: int
    packed: np.dtype[Any]


@functools.cache
def _definitions() -> dict[int, _Definition]:
    with optional_import(
        "telemetry logs need pymavlink", "Install it: pip install 'aam-seals[logs]'"
    ):
        from pymavlink.dialects.v20 import ardupilotmega
    found = {}
    for number, message in ardupilotmega.mavlink_map.items():
        # NumPy knows the letters of `struct`
        codes = iter(message.native_format.decode("ascii").lstrip("<"))
        layout = []
        for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
            code = next(codes)
            text = f"S{length}" if code == "c" else f"({length},)<{code}" if length else f"<{code}"
            layout.append((str(name), text))
        found[int(number)] = _Definition(
            name=str(message.msgname), extra=int(message.crc_extra), packed=np.dtype(layout)
        )
    return found


_NO_AUTOPILOT = 8
_ARDUPILOT = 3
_SUBMARINE = 12
_FIX_3D = 3
_DOWN = 25
_RPM = 2.0 * np.pi / 60.0
_CALENDAR = 946_684_800_000_000
"""Stamps above this are microseconds since 1970, others since the start of the vehicle."""
_WRAP = 1 << 32
_LATEST = 5_000_000
"""A stamp that falls back by more is that of a vehicle that began anew [us]."""
_PART = re.compile(r"(?P<name>\w+)(?:\[(?P<index>\d{1,3})\])?")


@roles(data="clock")
@dataclass(kw_only=True)
class ReaderTlog(ReaderTopics):
    """Telemetry logs (``.tlog``) of MAVLink vehicles: ArduPilot, PX4; other fields by a map.

    Channels:
        ``HIGHRES_IMU``, ``ATTITUDE_QUATERNION`` (else ``ATTITUDE``) with body rates, accelerometer
        of ``RAW_IMU`` (ArduPilot; else ``SCALED_IMU``, ``SCALED_IMU2``), ``LOCAL_POSITION_NED``
        (else ``GLOBAL_POSITION_INT``), ``GPS_RAW_INT``, ``BATTERY_STATUS`` (else ``SYS_STATUS``),
        ``SERVO_OUTPUT_RAW``, ``ESC_TELEMETRY``, ``DISTANCE_SENSOR`` downwards; of submarines the
        depth. Others by ``columns``.
    Units:
        Thousandths of g and of gauss, mrad/s, cm/s, mV, cA, rpm become SI; body
        forward-right-down and world north-east-down become FLU and ENU; ``motor_pwm`` stays in us.
        Stamps are those of the vehicle, where a message has one, on the clock of the ground
        station: as late as the fastest packet. Others have the time of their arrival.
    Limitations:
        A radio link carries a few samples a second, too few for a diagnosis of fast motion: take
        the log on board (``.bin``, ``.ulg``). Fields of a map are numbers as they were sent.

    Args:
        topics: known messages to read; empty for all.
        columns: ``MESSAGE/FIELD`` (``SCALED_PRESSURE2/press_abs``, ``BATTERY_STATUS/voltages[0]``)
            -> column of the log.
        clock: ``header`` takes the stamp of the vehicle, ``record`` the time of arrival.
        system: number of the vehicle; 0 for the only one.
    """

    kind: ClassVar[str] = "tlog"

    clock: str = "header"
    system: int = 0

    def __post_init__(self) -> None:
        refuse_unlisted(self.clock, CLOCKS, f"clock={self.clock!r} is not allowed", error=LogError)

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the log of one vehicle.

        Raises:
            LogError: nothing was given, the file cannot be used, or holds several vehicles.
            MissingExtra: pymavlink is absent.
        """
        given, chosen = self.given(source), self.chosen()
        where = str(given)
        about = _vehicle(parse(read_bytes(given), where=where), self.system, where)
        samples = about.samples
        stamps = _all_stamps(samples, own=self.clock == "header")

        def streams(topic: str) -> list[Stream]:
            columns = _TOPICS[topic](samples[topic].rows, about, stamps)
            return [Stream(name=topic, stamps=stamps[topic], columns=columns)]

        return [
            self.log_of(
                given,
                samples,
                chosen,
                field_of=lambda topic, name: _field(samples[topic].rows, name, topic),
                stamps_of=stamps.__getitem__,
                known=dict.fromkeys(_TOPICS, streams),
                meta={"motor_command": "pwm"} if "SERVO_OUTPUT_RAW" in samples else {},
            )
        ]


@dataclass(frozen=True, kw_only=True)
class _Vehicle:
    """Messages of one autopilot by name, and what it says it is."""

    samples: dict[str, Packets]
    kind: int
    autopilot: int
    parameters: dict[str, float]


def _vehicle(found: Mapping[tuple[int, int, str], Packets], system: int, where: str) -> _Vehicle:
    beats = {
        (sender, component): packets.rows[-1]
        for (sender, component, name), packets in found.items()
        if name == "HEARTBEAT" and packets.rows["autopilot"][-1] != _NO_AUTOPILOT
    }
    there = ", ".join(str(sender) for sender, _ in sorted(beats))
    mine = [one for one in sorted(beats) if system in (0, one[0])]
    if not mine:
        raise LogError(
            f"'{where}' holds no messages of {f'vehicle {system}' if system else 'an autopilot'}.\n"
            f"Vehicles there: {there or '(none)'}"
        )
    if len({sender for sender, _ in mine}) > 1:
        raise LogError(f"'{where}' holds vehicles {there}.\nChoose one: reader.system={mine[0][0]}")
    sender, component = mine[0]
    samples = {
        name: _in_order(_first_instance(packets))
        for (their_sender, their_component, name), packets in found.items()
        if (their_sender, their_component) == (sender, component)
    }
    values = samples.get("PARAM_VALUE")
    parameters = {}
    if values is not None:
        names = [bytes(one).decode("latin-1") for one in values.rows["param_id"]]
        parameters = dict(
            zip(names, values.rows["param_value"].astype(float).tolist(), strict=True)
        )
    return _Vehicle(
        samples=samples,
        kind=int(beats[mine[0]]["type"]),
        autopilot=int(beats[mine[0]]["autopilot"]),
        parameters=parameters,
    )


def _first_instance(packets: Packets) -> Packets:
    """Return the messages of the first battery, sensor or port."""
    for name in ("id", "port"):
        if name in (packets.rows.dtype.names or ()):
            kept = packets.rows[name] == packets.rows[name].min()
            return Packets(rows=packets.rows[kept], arrived=packets.arrived[kept])
    return packets


def _in_order(packets: Packets) -> Packets:
    """Return messages in the order of their own stamps; links deliver some late, after others."""
    own = _own(packets.rows)
    if own is None or np.diff(own).min(initial=0) < -_LATEST:
        return packets
    order = np.argsort(own, kind="stable")
    return Packets(rows=packets.rows[order], arrived=packets.arrived[order])


def _all_stamps(samples: Mapping[str, Packets], *, own: bool) -> dict[str, NDArray[np.int64]]:
    """Return stamps of all messages [us], on the clock of the ground station."""
    found = {name: packets.arrived for name, packets in samples.items()}
    stated = {name: _own(packets.rows) for name, packets in samples.items()} if own else {}
    clocked = {name: stamps for name, stamps in stated.items() if stamps is not None}
    for calendar in (False, True):
        mine = {name: own for name, own in clocked.items() if (own[0] > _CALENDAR) == calendar}
        if mine:
            delay = min(int((found[name] - own).min()) for name, own in mine.items())
            found |= {name: own + delay for name, own in mine.items()}
    return found


def _own(rows: NDArray[Any]) -> NDArray[np.int64] | None:
    """Return the stamps that a message states [us]; None if it states none."""
    names = rows.dtype.names or ()
    for name, micro in (("time_boot_ms", 1000), ("time_usec", 1)):
        if name in names:
            stamps = rows[name].astype(np.int64)
            # 32 bits of microseconds begin anew after 72 minutes
            wraps = np.cumsum(np.append(0, np.diff(stamps) < -_WRAP // 2))
            stamps = stamps + (_WRAP * wraps if rows[name].dtype.itemsize == 4 else 0)
            return np.asarray(stamps * micro) if np.all(rows[name] > 0) else None
    return None


def _field(rows: NDArray[Any], path: str, topic: str) -> Floats:
    match = _PART.fullmatch(path)
    names = rows.dtype.names or ()
    if match is None or match["name"] not in names:
        raise LogError(f"'{topic}' has no field '{path}'.\n" + suggestion(path, names))
    values = rows[match["name"]]
    if values.dtype.kind == "S":
        raise LogError(f"'{topic}/{path}' holds text; a number is needed.")
    if values.ndim == 2:
        index = int(match["index"] or values.shape[1])
        if index >= values.shape[1]:
            raise LogError(
                f"'{topic}/{path}': write {match['name']}[0] to [{values.shape[1] - 1}]."
            )
        values = values[:, index]
    return np.asarray(values, dtype=np.float64)


def _three(rows: NDArray[Any], names: str) -> tuple[Floats, ...]:
    return tuple(rows[name].astype(np.float64) for name in names.split())


def _imu(
    rate: float, force: float, field: float, *, only: int | None = None
) -> Callable[..., dict[str, Floats]]:
    """Return the maker for an inertial sensor, of the sizes of its units."""

    def make(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
        if only is not None and about.autopilot != only:
            return {}
        columns = vector("specific_force", force * flu(*_three(rows, "xacc yacc zacc")))
        columns |= vector("angular_velocity", rate * flu(*_three(rows, "xgyro ygyro zgyro")))
        magnetic = field * flu(*_three(rows, "xmag ymag zmag"))
        return columns | (vector("magnetic_field", magnetic) if magnetic.any() else {})

    return make


def _attitude(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
    rates = flu(*_three(rows, "rollspeed pitchspeed yawspeed"))
    return orientation(_turned(rows)) | vector("angular_velocity", rates)


def _turned(rows: NDArray[Any]) -> Floats:
    if "q1" in (rows.dtype.names or ()):
        return flu_in_enu(*_three(rows, "q1 q2 q3 q4"))
    return flu_in_enu(*quaternion_of(*_three(rows, "roll pitch yaw")))


def _velocity(
    topic: str, world: Floats, about: _Vehicle, stamps: Mapping[str, NDArray[np.int64]]
) -> dict[str, Floats]:
    for name in ("ATTITUDE_QUATERNION", "ATTITUDE"):
        if name in about.samples:
            q = _turned(about.samples[name].rows)
            return vector("velocity", in_body(world, stamps[topic], stamps[name], q))
    return {}


def _local(
    rows: NDArray[Any], about: _Vehicle, stamps: Mapping[str, NDArray[np.int64]]
) -> dict[str, Floats]:
    world = enu(*_three(rows, "vx vy vz"))
    place = vector("position", enu(*_three(rows, "x y z")))
    return place | _velocity("LOCAL_POSITION_NED", world, about, stamps)


def _global(
    rows: NDArray[Any], about: _Vehicle, stamps: Mapping[str, NDArray[np.int64]]
) -> dict[str, Floats]:
    lat, lon = (np.radians(1e-7 * values) for values in _three(rows, "lat lon"))
    (up,) = _three(rows, "relative_alt")
    known = (lat != 0.0) | (lon != 0.0)
    lat, lon = (np.where(known, values, np.nan) for values in (lat, lon))
    place = from_first(lat, lon, 1e-3 * up)
    place[:, 2] = 1e-3 * up
    columns = vector("position", place)
    world = 1e-2 * enu(*_three(rows, "vx vy vz"))
    columns |= _velocity("GLOBAL_POSITION_INT", world, about, stamps)
    return columns | ({"depth": -1e-3 * up} if about.kind == _SUBMARINE else {})


def _gps(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
    fix = rows["fix_type"] >= _FIX_3D
    lat, lon, up = (np.where(fix, values, np.nan) for values in _three(rows, "lat lon alt"))
    place = from_first(np.radians(1e-7 * lat), np.radians(1e-7 * lon), 1e-3 * up)
    return vector("gps_position", place)


def _battery(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
    if "voltages" in (rows.dtype.names or ()):
        cells = rows["voltages"].astype(np.float64)
        volts = np.where(cells < 65535, cells, 0.0).sum(axis=1) * 1e-3
        current = rows["current_battery"]
    else:
        volts = np.where(rows["voltage_battery"] < 65535, rows["voltage_battery"] * 1e-3, 0.0)
        current = rows["current_battery"]
    left = rows["battery_remaining"]
    # -1 stands for unknown
    return {
        "battery_voltage": np.where(volts > 0.0, volts, np.nan),
        "battery_current": np.where(current >= 0, current * 1e-2, np.nan),
        "battery_charge": np.where(left >= 0, left * 1e-2, np.nan),
    }


def _outputs(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
    widths = {k: rows[f"servo{k}_raw"].astype(np.float64) for k in range(1, 17)}
    return motor_pulses(widths, about.parameters)


def _speeds(first: int) -> Callable[..., dict[str, Floats]]:
    def make(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
        speeds = _RPM * rows["rpm"].astype(np.float64)
        return {
            f"rotor_speed_{first + k}": speeds[:, k]
            for k in range(speeds.shape[1])
            if speeds[:, k].any()
        }

    return make


def _range(rows: NDArray[Any], about: _Vehicle, _: Any) -> dict[str, Floats]:
    down = rows["orientation"] == _DOWN
    return {"range": np.where(down, rows["current_distance"] * 1e-2, np.nan)}


_MILLI = (1e-3, 1e-3 * STANDARD_GRAVITY, 1e-7)
_TOPICS: dict[str, Callable[..., dict[str, Floats]]] = {
    "HIGHRES_IMU": _imu(1.0, 1.0, 1e-4),
    "ATTITUDE_QUATERNION": _attitude,
    "ATTITUDE": _attitude,
    # with PX4 it holds counts of the converter
    "RAW_IMU": _imu(*_MILLI, only=_ARDUPILOT),
    "SCALED_IMU": _imu(*_MILLI),
    "SCALED_IMU2": _imu(*_MILLI),
    "LOCAL_POSITION_NED": _local,
    "GLOBAL_POSITION_INT": _global,
    "GPS_RAW_INT": _gps,
    "BATTERY_STATUS": _battery,
    "SYS_STATUS": _battery,
    "SERVO_OUTPUT_RAW": _outputs,
    "ESC_TELEMETRY_1_TO_4": _speeds(1),
    "ESC_TELEMETRY_5_TO_8": _speeds(5),
    "DISTANCE_SENSOR": _range,
}
"""Known messages, the preferred one first where two give the same channel."""
