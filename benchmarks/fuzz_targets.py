"""Fuzz target: a valid file, its location, and the function that loads it."""

from __future__ import annotations

import io
import json
import sqlite3
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

_META = "format: hidden-effect-log\nformat_version: 1\nvehicle: {name: a, mass: 1.5}\n"
_CSV = "t,depth,specific_force_z\n" + "".join(f"{k / 100},{k % 7},9.81\n" for k in range(40))
_WIT = "StartTime: 1\nTime(s)\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\n" + "".join(
    f" 10:00:00.{k:03}\t0.1\t0.2\t1\t3\t4\t5\n" for k in range(30)
)
URDF = (
    '<?xml version="1.0"?><robot name="r"><link name="base">'
    '<inertial><origin xyz="0 0 0" rpy="0 0 0"/><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    '<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>'
)
_ROBOT = (
    "urdf: r.urdf\nsummary: a box\n"
    "hulls:\n  base: {shapes: [{type: box, size: [1, 1, 1]}]}\n"
    "effects:\n  buoyancy: {effect: buoyancy}\n  friction: {effect: linear_drag}\n"
)
_KEYS = "t,control,value\n0.5,w,1.0\n1.0,w,0.0\n2.5,q,0.5\n"
_KEYS_YAML = "- {t: 0.5, hold: w, seconds: 2}\n- {t: 3, hold: q, seconds: 1}\n"


@dataclass(kw_only=True)
class Target:
    """One loader.

    Args:
        whole: a sound file.
        name: how the file is called.
        load: takes the path.
        beside: files that lie beside it, by name.
        folder: whether the loader is given the folder.
        draw: draws a file that is hostile and well-formed; None damages the sound one.
    """

    whole: bytes
    name: str
    load: Callable[[Path], Any]
    beside: dict[str, bytes] = field(default_factory=dict)
    folder: bool = False
    draw: Callable[[Random], bytes] | None = None

    def place(self, folder: Path, content: bytes) -> Path:
        """Write the file to its location and return the argument of the loader."""
        for name, raw in self.beside.items():
            self._write(folder / name, raw)
        self._write(folder / self.name, content)
        return folder if self.folder else folder / self.name

    @staticmethod
    def _write(path: Path, content: bytes) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def checked(reader: Any) -> Callable[[Path], None]:
    """Return a function that reads and checks a log."""
    from seals.logs import check_log

    def load(path: Path) -> None:
        for log in reader.read(path):
            check_log(log)

    return load


def robot_folder(
    whole: bytes, load: Callable[[Path], Any], draw: Callable[[Random], bytes] | None = None
) -> Target:
    """Return the target of a robot's file in a folder with its URDF."""
    urdf = {"r.urdf": URDF.encode()}
    return Target(whole=whole, name="robot.yaml", load=load, beside=urdf, folder=True, draw=draw)


def _native(table: str) -> Target:
    from seals.plugins.readers.native import ReaderNative

    load = checked(ReaderNative())
    if table == "meta.yaml":
        beside = {"log.csv": _CSV.encode()}
        return Target(whole=_META.encode(), name=table, load=load, beside=beside, folder=True)
    columns = {"t": np.arange(40) / 100, "depth": np.sin(np.arange(40.0))}
    whole = _CSV.encode() if table == "log.csv" else parquet_of(columns, compression="zstd")
    return Target(
        whole=whole, name=table, load=load, beside={"meta.yaml": _META.encode()}, folder=True
    )


def parquet_of(columns: dict[str, Any], **options: Any) -> bytes:
    """Return a table as a Parquet file."""
    import pyarrow as pa
    from pyarrow import parquet

    stream = io.BytesIO()
    parquet.write_table(pa.table(columns), stream, **options)
    return stream.getvalue()


def _csv() -> Target:
    from seals.plugins.readers.csv import ReaderCsv

    return Target(whole=_CSV.encode(), name="a.csv", load=checked(ReaderCsv()))


def _witmotion() -> Target:
    from seals.plugins.readers.witmotion import ReaderWitmotion

    return Target(whole=_WIT.encode(), name="a.txt", load=checked(ReaderWitmotion()))


def _ulog() -> Target:
    import struct

    from seals.plugins.readers.ulog import ReaderUlog

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    whole = b"ULog\x01\x12\x35\x01" + bytes(8) + message("B", bytes(40))
    whole += message("F", b"vehicle_attitude:uint64_t timestamp;float[4] q;e x;")
    whole += message("F", b"e:uint8_t[3] a;") + message("A", b"\0\x01\0vehicle_attitude")
    for k in range(30):
        whole += message("D", struct.pack("<HQ4f3s", 1, 4000 * k, 1.0, 0.0, 0.0, 0.1 * k, b"abc"))
    return Target(whole=whole, name="a.ulg", load=checked(ReaderUlog()))


def _imu() -> bytes:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    stamp = kinds["builtin_interfaces/msg/Time"](sec=5, nanosec=6)
    vector = kinds["geometry_msgs/msg/Vector3"](x=1.0, y=2.0, z=3.0)
    message = kinds["sensor_msgs/msg/Imu"](
        header=kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="a"),
        orientation=kinds["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=np.zeros(9),
        angular_velocity=vector,
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector,
        linear_acceleration_covariance=np.zeros(9),
    )
    return bytes(store.serialize_cdr(message, "sensor_msgs/msg/Imu"))


def _mcap(compression: str) -> Target:
    from mcap.writer import CompressionType, Writer

    from seals.plugins.readers.recording import ReaderMcap

    stream, raw = io.BytesIO(), _imu()
    out = Writer(stream, compression=CompressionType[compression], chunk_size=2048)
    out.start()
    schema = out.register_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
    imu = out.register_channel("/imu", "cdr", schema)
    tank = out.register_channel("/tank", "json", out.register_schema("tank", "jsonschema", b"{}"))
    for k in range(20):
        out.add_message(imu, k * 10**7, raw, k * 10**7)
        out.add_message(tank, k * 10**7, json.dumps({"a": [k, {"b": k}]}).encode(), k * 10**7)
    out.finish()
    reader = ReaderMcap(clock="record", columns={"/tank/a[1].b": "depth"})
    return Target(whole=stream.getvalue(), name="a.mcap", load=checked(reader))


def bag_of(path: Path, kind: str, rows: list[tuple[Any, ...]]) -> sqlite3.Connection:
    """Return the database of a bag of ROS 2 with one topic, its rows written."""
    base = sqlite3.connect(path)
    base.execute("PRAGMA page_size = 512")
    base.execute("PRAGMA synchronous = OFF")
    base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format)")
    base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, data)")
    base.execute("INSERT INTO topics VALUES (1, '/imu', ?, 'cdr')", (kind,))
    base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
    base.commit()
    return base


def _rosbag2() -> Target:
    from seals.plugins.readers.recording import ReaderRosbag2

    path = Path(tempfile.mkdtemp()) / "a.db3"
    bag_of(path, "sensor_msgs/msg/Imu", [(1, k * 10**7, _imu()) for k in range(10)]).close()
    reader = ReaderRosbag2(clock="record")
    return Target(whole=path.read_bytes(), name="a.db3", load=checked(reader))


def _urdf() -> Target:
    from seals.robot.urdf import read_urdf

    return Target(whole=URDF.encode(), name="r.urdf", load=read_urdf)


def _robot() -> Target:
    from seals.robot.robot_file import read_robot

    return robot_folder(_ROBOT.encode(), read_robot)


def _built() -> Target:
    """A robot folder as ``seals run robot=FOLDER`` takes it, up to the world."""
    from seals.api import make

    def load(folder: Path) -> None:
        make([f"robot='{folder}'", "backend=free"]).close()

    return robot_folder(_ROBOT.encode(), load)


def _mesh(ending: str) -> Target:
    import trimesh

    from seals.hydrostatics.meshes import hull_from_mesh

    box: Any = trimesh.creation.box((0.5, 0.4, 0.3))
    raw = box.export(file_type=ending)
    whole = raw.encode() if isinstance(raw, str) else bytes(raw)
    return Target(whole=whole, name=f"a.{ending}", load=hull_from_mesh)


def _keys(name: str, text: str) -> Target:
    from seals.control.key_events import read_track

    return Target(whole=text.encode(), name=name, load=read_track)


def _array() -> Target:
    from seals.logs.arrays import read_npy

    stream = io.BytesIO()
    np.save(stream, np.arange(12.0).reshape(3, 4))
    return Target(whole=stream.getvalue(), name="a.npy", load=read_npy)


TARGETS: dict[str, Callable[[], Target]] = {
    "meta": lambda: _native("meta.yaml"),
    "parquet": lambda: _native("log.parquet"),
    "native_csv": lambda: _native("log.csv"),
    "csv": _csv,
    "witmotion": _witmotion,
    "ulog": _ulog,
    "mcap": lambda: _mcap("NONE"),
    "mcap_zstd": lambda: _mcap("ZSTD"),
    "mcap_lz4": lambda: _mcap("LZ4"),
    "rosbag2": _rosbag2,
    "urdf": _urdf,
    "robot": _robot,
    "robot_built": _built,
    "stl": lambda: _mesh("stl"),
    "obj": lambda: _mesh("obj"),
    "dae": lambda: _mesh("dae"),
    "ply": lambda: _mesh("ply"),
    "off": lambda: _mesh("off"),
    "glb": lambda: _mesh("glb"),
    "keys_csv": lambda: _keys("a.csv", _KEYS),
    "keys_yaml": lambda: _keys("a.yaml", _KEYS_YAML),
    "npy": _array,
}
"""Readers of logs, robots and scripts by name; each entry makes its target where it is fuzzed."""
