"""MCAP and rosbag2 recordings written by their own libraries, and hostile ones."""

from __future__ import annotations

import json
import sqlite3
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.plugins.readers.recording import ReaderMcap, ReaderRosbag2
from seals.plugins.readers.streams import refuse_unknown

_LACK = "mcap or rosbags, which write the files, are not installed"
writer = pytest.importorskip("mcap.writer", reason=_LACK)
rosbag2 = pytest.importorskip("rosbags.rosbag2", reason=_LACK)
typesys = pytest.importorskip("rosbags.typesys", reason=_LACK)

STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
COUNT = 40
START = 1_700_000_000


def _make(kind: str, /, **fields: Any) -> Any:
    return STORE.types[kind](**fields)


def _header(k: int, late: int = 0) -> Any:
    stamp = _make("builtin_interfaces/msg/Time", sec=START, nanosec=k * 10_000_000 + late)
    return _make("std_msgs/msg/Header", stamp=stamp, frame_id="base_link")


def _vector(x: float, y: float, z: float) -> Any:
    return _make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def _imu(k: int, oriented: bool = False) -> Any:
    turn = _make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.6, w=0.8)
    unknown = np.full(9, 0.0 if oriented else -1.0)
    return _make(
        "sensor_msgs/msg/Imu",
        header=_header(k),
        orientation=turn,
        orientation_covariance=unknown,
        angular_velocity=_vector(0.1, 0.2, 0.3 + k),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=_vector(0.5, -0.25, 9.81),
        linear_acceleration_covariance=np.zeros(9),
    )


def _joints(k: int) -> Any:
    return _make(
        "sensor_msgs/msg/JointState",
        header=_header(k, late=5_000_000),
        name=["shoulder", "elbow"],
        position=np.array([0.5, -0.5]),
        velocity=np.array([]),
        effort=np.array([]),
    )


def _battery(k: int) -> Any:
    numbers = dict.fromkeys(("temperature", "charge", "capacity", "design_capacity"), 0.0)
    flags = dict.fromkeys(
        ("power_supply_status", "power_supply_health", "power_supply_technology"), 0
    )
    return _make(
        "sensor_msgs/msg/BatteryState",
        header=_header(k),
        voltage=15.5,
        current=-4.0,
        percentage=0.75,
        present=True,
        cell_voltage=np.array([], dtype=np.float32),
        cell_temperature=np.array([], dtype=np.float32),
        location="",
        serial_number="",
        **numbers,
        **flags,
    )


TOPICS = {
    "/imu": ("sensor_msgs/msg/Imu", _imu),
    "/joints": ("sensor_msgs/msg/JointState", _joints),
    "/battery": ("sensor_msgs/msg/BatteryState", _battery),
    "/level": ("std_msgs/msg/Float64", lambda k: _make("std_msgs/msg/Float64", data=25.0 + k)),
}


def _stamp(k: int) -> int:
    return START * 1_000_000_000 + k * 10_000_000 + 2_000_000


def _mcap(place: Path, compression: str = "ZSTD", topics: dict[str, Any] | None = None) -> Path:
    file = place / "recording.mcap"
    with file.open("wb") as stream:
        out = writer.Writer(stream, compression=writer.CompressionType[compression])
        out.start()
        for topic, (kind, make) in (topics or TOPICS).items():
            schema = out.register_schema(kind, "ros2msg", b"")
            channel = out.register_channel(topic, "cdr", schema)
            for k in range(COUNT):
                data = bytes(STORE.serialize_cdr(make(k), kind))
                out.add_message(channel, _stamp(k), data, _stamp(k))
        out.finish()
    return file


def _check(log: Log) -> None:
    """The four topics at their own times, in the columns and signs of a log."""
    middle = int(np.searchsorted(log.time, 0.2 - 1e-9))
    row = {key: values[middle] for key, values in log.columns.items()}
    assert [row[f"angular_velocity_{a}"] for a in "xyz"] == [0.1, 0.2, 20.3]
    assert [row[f"specific_force_{a}"] for a in "xyz"] == [0.5, -0.25, 9.81]
    assert (row["battery_voltage"], row["battery_current"], row["battery_charge"]) == (
        15.5,
        4,
        0.75,
    )
    # joints come 5 ms later, and the level, without a stamp of its own, 2 ms
    assert np.isnan(row["joint_position_1"])
    assert log.columns["joint_position_2"][middle + 2] == -0.5
    assert log.columns["depth"][middle + 1] == 0.45
    assert log.time[middle + 1 : middle + 3] == pytest.approx([0.202, 0.205])
    assert not log.has("orientation")
    assert not log.has("joint_velocity")


LEVEL: dict[str, Any] = {"columns": {"/level/data": "depth"}, "units": {"/level/data": "cm"}}


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_a_rosbag2_becomes_a_log(storage: str, tmp_path: Path) -> None:
    """Either storage gives the same log, from the folder and from the file in it."""
    folder = tmp_path / "recording"
    plugin = rosbag2.StoragePlugin[storage]
    with rosbag2.Writer(folder, version=8, storage_plugin=plugin) as bag:
        for topic, (kind, make) in TOPICS.items():
            connection = bag.add_connection(topic, kind, typestore=STORE)
            for k in range(COUNT):
                bag.write(connection, _stamp(k), STORE.serialize_cdr(make(k), kind))
    _check(ReaderRosbag2(**LEVEL).read(folder)[0])
    (file,) = (path for path in folder.iterdir() if path.suffix in (".db3", ".mcap"))
    _check(ReaderRosbag2(**LEVEL).read(file)[0])


@pytest.mark.parametrize("compression", ["NONE", "ZSTD", "LZ4"])
def test_an_mcap_becomes_a_log(compression: str, tmp_path: Path) -> None:
    """Chunks of each compression give the same log."""
    _check(ReaderMcap(**LEVEL).read(_mcap(tmp_path, compression))[0])


def test_two_sensors_of_one_kind_must_be_chosen(tmp_path: Path) -> None:
    """Two topics that give one channel are refused; topics= settles it."""
    kind = "sensor_msgs/msg/Imu"
    file = _mcap(tmp_path, topics={"/a": (kind, _imu), "/b": (kind, lambda k: _imu(k, True))})
    with pytest.raises(LogError, match=r"'/a' and '/b' both give 'angular_velocity_x'"):
        ReaderMcap().read(file)
    (log,) = ReaderMcap(topics=["/b"]).read(file)
    assert log.columns["orientation_z"][0] == 0.6
    with pytest.raises(LogError, match="no topic '/c'"):
        ReaderMcap(topics=["/c"]).read(file)


def test_the_clock_of_recording_can_be_taken(tmp_path: Path) -> None:
    """clock=record takes the stamps of the recorder, 2 ms late here for every topic."""
    (log,) = ReaderMcap(clock="record").read(_mcap(tmp_path))
    assert np.isfinite(log.columns["joint_position_1"]).all()
    assert log.meta["recording"]["start"] == pytest.approx(START + 0.002, abs=1e-6)


def test_json_topics_are_mapped(tmp_path: Path) -> None:
    """JSON needs no schema: a path into the object names the number."""
    file = tmp_path / "tank.mcap"
    with file.open("wb") as stream:
        out = writer.Writer(stream)
        out.start()
        schema = out.register_schema("tank", "jsonschema", b"{}")
        channel = out.register_channel("/tank", "json", schema)
        for k in range(COUNT):
            text = json.dumps({"gauges": [{"level": k}, {"level": -2 * k}]})
            out.add_message(channel, _stamp(k), text.encode(), _stamp(k))
        out.finish()
    (log,) = ReaderMcap(
        columns={"/tank/gauges[1].level": "depth"}, negate=["/tank/gauges[1].level"]
    ).read(file)
    assert log.columns["depth"].tolist() == [2.0 * k for k in range(COUNT)]
    for path, words in {
        "gauges[7].level": "no entry 7",
        "gauge": "no 'gauge'",
        "gauges": "holds a list",
    }.items():
        with pytest.raises(LogError, match=words):
            ReaderMcap(columns={f"/tank/{path}": "depth"}).read(file)
    with pytest.raises(LogError, match="no topic with a known type"):
        ReaderMcap().read(file)


def test_a_definition_in_a_file_is_never_used(tmp_path: Path) -> None:
    """A type that ROS 2 does not ship is refused: its definition would be run as code."""
    file = tmp_path / "own.mcap"
    with file.open("wb") as stream:
        out = writer.Writer(stream)
        out.start()
        schema = out.register_schema("mine/msg/Own", "ros2msg", b"float64 x\n")
        out.add_message(out.register_channel("/own", "cdr", schema), 1, bytes(12), 1)
        out.finish()
    with pytest.raises(LogError, match=r"'mine/msg/Own' .cdr. cannot be decoded"):
        ReaderMcap(columns={"/own/x": "depth"}).read(file)
    assert "mine/msg/Own" not in STORE.types


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    """A cut MCAP, a cut message and a file that is none end in words."""
    whole = _mcap(tmp_path).read_bytes()
    for name, content in {
        "cut": whole[: len(whole) // 2],
        "tail": whole[:-20],
        "none": b"\x89MCAP1\r\n" + bytes(64),
    }.items():
        file = tmp_path / f"{name}.mcap"
        file.write_bytes(content)
        with pytest.raises(LogError, match=r"valid MCAP|not an MCAP"):
            ReaderMcap().read(file)
    base = tmp_path / "short.db3"
    _database(
        base, "CREATE TABLE messages(id, topic_id, timestamp, data)", [(1, 1, 5, b"\0\1\0\0abc")]
    )
    with pytest.raises(LogError, match="of type 'sensor_msgs/msg/Imu' is damaged"):
        ReaderRosbag2().read(base)


def _chunk(declared: int, compression: bytes, data: bytes) -> bytes:
    body = struct.pack("<QQQI", 0, 0, declared, 0)
    body += struct.pack("<I", len(compression)) + compression + struct.pack("<Q", len(data)) + data
    return b"\x06" + struct.pack("<Q", len(body)) + body


def test_a_chunk_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    """Neither a declared size nor the packed stream itself may grow beyond the bound."""
    import lz4.frame
    import zstandard

    zeros = bytes(1 << 27)
    packed = {b"zstd": zstandard.compress(zeros), b"lz4": lz4.frame.compress(zeros)}
    start = b"\x89MCAP0\r\n\x01" + struct.pack("<Q", 8) + bytes(8)
    for compression, data in packed.items():
        for declared in (1 << 40, 1 << 27, 100):
            file = tmp_path / "bomb.mcap"
            file.write_bytes(start + _chunk(declared, compression, data))
            with pytest.raises(LogError, match=r"a chunk (declares|does not hold)"):
                ReaderMcap().read(file)


def test_a_small_file_of_many_records_is_refused(tmp_path: Path) -> None:
    """Each record is read by itself: a few kilobytes of nothing would take an hour."""
    import zstandard

    nothing = (b"\x7f" + bytes(8)) * (1 << 20)
    chunk = _chunk(len(nothing), b"zstd", zstandard.compress(nothing))
    file = tmp_path / "bomb.mcap"
    file.write_bytes(b"\x89MCAP0\r\n\x01" + struct.pack("<Q", 8) + bytes(8) + chunk)
    with pytest.raises(LogError, match="decompresses to more than"):
        ReaderMcap().read(file)


def _database(path: Path, messages: str, rows: list[tuple[Any, ...]]) -> None:
    path.unlink(missing_ok=True)
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE topics(id, name, type, serialization_format)")
        base.execute("INSERT INTO topics VALUES (1, '/imu', 'sensor_msgs/msg/Imu', 'cdr')")
        base.execute(messages)
        if rows:
            marks = ", ".join("?" * len(rows[0]))
            base.executemany(f"INSERT INTO messages VALUES ({marks})", rows)
    base.close()


ENDLESS = """CREATE VIEW messages AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n)
    SELECT k AS id, 1 AS topic_id, k AS timestamp, x'00' AS data FROM n"""


def test_a_database_is_data_only(tmp_path: Path) -> None:
    """A view that counts for ever, a computed column and words for stamps are refused."""
    file = tmp_path / "bad.db3"
    computed = (
        "CREATE TABLE messages(id, topic_id, timestamp, data GENERATED ALWAYS AS (zeroblob(9)))"
    )
    plain = "CREATE TABLE messages(id, topic_id, timestamp, data)"
    for table, rows, words in (
        (ENDLESS, [], "no table 'messages'"),
        (computed, [], "lacks data"),
        (plain, [(1, 1, "soon", b"\0")], "no stamp"),
        (plain, [(1, 1, 5, bytes((1 << 22) + 1))], "the limit is"),
    ):
        _database(file, table, rows)
        with pytest.raises(LogError, match=words):
            ReaderRosbag2().read(file)


def test_the_files_of_a_bag_lie_in_its_folder(tmp_path: Path) -> None:
    """A name, or a link, that leads out of the folder is refused."""
    outside = _mcap(tmp_path)
    for k, name in enumerate(("..", "/etc/passwd", "linked.mcap", "absent.mcap")):
        folder = tmp_path / f"bag{k}"
        folder.mkdir()
        if name.startswith("linked"):
            (folder / name).symlink_to(outside)
        text = f"rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths: ['{name}']\n"
        (folder / "metadata.yaml").write_text(text)
        with pytest.raises(LogError, match=r"inside the folder|does not exist"):
            ReaderRosbag2().read(folder)


def test_a_field_within_a_field_after_a_slash_is_shown_with_its_dot() -> None:
    """The nearest topic alone would not tell what to write."""
    with pytest.raises(LogError, match=r"with a dot: /base/cmd_vel/linear\.NAME"):
        refuse_unknown(["/base/cmd_vel/linear"], ["/base/cmd_vel"], where="a.bag")
    with pytest.raises(LogError, match="Did you mean '/base/cmd_vel'"):
        refuse_unknown(["/base/cmd_vl"], ["/base/cmd_vel"], where="a.bag")
