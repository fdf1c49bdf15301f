"""Command line: flights of one quadrotor as its autopilot and a ROS 2 recorder would log them.

The first flight becomes a ULog file, written after the public description of the format
(https://docs.px4.io/main/en/dev_log/ulog_file_format.html); the second an MCAP of ROS 2 messages,
written by the packages mcap and rosbags. Beside them stands a URDF of the nominal vehicle.
"""

from __future__ import annotations

import argparse
import gzip
import struct
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.validation.hidden import equivalents, flights, gain, generate, writing
from tests.validation.hidden.batch import Flight
from tests.validation.hidden.rotation import Array
from tests.validation.hidden.vehicles import Vehicle

START = 1_000_000
BLADE_MASS = 0.015
NOTHING = (0.0, 0.0, 0.0, True, True, False, False)
"""A velocity that the autopilot calls invalid, beside a place that is valid."""
FORMATS = {
    "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
    "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;"
    "uint32_t accelerometer_integral_dt;",
    "vehicle_attitude": "uint64_t timestamp;uint64_t timestamp_sample;float[4] q;",
    "vehicle_local_position": "uint64_t timestamp;float x;float y;float z;float vx;float vy;"
    "float vz;bool xy_valid;bool z_valid;bool v_xy_valid;bool v_z_valid;",
    "actuator_motors": "uint64_t timestamp;uint64_t timestamp_sample;float[12] control;",
    "battery_status": "uint64_t timestamp;float voltage_v;float current_a;float remaining;",
}
PACKED = {
    "sensor_combined": "<Q3fIi3fI",
    "vehicle_attitude": "<QQ4f",
    "vehicle_local_position": "<Q6f????",
    "actuator_motors": "<QQ12f",
    "battery_status": "<Q3f",
}


def _rotation(q: Array) -> Array:
    """Matrices (n, 3, 3) of quaternions w, x, y, z, shape (n, 4)."""
    w, x, y, z = q.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def _aerospace(q: Array) -> Array:
    """Quaternions w, x, y, z from FRD to NED of those from FLU to ENU."""
    from scipy.spatial.transform import Rotation

    ned = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    held = np.isfinite(q).all(axis=1)
    turned = ned @ _rotation(q[held]) @ np.diag([1.0, -1.0, -1.0])
    out = np.full(q.shape, np.nan)
    out[held] = np.roll(Rotation.from_matrix(turned).as_quat(), 1, axis=1)
    return out


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def _vectors(frame: Any, stem: str) -> Array:
    suffixes = "wxyz" if stem == "orientation" else "xyz"
    return frame[[f"{stem}_{axis}" for axis in suffixes]].to_numpy(dtype=float)


def write_ulog(frame: Any, vehicle: Vehicle, file: Path) -> None:
    """Write a flight as PX4 logs it, gzipped: NED, FRD, shares of thrust, microseconds."""
    stamps = START + np.round((frame["t"] - frame["t"].iloc[0]) * 1e6).astype(int).to_numpy()
    gyro, force = _vectors(frame, "angular_velocity"), _vectors(frame, "specific_force")
    place, q = _vectors(frame, "position"), _aerospace(_vectors(frame, "orientation"))
    speed = frame[[f"rotor_speed_cmd_{k + 1}" for k in range(vehicle.count)]].to_numpy(dtype=float)
    volts = frame["battery_voltage"].to_numpy(dtype=float)
    share = np.pad((speed / vehicle.limit) ** 2, ((0, 0), (0, 12 - vehicle.count)))
    share[:, vehicle.count :] = np.nan
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", START), _message("B", bytes(40))]
    out += [_message("F", f"{name}:{fields}".encode()) for name, fields in FORMATS.items()]
    out += [
        _message("A", struct.pack("<BH", 0, k) + name.encode()) for k, name in enumerate(FORMATS)
    ]
    held = np.isfinite(place).all(axis=1) & np.isfinite(q).all(axis=1)
    number = {name: k for k, name in enumerate(FORMATS)}

    def data(name: str, *values: Any) -> None:
        body = struct.pack("<H", number[name]) + struct.pack(PACKED[name], *values)
        out.append(_message("D", body))

    for k, stamp in enumerate(map(int, stamps)):
        gx, gy, gz = gyro[k]
        ax, ay, az = force[k]
        data("sensor_combined", stamp, gx, -gy, -gz, 10_000, 0, ax, -ay, -az, 10_000)
        data("actuator_motors", stamp, stamp, *share[k])
        if held[k]:
            data("vehicle_attitude", stamp, stamp, *q[k])
            east, north, up = place[k]
            data("vehicle_local_position", stamp, north, east, -up, *NOTHING)
        if np.isfinite(volts[k]):
            data("battery_status", stamp, volts[k], -1.0, -1.0)
    file.write_bytes(gzip.compress(b"".join(out), mtime=0))


def write_mcap(frame: Any, vehicle: Vehicle, file: Path) -> None:
    """Write a flight as a ROS 2 recorder does: ENU, FLU, pulse widths."""
    from mcap.writer import CompressionType, IndexType, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    made = store.types
    gyro, force = _vectors(frame, "angular_velocity"), _vectors(frame, "specific_force")
    place, turn = _vectors(frame, "position"), _vectors(frame, "orientation")
    speed = frame[[f"rotor_speed_cmd_{k + 1}" for k in range(vehicle.count)]].to_numpy(dtype=float)
    pulse = 1000.0 + 1000.0 * speed / vehicle.limit
    vector, quaternion = made["geometry_msgs/msg/Vector3"], made["geometry_msgs/msg/Quaternion"]

    def header(ns: int) -> Any:
        stamp = made["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
        return made["std_msgs/msg/Header"](stamp=stamp, frame_id="base_link")

    def imu(k: int, ns: int) -> Any:
        return made["sensor_msgs/msg/Imu"](
            header=header(ns),
            orientation=quaternion(x=0.0, y=0.0, z=0.0, w=0.0),
            orientation_covariance=np.full(9, -1.0),
            angular_velocity=vector(*gyro[k]),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector(*force[k]),
            linear_acceleration_covariance=np.zeros(9),
        )

    def pose(k: int, ns: int) -> Any:
        w, x, y, z = turn[k]
        return made["geometry_msgs/msg/PoseStamped"](
            header=header(ns),
            pose=made["geometry_msgs/msg/Pose"](
                position=made["geometry_msgs/msg/Point"](*place[k]),
                orientation=quaternion(x=x, y=y, z=z, w=w),
            ),
        )

    def motors(k: int, ns: int) -> Any:
        layout = made["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        data = pulse[k].astype(np.float32)
        return made["std_msgs/msg/Float32MultiArray"](layout=layout, data=data)

    topics = {
        "/imu": ("sensor_msgs/msg/Imu", imu, np.isfinite(gyro).all(axis=1)),
        "/motors": ("std_msgs/msg/Float32MultiArray", motors, np.isfinite(pulse).all(axis=1)),
        "/pose": ("geometry_msgs/msg/PoseStamped", pose, np.isfinite(place).all(axis=1)),
    }
    first = 1_700_000_000 * 10**9
    with file.open("wb") as stream:
        # an index of every message would be a third of the file
        kept = IndexType.ALL & ~IndexType.MESSAGE
        out = Writer(stream, compression=CompressionType.ZSTD, index_types=kept)
        out.start()
        channels = {}
        for topic, (kind, _, _) in topics.items():
            schema = out.register_schema(kind, "ros2msg", b"")
            channels[topic] = out.register_channel(topic, "cdr", schema)
        for k, time in enumerate(frame["t"] - frame["t"].iloc[0]):
            ns = first + round(float(time) * 1e6) * 1000
            for topic, (kind, make, there) in topics.items():
                if there[k]:
                    raw = bytes(store.serialize_cdr(make(k, ns), kind))
                    out.add_message(channels[topic], ns, raw, ns, k)
        out.finish()


def urdf(vehicle: Vehicle) -> str:
    """Return a description of the nominal vehicle; the whole has the stated mass and inertia."""
    places = vehicle.positions.T
    hull = vehicle.mass - vehicle.count * BLADE_MASS
    centre = -BLADE_MASS * places.sum(axis=0) / hull
    inertia = np.diag(vehicle.inertia)
    for mass, place in [(hull, centre), *((BLADE_MASS, p) for p in places)]:
        inertia = inertia - mass * (place @ place * np.eye(3) - np.outer(place, place))
    lines = ['<?xml version="1.0"?>', '<robot name="quad">', '  <link name="base_link">']
    ixx, iyy, izz = (f"{x:.8f}" for x in np.diag(inertia))
    lines += [
        f'    <inertial><origin xyz="{" ".join(f"{x:.8f}" for x in centre)}"/>'
        f'<mass value="{hull:.6f}"/><inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" '
        f'izz="{izz}"/></inertial>',
        '    <collision><geometry><box size="0.2 0.14 0.06"/></geometry></collision>',
        "  </link>",
    ]
    for k, place in enumerate(places, 1):
        xyz = " ".join(f"{x:.6g}" for x in place)
        lines += [
            f'  <link name="rotor_{k}"><inertial><mass value="{BLADE_MASS}"/>'
            '<inertia ixx="1e-9" ixy="0" ixz="0" iyy="1e-9" iyz="0" izz="1e-9"/></inertial></link>',
            f'  <joint name="rotor_{k}_joint" type="fixed"><parent link="base_link"/>'
            f'<child link="rotor_{k}"/><origin xyz="{xyz}"/></joint>',
        ]
    return "\n".join([*lines, "</robot>", ""])


def produce(out: Path, truth: Path, *, effect: str, seed: int) -> Vehicle:
    """Fly twice, write both recordings, the description, and the truth apart."""
    spec = generate.plan(1, seed, level="clear", vehicle="quad", effect=effect)[0]
    made = flights.cases(spec, 2)
    flight = Flight(made, seed)
    equivalents.settle(flight)
    flight.excess()
    made[0].found["gains"] = gain.measure(flight, 0)
    good, _ = generate.judge(made[0])
    if not good:
        raise SystemExit(f"seed {seed} gives no case of level {spec.level}: take another")
    readings = flight.readings()
    vehicle = made[0].vehicle
    (out / "quad_description" / "urdf").mkdir(parents=True, exist_ok=True)
    write_ulog(writing.table(flight, 0, readings), vehicle, out / "flight_1.ulg.gz")
    write_mcap(writing.table(flight, 1, readings), vehicle, out / "flight_2.mcap")
    (out / "quad_description" / "urdf" / "quad.urdf").write_text(urdf(vehicle), encoding="utf-8")
    text = yaml.safe_dump(writing.truth(made[0]), sort_keys=False)
    truth.write_text(text, encoding="utf-8")
    return vehicle


def main(argv: list[str] | None = None) -> int:
    """Parse the arguments, fly and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--truth", type=Path, required=True, help="file for what is hidden")
    parser.add_argument("--effect", default="weak_rotor")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(argv)
    produce(args.out, args.truth, effect=args.effect, seed=args.seed)
    print(f"two flights in {args.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
