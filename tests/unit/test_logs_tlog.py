"""Telemetry logs: packets that pymavlink packs, the numbers that it reads, and broken files."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.plugins.readers.tlog import ReaderTlog

mavutil = pytest.importorskip("pymavlink.mavutil", reason="pymavlink is not installed")
dialect = pytest.importorskip("pymavlink.dialects.v20.ardupilotmega")

COUNT = 30
START = 1_700_000_000_000_000
BOOT = 65_000
"""Time of the first message since the vehicle began [ms]."""


class Writer:
    """A ground station that writes what it receives."""

    def __init__(self, system: int = 1) -> None:
        self.raw = b""
        self.mav = dialect.MAVLink(None, srcSystem=system, srcComponent=1)

    def take(self, message: Any, arrived: int, *, old: bool = False) -> None:
        """Write a message at a time [us]; old ones are of MAVLink 1."""
        packet = message.pack(self.mav, force_mavlink1=old)
        self.raw += struct.pack(">Q", arrived) + bytes(packet)


def flight(kind: int = 12, system: int = 1, late: int = 20_000) -> bytes:
    """A vehicle that faces east, level, and moves north-west; packets are late by 20 ms or more."""
    out, mav = Writer(system), dialect
    heartbeat = mav.MAVLink_heartbeat_message(kind, 3, 81, 0, 4, 3)
    out.take(heartbeat, START + BOOT * 1000)
    for output, function in ((1, 34), (2, 33), (3, 0)):
        name = f"SERVO{output}_FUNCTION".encode()
        parameter = mav.MAVLink_param_value_message(name, float(function), 9, 3, output)
        out.take(parameter, START + BOOT * 1000)
    for k in range(COUNT):
        ms = BOOT + 100 * k
        arrived = START + ms * 1000 + late + 3_000 * (k % 4)
        rates = (0.1, 0.2, 0.3 + k)
        old = k % 2 == 0
        turn = (0.0, 0.0, math.pi / 2)
        out.take(mav.MAVLink_attitude_message(ms, *turn, *rates), arrived, old=old)
        raw = mav.MAVLink_raw_imu_message(ms * 1000, 100, 50, -1000, 1, 2, 3, 200, -100, 400)
        out.take(raw, arrived, old=old)
        place = (1.0, 2.0, -3.0 + k, 4.0, -0.5, 0.25)
        out.take(mav.MAVLink_local_position_ned_message(ms, *place), arrived)
        where = (471234567 + 90 * k, -85, 2000, -2500, 400, -50, 25, 9000)
        out.take(mav.MAVLink_global_position_int_message(ms, *where), arrived)
        volts = [15500] + [65535] * 9
        out.take(
            mav.MAVLink_battery_status_message(0, 0, 0, 2000, volts, 400, 100, 100, 75), arrived
        )
        pulses = (1500, 1600 + k, 1100, 0, 0, 0, 0, 0)
        stamp = (ms * 1000) % (1 << 32)
        out.take(mav.MAVLink_servo_output_raw_message(stamp, 0, *pulses), arrived)
        speeds = ([0] * 4, [0] * 4, [0] * 4, [0] * 4, [6000, 3000, 0, 0], [0] * 4)
        out.take(mav.MAVLink_esc_telemetry_1_to_4_message(*speeds), arrived)
    return out.raw


def _read(place: Path, raw: bytes | None = None, **fields: object) -> Log:
    file = place / "flight.tlog"
    file.write_bytes(flight() if raw is None else raw)
    (log,) = ReaderTlog(**fields).read(file)  # type: ignore[arg-type]
    return log


def _theirs(place: Path, name: str, field: str) -> list[float]:
    """Numbers of a field as pymavlink reads them."""
    link = mavutil.mavlink_connection(str(place / "flight.tlog"), dialect="ardupilotmega")
    found = []
    while (message := link.recv_match(type=[name])) is not None:
        found.append(getattr(message, field))
    link.close()
    return found


def test_numbers_are_those_of_pymavlink(tmp_path: Path) -> None:
    """Packets of both versions, payloads without their last zeros, arrays."""
    keys = {"ATTITUDE/yawspeed": "a", "GLOBAL_POSITION_INT/lat": "b", "RAW_IMU/zacc": "c",
            "BATTERY_STATUS/voltages[0]": "d", "SERVO_OUTPUT_RAW/servo2_raw": "e"}  # fmt: skip
    log = _read(tmp_path, columns=keys)
    for key, column in keys.items():
        name, _, field = key.partition("/")
        theirs = np.array(_theirs(tmp_path, name, field.partition("[")[0]), dtype=float)
        theirs = theirs[:, 0] if theirs.ndim == 2 else theirs
        ours = log.columns[column]
        assert ours[np.isfinite(ours)].tolist() == theirs.tolist()


def test_frames_and_units_are_ours(tmp_path: Path) -> None:
    """Facing east is no turn in ENU; thousandths of g, cA, rpm and mgauss are SI."""
    log = _read(tmp_path)

    def first(stem: str) -> list[float]:
        values = log.channel(stem)
        return [float(x) for x in values[np.isfinite(values).all(axis=1)][0]]

    assert np.abs(first("orientation")) == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-7)
    assert first("angular_velocity") == pytest.approx([0.1, -0.2, -0.3])
    assert first("specific_force") == pytest.approx([0.980665, -0.4903325, 9.80665])
    assert first("position") == pytest.approx([2.0, 1.0, 3.0])
    assert first("velocity") == pytest.approx([-0.5, 4.0, -0.25], abs=1e-6)
    assert first("magnetic_field") == pytest.approx([2e-5, 1e-5, -4e-5])
    assert first("rotor_speed") == pytest.approx([628.3185307, 314.1592654])
    assert [first(s)[0] for s in ("battery_voltage", "battery_current", "battery_charge")] == (
        pytest.approx([15.5, 4.0, 0.75])
    )
    assert first("depth") == [2.5]
    assert first("motor_pwm") == [1600.0, 1500.0]
    assert not _read(tmp_path, flight(kind=2)).has("depth")


def test_stamps_are_those_of_the_vehicle(tmp_path: Path) -> None:
    """Packets come 20 to 29 ms late: steps are even, and as late as the fastest one."""
    log = _read(tmp_path)
    held = np.isfinite(log.columns["position_x"])
    assert np.diff(log.time[held]) == pytest.approx(np.full(COUNT - 1, 0.1), abs=1e-9)
    first = log.meta["recording"]["start"] + log.time[held][0]
    assert first == pytest.approx(START * 1e-6 + BOOT * 1e-3 + 0.02, abs=1e-5)
    late = _read(tmp_path, clock="record")
    held = np.isfinite(late.columns["position_x"])
    assert np.diff(late.time[held])[:4] == pytest.approx([0.103, 0.103, 0.103, 0.091], abs=1e-9)


def test_stamps_of_32_bits_begin_anew(tmp_path: Path) -> None:
    """The outputs' microseconds run over after 72 minutes; no clock falls back."""
    out = Writer()
    out.take(dialect.MAVLink_heartbeat_message(2, 3, 81, 0, 4, 3), START)
    for k in range(COUNT):
        us = (1 << 32) - 1_050_000 + 100_000 * k
        pulses = (1500 + k, 0, 0, 0, 0, 0, 0, 0)
        message = dialect.MAVLink_servo_output_raw_message(us % (1 << 32), 0, *pulses)
        out.take(message, START + us)
    log = _read(tmp_path, out.raw)
    assert log.time[-1] == pytest.approx(0.1 * (COUNT - 1))
    assert log.columns["motor_pwm_1"].tolist() == [1500.0 + k for k in range(COUNT)]


def test_a_packet_that_was_overtaken_is_put_in_its_place(tmp_path: Path) -> None:
    """A message that arrives 1.4 s after others is no clock that was set anew; a restart is."""
    out = Writer()
    out.take(dialect.MAVLink_heartbeat_message(2, 3, 81, 0, 4, 3), START)
    times = [100 * k for k in range(1, COUNT)]
    for k, ms in enumerate([*times[:20], 50, *times[20:]]):
        message = dialect.MAVLink_attitude_message(BOOT + ms, *[0.01 * ms] * 6)
        out.take(message, START + (BOOT + 100 * k) * 1000)
    log = _read(tmp_path, out.raw)
    assert log.columns["angular_velocity_x"] == pytest.approx([0.01 * t for t in [50, *times]])
    for k in range(COUNT):
        message = dialect.MAVLink_attitude_message(1 + 100 * k, *[0.1] * 6)
        out.take(message, START + (BOOT + 5000 + 100 * k) * 1000)
    with pytest.raises(LogError, match="falls back"):
        _read(tmp_path, out.raw)


def test_several_vehicles_are_told_apart(tmp_path: Path) -> None:
    """Two vehicles are refused unless one is chosen; a ground station is none."""
    station = Writer(255)
    station.take(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3), START)
    both = station.raw + flight() + flight(system=7)
    with pytest.raises(LogError, match=r"vehicles 1, 7\.\nChoose one: reader\.system=1"):
        _read(tmp_path, both)
    assert _read(tmp_path, both, system=7).rows == _read(tmp_path).rows
    with pytest.raises(LogError, match="no messages of vehicle 3"):
        _read(tmp_path, both, system=3)
    with pytest.raises(LogError, match="no messages of an autopilot"):
        _read(tmp_path, station.raw * 2)


def test_wrong_packets_are_passed_over(tmp_path: Path) -> None:
    """A wrong checksum, and noise of a radio, take nothing but their own packet."""
    raw = bytearray(flight())
    whole = _read(tmp_path)
    place = raw.index(b"\xfd", 400)
    raw[place + 12] ^= 0x55
    torn = bytes(raw[:2000]) + b"\0\5" + b"\xfe" * 300 + bytes(raw[2000:])
    log = _read(tmp_path, torn)
    for column in ("angular_velocity_z", "specific_force_x", "position_z"):
        ours, theirs = (one.columns[column] for one in (log, whole))
        assert 0 <= np.isfinite(theirs).sum() - np.isfinite(ours).sum() <= 2
        assert set(ours[np.isfinite(ours)]) <= set(theirs[np.isfinite(theirs)])


def test_broken_files_are_refused(tmp_path: Path) -> None:
    """Another file, one that is mostly noise, unknown messages and fields."""
    with pytest.raises(LogError, match="lacks the file signature"):
        _read(tmp_path, b"\xfe" * 400)
    with pytest.raises(LogError, match="belong to no packet"):
        _read(tmp_path, flight()[:500] + b"\xfe" * 5000)
    with pytest.raises(LogError, match="Did you mean 'ATTITUDE'"):
        _read(tmp_path, topics=["ATTITUD"])
    with pytest.raises(LogError, match="Did you mean 'yawspeed'"):
        _read(tmp_path, columns={"ATTITUDE/yawsped": "depth"})
    with pytest.raises(LogError, match=r"write voltages\[0\] to \[9\]"):
        _read(tmp_path, columns={"BATTERY_STATUS/voltages": "depth"})
    with pytest.raises(LogError, match="holds text"):
        _read(tmp_path, columns={"PARAM_VALUE/param_id": "depth"})
    with pytest.raises(LogError, match="Allowed: header, record"):
        ReaderTlog(clock="own")
