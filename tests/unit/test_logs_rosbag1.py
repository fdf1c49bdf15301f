"""Bags of ROS 1 written by the package rosbags, and hostile ones."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.plugins.readers.recording import ReaderRosbag1

rosbag1 = pytest.importorskip("rosbags.rosbag1", reason="rosbags is not installed")
typesys = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed")

STORE = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
COUNT = 30
START = 1_700_000_000


def _make(kind: str, /, **fields: Any) -> Any:
    return STORE.types[kind](**fields)


def _header(k: int) -> Any:
    stamp = _make("builtin_interfaces/msg/Time", sec=START, nanosec=k * 10_000_000)
    return _make("std_msgs/msg/Header", seq=k, stamp=stamp, frame_id="base_link")


def _vector(x: float, y: float, z: float) -> Any:
    return _make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def _imu(k: int) -> Any:
    return _make(
        "sensor_msgs/msg/Imu",
        header=_header(k),
        orientation=_make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=0.0),
        orientation_covariance=np.full(9, -1.0),
        angular_velocity=_vector(0.1, 0.2, 0.3 + k),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=_vector(0.5, -0.25, 9.81),
        linear_acceleration_covariance=np.zeros(9),
    )


def _vicon(k: int) -> Any:
    turn = _make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.6, w=0.8)
    transform = _make(
        "geometry_msgs/msg/Transform", translation=_vector(1.0 + k, 2.0, 3.0), rotation=turn
    )
    return _make(
        "geometry_msgs/msg/TransformStamped",
        header=_header(k),
        child_frame_id="robot",
        transform=transform,
    )


def _level(k: int) -> Any:
    return _make("std_msgs/msg/Float32", data=50.0 + k)


TOPICS: dict[str, tuple[Callable[[int], Any], str]] = {
    "/imu": (_imu, "sensor_msgs/msg/Imu"),
    "/vicon/robot": (_vicon, "geometry_msgs/msg/TransformStamped"),
    "/tank/level": (_level, "std_msgs/msg/Float32"),
}


def _bag(place: Path, packing: str = "") -> Path:
    """Let the package rosbags write a bag; messages are recorded 3 ms after their stamps."""
    file = place / "flight.bag"
    writer = rosbag1.Writer(file)
    if packing:
        writer.set_compression(getattr(rosbag1.Writer.CompressionFormat, packing))
    with writer:
        for topic, (make, kind) in TOPICS.items():
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for k in range(COUNT):
                stamp = START * 1_000_000_000 + k * 10_000_000 + 3_000_000
                writer.write(connection, stamp, STORE.serialize_ros1(make(k), kind))
    return file


def _read(file: Path, **fields: object) -> Log:
    (log,) = ReaderRosbag1(**fields).read(file)  # type: ignore[arg-type]
    return log


@pytest.mark.parametrize("packing", ["", "BZ2", "LZ4"])
def test_known_types_are_read(packing: str, tmp_path: Path) -> None:
    """Inertial sensor and motion capture, whatever the packing."""
    log = _read(_bag(tmp_path, packing))
    assert log.time == pytest.approx(0.01 * np.arange(COUNT), abs=1e-9)
    assert log.channel("angular_velocity")[4].tolist() == [0.1, 0.2, 4.3]
    assert log.channel("specific_force")[0].tolist() == [0.5, -0.25, 9.81]
    assert log.channel("position")[5].tolist() == [6.0, 2.0, 3.0]
    # the sensor has no orientation, and says so
    assert log.channel("orientation")[0].tolist() == [0.8, 0.0, 0.0, 0.6]
    assert log.meta["recording"]["start"] == START


@pytest.mark.parametrize(("records", "fine"), [(1, True), (10_000, False)])
def test_records_of_nothing_are_padding(records: int, fine: bool, tmp_path: Path) -> None:
    """Some recorders leave a few before the index; a file full of them is no bag."""
    file = _bag(tmp_path)
    raw = file.read_bytes()
    # the connections of the index stand behind the last chunk's messages
    place = raw.rindex(b"op=\x04") - 8
    file.write_bytes(raw[:place] + bytes(8 * records))
    if fine:
        assert _read(file).rows == COUNT
    else:
        with pytest.raises(LogError, match="does not state its type"):
            _read(file)


def test_other_fields_are_mapped(tmp_path: Path) -> None:
    """A number without a stamp has its time of recording."""
    names = {"/tank/level/data": "depth"}
    log = _read(
        _bag(tmp_path), columns=names, units={"/tank/level/data": "cm"}, topics=["/tank/level"]
    )
    assert log.columns["depth"][:3] == pytest.approx([0.5, 0.51, 0.52])
    assert log.meta["recording"]["start"] == pytest.approx(START + 0.003)


def test_a_bag_that_was_never_closed_is_read(tmp_path: Path) -> None:
    """Without an index, and with half a record at the end."""
    file = _bag(tmp_path)
    raw = file.read_bytes()
    # connections and chunk infos stand behind the last chunk's messages
    file.write_bytes(raw[: raw.rindex(b"op=\x04") - 8])
    assert _read(file).rows == COUNT
    file.write_bytes(raw[:-40])
    assert _read(file).rows == COUNT


def _record(data: bytes, **header: bytes) -> bytes:
    fields = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
        for name, value in header.items()
    )
    return struct.pack("<I", len(fields)) + fields + struct.pack("<I", len(data)) + data


MAGIC = b"#ROSBAG V2.0\n"
BOMB = bz2.compress(bytes(1 << 24))


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"#ROSBAG V1.2\n" + bytes(60), "rosbag migrate"),
        (
            MAGIC + _record(BOMB, op=b"\5", compression=b"bz2", size=struct.pack("<I", 9)),
            "does not hold the 9 bytes",
        ),
        (
            MAGIC + _record(b"", op=b"\5", compression=b"none", size=struct.pack("<I", 1 << 31)),
            "a chunk declares",
        ),
        (
            MAGIC + _record(b"x", op=b"\5", compression=b"xz", size=struct.pack("<I", 1)),
            "compression 'xz' is not known",
        ),
        (
            MAGIC + _record(b"", op=b"\2", conn=struct.pack("<I", 3), time=bytes(8)),
            "connection that is not declared",
        ),
        (MAGIC + _record(b"", op=b"\3", encryptor=b"rosbag/Aes"), "encrypted"),
        (MAGIC + struct.pack("<I", 4) + b"\0\0\0\0" + struct.pack("<I", 0), "without a name"),
        (MAGIC + struct.pack("<I", 1 << 20) + bytes(1 << 21), "a record declares 1,048,576"),
        (MAGIC, "no topic with a known type"),
    ],
)
def test_broken_bags_are_refused(raw: bytes, words: str, tmp_path: Path) -> None:
    """Old, encrypted and forged bags end in words, bombs before they are unpacked."""
    file = tmp_path / "a.bag"
    file.write_bytes(raw)
    with pytest.raises(LogError, match=words):
        _read(file)


def test_a_message_that_is_too_short_is_refused(tmp_path: Path) -> None:
    """A forged payload is damaged, not misread."""
    inner = b"".join(
        struct.pack("<I", len(one)) + one for one in (b"topic=/imu", b"type=sensor_msgs/Imu")
    )
    raw = MAGIC + _record(inner, op=b"\7", conn=bytes(4), topic=b"/imu")
    raw += _record(bytes(40), op=b"\2", conn=bytes(4), time=bytes(8))
    file = tmp_path / "a.bag"
    file.write_bytes(raw)
    with pytest.raises(LogError, match="is damaged"):
        _read(file)
