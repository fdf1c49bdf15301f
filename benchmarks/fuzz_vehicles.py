"""Targets: logs of vehicles. Damaged files, and well-formed ones with strange declarations."""

from __future__ import annotations

import bz2
import io
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzz_targets import Target, checked

_HEAD = b"\xa3\x95"
_CODES = {"c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B", "n": "4s", "N": "16s",
          "Z": "64s", "a": "64s", "g": "e"}  # fmt: skip
_NUMBERS = "bBhHiIfdgMcCeELqQ"
_KNOWN: dict[str, tuple[str, str]] = {
    "IMU": ("QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "ATT": ("QccC", "TimeUS,Roll,Pitch,Yaw"),
    "XKF1": ("QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD"),
    "GPS": ("QBBLLefff", "TimeUS,I,Status,Lat,Lng,Alt,Spd,GCrs,VZ"),
    "BAT": ("QBffB", "TimeUS,Instance,Volt,Curr,RemPct"),
    "RCOU": ("QHHHH", "TimeUS,C1,C2,C3,C4"),
    "ESC": ("QBe", "TimeUS,Instance,RPM"),
    "MAG": ("QBhhh", "TimeUS,I,MagX,MagY,MagZ"),
    "CTUN": ("Qff", "TimeUS,Alt,BAlt"),
    "RFND": ("QBCB", "TimeUS,Instance,Dist,Stat"),
    "PARM": ("QNf", "TimeUS,Name,Value"),
    "MSG": ("QZ", "TimeUS,Message"),
}
"""Messages of ArduPilot that the reader knows: letters and labels of their declarations."""


def _message(kind: int, letters: str, values: list[Any]) -> bytes:
    layout = "<" + "".join(_CODES.get(letter, letter) for letter in letters)
    return _HEAD + bytes([kind]) + struct.pack(layout, *values)


def _declared(kind: int, name: str, letters: str, labels: str) -> bytes:
    size = 3 + struct.calcsize("<" + "".join(_CODES.get(one, one) for one in letters))
    body = (kind, size & 0xFF, name.encode(), letters.encode(), labels.encode())
    return _HEAD + b"\x80" + struct.pack("<BB4s16s64s", *body)


def _value(letter: str, row: int, data: Random | None) -> Any:
    code = _CODES.get(letter, letter)
    if code.endswith("s"):
        words = (b"SERVO1_FUNCTION", b"ArduSub V4.1.0", b"\xff\x1b[31m", b"", b"1")
        return data.choice(words) if data else words[0]
    if code in "fde":
        huge = 6e4 if code == "e" else 3e38
        odd = (float("nan"), float("inf"), huge, -huge, 0.0)
        return data.choice(odd) if data and data.random() < 0.3 else 0.1 * row
    bits = 8 * struct.calcsize("<" + code)
    least, most = (0, 2**bits - 1) if code.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return data.choice((least, most, 0, 1)) if data and data.random() < 0.3 else row % 100


def _flash(data: Random | None = None) -> bytes:
    """A DataFlash log; with a source of choices, letters, labels and values are of any kind."""
    raw = b""
    kinds = {name: 65 + k for k, name in enumerate(_KNOWN)}
    shapes = dict(_KNOWN)
    for name, (sound, titles) in _KNOWN.items():
        letters, labels = sound, titles
        if data and data.random() < 0.5:
            pool = _NUMBERS + "nNZa"
            letters = "".join(
                data.choice(pool) if data.random() < 0.3 else letter for letter in sound
            )
            labels = data.choice((titles, titles.replace("TimeUS", "TimeMS"), titles[:-1]))
        shapes[name] = (letters, labels)
        raw += _declared(kinds[name], name, letters, labels)
    for row in range(20):
        for name, (letters, _) in shapes.items():
            values = [_value(letter, row, data) for letter in letters]
            if letters[0] in "qQ" and not (data and data.random() < 0.05):
                values[0] = 1_000_000 + 10_000 * row
            raw += _message(kinds[name], letters, values)
    return raw


def _dataflash(draw: Callable[[Random], bytes] | None = None) -> Target:
    from seals.plugins.readers.dataflash import ReaderDataflash

    return Target(whole=_flash(), name="a.bin", load=checked(ReaderDataflash()), draw=draw)


def _packets(data: Random | None = None) -> bytes:
    """A telemetry log; with a source of choices, its numbers are of any kind and order."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    mav, raw = dialect.MAVLink(None, srcSystem=1, srcComponent=1), b""
    odd = (float("nan"), float("inf"), 3e38, 0.0)

    def real() -> float:
        return data.choice(odd) if data and data.random() < 0.3 else 0.1

    def whole(value: int, most: int) -> int:
        return data.choice((0, 1, most)) if data and data.random() < 0.1 else value

    for k in range(30):
        ms, arrived = 65_000 + 100 * k, whole(1_700_000_065_000_000 + 100_000 * k, 4 * 10**15)
        time = whole(ms, 2**32 - 1)
        messages = [
            dialect.MAVLink_heartbeat_message(whole(12, 255), whole(3, 255), 81, 0, 4, 3),
            dialect.MAVLink_param_value_message(b"SERVO1_FUNCTION", real(), 9, 3, 1),
            dialect.MAVLink_attitude_message(time, *[real() for _ in range(6)]),
            dialect.MAVLink_local_position_ned_message(time, *[real() for _ in range(6)]),
            dialect.MAVLink_raw_imu_message(whole(ms * 1000, 2**64 - 1), *[whole(9, 32767)] * 9),
            dialect.MAVLink_servo_output_raw_message(time, 0, *[whole(1500, 65535)] * 8),
        ]
        for message in messages:
            packet = message.pack(mav, force_mavlink1=k % 2 == 0)
            raw += struct.pack(">Q", max(arrived, 0)) + bytes(packet)
    return raw


def _tlog(draw: Callable[[Random], bytes] | None = None) -> Target:
    from seals.plugins.readers.tlog import ReaderTlog

    return Target(whole=_packets(), name="a.tlog", load=checked(ReaderTlog()), draw=draw)


def _record(header: dict[str, bytes], content: bytes) -> bytes:
    entries = [name.encode() + b"=" + value for name, value in header.items()]
    raw = b"".join(struct.pack("<I", len(entry)) + entry for entry in entries)
    return struct.pack("<I", len(raw)) + raw + struct.pack("<I", len(content)) + content


def _recorded(packing: bytes, data: Random | None = None) -> bytes:
    """A bag of ROS 1 of one topic; with a source of choices, sizes and types are of any kind."""
    number, place = struct.pack("<I", 0), "sensor_msgs/Imu"
    if data and data.random() < 0.3:
        place = data.choice(("sensor_msgs/JointState", "nav_msgs/Odometry", "a/b", "", "\x1b[31m"))
    kind = b"type=" + place.encode()
    raw = _record(
        {"op": b"\x07", "conn": number, "topic": b"/imu"}, struct.pack("<I", len(kind)) + kind
    )
    for k in range(30):
        length = data.choice((0, 1, 1 << 16, 1 << 31)) if data and data.random() < 0.1 else 4
        value = data.choice((1e308, float("nan"), 0.5)) if data else 0.5
        body = struct.pack("<IIII", k, 1_700_000_000, 10_000_000 * k, length) + b"base"
        body += struct.pack("<37d", *[value] * 37)
        stamp = struct.pack("<II", 1_700_000_000, 10_000_000 * k)
        raw += _record({"op": b"\x02", "conn": number, "time": stamp}, body)
    size = data.choice((0, len(raw), 1 << 31)) if data and data.random() < 0.2 else len(raw)
    packed = bz2.compress(raw) if packing == b"bz2" else raw
    header = {"op": b"\x05", "compression": packing, "size": struct.pack("<I", size)}
    return b"#ROSBAG V2.0\n" + _record(header, packed)


def _bag(packing: bytes, draw: Callable[[Random], bytes] | None = None) -> Target:
    from seals.plugins.readers.recording import ReaderRosbag1

    return Target(whole=_recorded(packing), name="a.bag", load=checked(ReaderRosbag1()), draw=draw)


def _matlab(modern: bool) -> Target:
    from seals.plugins.readers.matlab import ReaderMatlab

    stream, columns = io.BytesIO(), {"t": np.arange(40) / 100, "depth": np.sin(np.arange(40.0))}
    if modern:
        import h5py

        with h5py.File(stream, "w") as file:
            for name, values in columns.items():
                file.create_dataset(name, data=values, chunks=(10,), compression="gzip")
    else:
        from scipy.io import savemat

        savemat(stream, columns, do_compression=True)
    return Target(whole=stream.getvalue(), name="a.mat", load=checked(ReaderMatlab()))


_TITLES = "loopIteration, time (us), gyroADC[0] (deg/s), accSmooth[0] (g), motor[0], eRPM[0]\n"


def _decoded(data: Random | None = None) -> bytes:
    """A table of blackbox_decode; with a source of choices, of any titles, units and numbers."""
    odd = ("nan", "1e308", "-1", "", "x", "1e400", '"')
    titles = _TITLES
    if data:
        cells = titles.strip().split(", ")
        more = ("(" * 999, " " * 999 + "x", "gyroADC[9] (deg/s)", "a (\x1b[31m)", "time (h)", "")
        cells[data.randrange(1, len(cells))] = data.choice((*cells, *more))
        titles = ", ".join(cells) + "\n"
    lines = [titles]
    for k in range(30):
        row = [str(k), str(1000 * k), "1.5", "0.1", "1500", "70"]
        if data and data.random() < 0.3:
            row[data.randrange(len(row))] = data.choice(odd)
        lines.append(", ".join(row) + "\n")
    return "".join(lines).encode()


def _betaflight(draw: Callable[[Random], bytes] | None = None) -> Target:
    from seals.plugins.readers.betaflight import ReaderBetaflight

    return Target(whole=_decoded(), name="a.csv", load=checked(ReaderBetaflight()), draw=draw)


def _content() -> Target:
    from seals.logs.content import reader_by_content

    def load(path: Path) -> None:
        reader_by_content(path)

    starts = (b"ULog\x01\x12\x35", b"\x89MCAP0\r\n", b"SQLite format 3\0", b"#ROSBAG V2.0\n", _HEAD,
              b"MATLAB ", b"\x89HDF\r\n\x1a\n", b"loopIteration", b"\xbc\1\0\1\0", b"PK\x03\x04",
              b"\x1f\x8b\x08", b"{", b"<", b"a,b\n", b"H Product:Blackbox")  # fmt: skip

    def draw(data: Random) -> bytes:
        rest = data.randbytes(data.choice((0, 3, 600, 5000)))
        return data.choice(starts) + data.choice((rest, b"," * 5000, b"\n" * 5000, rest + b"\n"))

    return Target(whole=b"a,b\n1,2\n", name="a.gz", load=load, draw=draw)


def _mapped() -> Target:
    """A map of columns of any names, units and factors over a small table."""
    from seals.logs.check import check_log
    from seals.logs.column_map import ColumnMap
    from seals.logs.csv import read_csv
    from seals.logs.units import UNITS
    from seals.untrusted_io import read_yaml

    def load(path: Path) -> None:
        table = path.with_name("a.csv")
        table.write_text("a,b,c\n" + "".join(f"{k},{k % 3},{k / 7}\n" for k in range(1, 30)))
        given = read_yaml(path)
        check_log(read_csv(table, ColumnMap(**given)))

    def draw(data: Random) -> bytes:
        columns = {
            name: data.choice(("t", "depth", "segment", "motor_pwm_1", "specific_force_x", "''"))
            for name in "abc"
        }
        factors = ("0", "1", "-1", "1e300", ".nan", ".inf", "1" + "0" * 200, "x", "true", "1e-320")
        lines = ["columns:", *(f"  {name}: {column}" for name, column in columns.items())]
        for entry in ("scale", "offset"):
            if data.random() < 0.5:
                lines += [f"{entry}:", f"  {data.choice('abcd')}: {data.choice(factors)}"]
        if data.random() < 0.5:
            lines += ["units:", f"  {data.choice('abc')}: {data.choice((*UNITS, '5', 'xyz'))!r}"]
        if data.random() < 0.3:
            lines.append(f"negate: [{data.choice(('a', 'b', '5', 'z'))}]")
        return "\n".join(lines).encode()

    return Target(whole=b"columns: {a: t, b: depth}\n", name="map.yaml", load=load, draw=draw)


VEHICLES: dict[str, Callable[[], Target]] = {
    "dataflash": _dataflash,
    "hostile_dataflash": lambda: _dataflash(_flash),
    "tlog": _tlog,
    "hostile_tlog": lambda: _tlog(_packets),
    "rosbag1": lambda: _bag(b"none"),
    "rosbag1_bz2": lambda: _bag(b"bz2"),
    "hostile_rosbag1": lambda: _bag(b"none", lambda data: _recorded(b"none", data)),
    "matlab": lambda: _matlab(modern=False),
    "matlab_hdf5": lambda: _matlab(modern=True),
    "betaflight": _betaflight,
    "hostile_betaflight": lambda: _betaflight(_decoded),
    "content": _content,
    "column_map": _mapped,
}
"""Readers of vehicles' logs by name."""
