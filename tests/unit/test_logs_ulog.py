"""ULog files written by the library of PX4, and broken ones."""

from __future__ import annotations

import io
import math
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.plugins.readers.ulog import ReaderUlog

pyulog = pytest.importorskip("pyulog", reason="pyulog, which writes the files, is not installed")

STEP = 4000
COUNT = 50
KIND = {"timestamp": "uint64_t", "accelerometer_timestamp_relative": "int32_t", "xy_valid": "bool"}


def _written(topics: dict[str, dict[str, Any]]) -> bytes:
    """Let pyulog write topics: name -> field -> values; ``timestamp`` is added, 4 ms apart."""
    log = pyulog.ULog(None)
    for number, (name, fields) in enumerate(topics.items()):
        data = {"timestamp": 1_000_000 + STEP * np.arange(COUNT), **fields}
        rows = {key: np.broadcast_to(value, COUNT) for key, value in data.items()}
        kinds = [(KIND.get(key, "float"), key) for key in rows]
        arrays: dict[str, tuple[str, int]] = {}
        for kind, key in kinds:
            stem, _, index = key.partition("[")
            arrays[stem] = (kind, int(index[:-1]) + 1 if index else 0)
        declared = [(kind, size, stem) for stem, (kind, size) in arrays.items()]
        log._message_formats[name] = SimpleNamespace(name=name, fields=declared)
        log._data_list.append(
            SimpleNamespace(
                msg_id=number,
                multi_id=0,
                name=name,
                data=rows,
                field_data=[SimpleNamespace(field_name=key, type_str=kind) for kind, key in kinds],
            )
        )
    stream = io.BytesIO()
    log.write_ulog(stream)
    return stream.getvalue()


def _file(place: Path, topics: dict[str, dict[str, Any]]) -> Path:
    file = place / "flight.ulg"
    file.write_bytes(_written(topics))
    return file


# nose to the east, level: in NED a turn by +90 degrees about z (down)
EAST = {f"q[{k}]": v for k, v in enumerate((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))}


def test_frames_become_flu_and_enu(tmp_path: Path) -> None:
    """Facing east, level, at rest: no turn in ENU, gravity up, place and speed in their axes."""
    imu = {f"gyro_rad[{k}]": v for k, v in enumerate((0.1, 0.2, 0.3))}
    imu |= {f"accelerometer_m_s2[{k}]": v for k, v in enumerate((0.5, 0.25, -9.8125))}
    place = dict(
        zip(("x", "y", "z", "vx", "vy", "vz"), (1.0, 2.0, -3.0, 0.5, 4.0, -0.25), strict=True)
    )
    file = _file(
        tmp_path,
        {"sensor_combined": imu, "vehicle_attitude": EAST, "vehicle_local_position": place},
    )
    (log,) = ReaderUlog().read(file)
    row = {key: values[COUNT // 2] for key, values in log.columns.items()}
    assert [row[f"angular_velocity_{a}"] for a in "xyz"] == pytest.approx([0.1, -0.2, -0.3])
    assert [row[f"specific_force_{a}"] for a in "xyz"] == [0.5, -0.25, 9.8125]
    # x of the body along east: no rotation
    assert [row[f"orientation_{a}"] for a in "xyz"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-7)
    assert abs(row["orientation_w"]) == pytest.approx(1.0)
    assert [row[f"position_{a}"] for a in "xyz"] == [2.0, 1.0, 3.0]
    # north 0.5, east 4, up 0.25: forward is east, left is north
    assert [row[f"velocity_{a}"] for a in "xyz"] == pytest.approx([4.0, 0.5, 0.25])
    assert log.time[1] == pytest.approx(STEP * 1e-6)
    assert log.meta["recording"]["start"] == pytest.approx(1.0)


def test_a_nose_that_rises_pitches_up(tmp_path: Path) -> None:
    """Facing north with the nose 30 degrees up, the body's x axis points north and up in ENU."""
    half = math.radians(15.0)
    attitude = {f"q[{k}]": v for k, v in enumerate((math.cos(half), 0.0, math.sin(half), 0.0))}
    (log,) = ReaderUlog().read(_file(tmp_path, {"vehicle_attitude": attitude}))
    w, x, y, z = (log.columns[f"orientation_{a}"][0] for a in "wxyz")
    ahead = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
    assert ahead == pytest.approx((0.0, math.cos(2 * half), math.sin(2 * half)), abs=1e-6)


def test_each_topic_keeps_its_own_times(tmp_path: Path) -> None:
    """A late accelerometer and a battery get rows of their own; absent samples are NaN."""
    imu = {f"{name}[{k}]": 1.0 for name in ("gyro_rad", "accelerometer_m_s2") for k in range(3)}
    imu["accelerometer_timestamp_relative"] = -1000
    battery = {"timestamp": 1_002_000 + STEP * np.arange(COUNT), "voltage_v": 15.5}
    battery["current_a"] = -1.0
    (log,) = ReaderUlog().read(_file(tmp_path, {"sensor_combined": imu, "battery_status": battery}))
    assert log.time[:4] == pytest.approx([0.0, 1e-3, 3e-3, 4e-3])
    assert np.isfinite(log.columns["specific_force_x"][:5]).tolist() == [1, 0, 0, 1, 0]
    assert np.isfinite(log.columns["angular_velocity_x"][:5]).tolist() == [0, 1, 0, 0, 1]
    assert log.columns["battery_voltage"][2] == 15.5
    assert not log.has("battery_current")


def test_invalid_places_are_no_samples(tmp_path: Path) -> None:
    """Where the autopilot calls a position invalid, there is no position."""
    place = dict.fromkeys(("x", "y", "z", "vx", "vy", "vz"), 1.0)
    valid = (np.arange(COUNT) >= 10).astype(np.int8)
    file = _file(tmp_path, {"vehicle_local_position": {**place, "xy_valid": valid}})
    (log,) = ReaderUlog().read(file)
    assert np.isnan(log.columns["position_x"]).sum() == 10
    assert np.isfinite(log.columns["position_z"]).all()


def test_any_field_is_mapped_with_its_unit(tmp_path: Path) -> None:
    """A field of an unknown topic comes with unit and sign; a wrong name gets the nearest."""
    file = _file(tmp_path, {"tank": {"gauge[0]": 25.0, "gauge[1]": 1.0}})
    choice = {"columns": {"tank/gauge[0]": "depth"}, "units": {"tank/gauge[0]": "cm"}}
    (log,) = ReaderUlog(**choice, negate=["tank/gauge[0]"]).read(file)  # type: ignore[arg-type]
    assert log.columns["depth"][0] == -0.25
    with pytest.raises(LogError, match=r"no topic 'tonk'.\nDid you mean 'tank'"):
        ReaderUlog(columns={"tonk/gauge[0]": "depth"}).read(file)
    with pytest.raises(LogError, match="no field 'gauge'"):
        ReaderUlog(columns={"tank/gauge": "depth"}).read(file)
    with pytest.raises(LogError, match="no sample of a known channel"):
        ReaderUlog().read(file)


def test_a_file_cut_short_is_read_up_to_the_cut(tmp_path: Path) -> None:
    """As after a loss of power: the last, half-written message is left out."""
    whole = _written({"vehicle_attitude": EAST})
    file = tmp_path / "cut.ulg"
    file.write_bytes(whole[:-5])
    (log,) = ReaderUlog().read(file)
    assert log.rows == COUNT - 1


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


HEADER = b"ULog\x01\x12\x35\x01" + bytes(8)
NESTED = b"".join(
    _message("F", f"n{k}:uint64_t timestamp;n{k + 1}[99999] a;n{k + 1}[99999] b".encode())
    for k in range(8)
)
BROKEN = {
    "itself": _message("F", b"a:uint64_t timestamp;a[2] b") + _message("A", b"\0\0\0a"),
    "bomb": NESTED + _message("F", b"n8:uint8_t[99999] x") + _message("A", b"\0\0\0n0"),
    "nothing": _message("F", b"e:") + _message("F", b"a:e[99999] x;e[99999] y;uint64_t timestamp")
    + _message("A", b"\0\0\0a"),
    "twice": _message("F", b"a:uint8_t x;uint8_t x") + _message("A", b"\0\0\0a"),
    "unknown": _message("A", b"\0\0\0absent"),
    "noise": bytes(range(64, 250)) * 40,
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_declarations_are_refused(name: str, tmp_path: Path) -> None:
    """Formats that hold themselves, or gigabytes, or nothing, end in words at once."""
    file = tmp_path / "bad.ulg"
    file.write_bytes(HEADER + BROKEN[name] + _message("D", b"\0\0" + bytes(16)))
    with pytest.raises(LogError, match=r"damaged|more than|no sample|newer version"):
        ReaderUlog().read(file)


def test_messages_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three bytes each, a file of the largest size would hold fifty million."""
    file = _file(tmp_path, {"vehicle_attitude": EAST})
    ReaderUlog().read(file)
    monkeypatch.setattr("seals.plugins.readers.ulog._MOST_MESSAGES", COUNT)
    with pytest.raises(LogError, match="more than 50 messages"):
        ReaderUlog().read(file)
