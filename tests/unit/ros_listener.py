"""A node of ROS 2 on zenoh that shares no code with SEALS: CDR is read by message definitions.

``python ros_listener.py PORT SECONDS`` listens, sends velocities, and prints what it saw as JSON.
"""

from __future__ import annotations

import json
import re
import struct
import sys
import time
from typing import Any

import zenoh

DEFINITIONS = {
    "Time": "int32 sec; uint32 nanosec",
    "Header": "Time stamp; string frame_id",
    "Vector3": "float64 x; float64 y; float64 z",
    "Quaternion": "float64 x; float64 y; float64 z; float64 w",
    "Pose": "Vector3 position; Quaternion orientation",
    "Twist": "Vector3 linear; Vector3 angular",
    "Transform": "Vector3 translation; Quaternion rotation",
    "TransformStamped": "Header header; string child_frame_id; Transform transform",
    "TFMessage": "TransformStamped[] transforms",
    "PoseWithCovariance": "Pose pose; float64[36] covariance",
    "TwistWithCovariance": "Twist twist; float64[36] covariance",
    "Odometry": "Header header; string child_frame_id; PoseWithCovariance pose; "
    "TwistWithCovariance twist",
    "Imu": "Header header; Quaternion orientation; float64[9] orientation_covariance; "
    "Vector3 angular_velocity; float64[9] angular_velocity_covariance; "
    "Vector3 linear_acceleration; float64[9] linear_acceleration_covariance",
    "FluidPressure": "Header header; float64 fluid_pressure; float64 variance",
    "Range": "Header header; uint8 radiation_type; float32 field_of_view; float32 min_range; "
    "float32 max_range; float32 range; float32 variance",
    "JointState": "Header header; string[] name; float64[] position; float64[] velocity; "
    "float64[] effort",
    "Clock": "Time clock",
    "Image": "Header header; uint32 height; uint32 width; string encoding; uint8 is_bigendian; "
    "uint32 step; uint8[] data",
    "RegionOfInterest": "uint32 x_offset; uint32 y_offset; uint32 height; uint32 width; "
    "bool do_rectify",
    "CameraInfo": "Header header; uint32 height; uint32 width; string distortion_model; "
    "float64[] d; float64[9] k; float64[9] r; float64[12] p; uint32 binning_x; uint32 binning_y; "
    "RegionOfInterest roi",
    "PointField": "string name; uint32 offset; uint8 datatype; uint32 count",
    "PointCloud2": "Header header; uint32 height; uint32 width; PointField[] fields; "
    "bool is_bigendian; uint32 point_step; uint32 row_step; uint8[] data; bool is_dense",
}
NUMBERS = {
    "bool": "?",
    "uint8": "B",
    "int32": "i",
    "uint32": "I",
    "float32": "f",
    "float64": "d",
}


class Cdr:
    """Reader of little-endian plain CDR; alignment counts from behind the four bytes in front."""

    def __init__(self, raw: bytes) -> None:
        """Check the encapsulation."""
        assert raw[:4] == b"\x00\x01\x00\x00", raw[:4]
        self.raw, self.at = raw[4:], 0

    def number(self, kind: str) -> Any:
        """Return a number."""
        form = NUMBERS[kind]
        size = struct.calcsize(form)
        self.at += -self.at % size
        (value,) = struct.unpack_from(f"<{form}", self.raw, self.at)
        self.at += size
        return value

    def value(self, kind: str) -> Any:
        """Return a value of a type: a number, a text, an array, or a message."""
        array = re.fullmatch(r"(\w+)\[(\d*)\]", kind)
        if array:
            count = int(array[2]) if array[2] else self.number("uint32")
            return [self.value(array[1]) for _ in range(count)]
        if kind in NUMBERS:
            return self.number(kind)
        if kind == "string":
            size = self.number("uint32")
            text = self.raw[self.at : self.at + size - 1].decode()
            self.at += size
            return text
        fields = (field.split() for field in DEFINITIONS[kind].split("; "))
        return {name: self.value(part) for part, name in fields}


def decode(kind: str, raw: bytes) -> Any:
    """Return a message as plain data; every byte must be read, but for padding at the end."""
    reader = Cdr(raw)
    found = reader.value(kind)
    assert len(reader.raw) - reader.at < 4
    return found


def twist(forward: float) -> bytes:
    """Return a Twist."""
    return b"\x00\x01\x00\x00" + struct.pack("<6d", forward, 0, 0, 0, 0, 0)


def listen(port: int, seconds: float) -> dict[str, Any]:
    """Listen to all topics of domain 7; send velocities and rubbish."""
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "listen/endpoints": [f"tcp/127.0.0.1:{port}"],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    seen: dict[str, Any] = {"counts": {}, "keys": {}, "last": {}, "tokens": [], "numbers": {}}

    def hear(sample: Any) -> None:
        key = str(sample.key_expr)
        topic, kind, _ = key.removeprefix("7/").rsplit("/", 2)
        name = kind.rstrip("_").rpartition("::")[2]
        if topic.endswith("cmd_vel"):
            return
        extra = bytes(sample.attachment)
        number, stamp, size = struct.unpack_from("<qqB", extra)
        assert size == 16
        assert len(extra) == 33
        assert abs(stamp / 1e9 - time.time()) < 60.0
        seen["numbers"].setdefault(topic, []).append(number)
        seen["counts"][topic] = seen["counts"].get(topic, 0) + 1
        seen["keys"][topic] = key
        seen["last"][topic] = decode(name, bytes(sample.payload))

    with zenoh.open(config) as session:

        def meet(sample: Any) -> None:
            """Subscribe to a topic whose publisher is in the graph, by its exact key."""
            token = str(sample.key_expr)
            seen["tokens"].append(token)
            if "/MP/" in token:
                topic, shape, type_hash = token.split("/")[9:12]
                key = f"7{topic.replace('%', '/')}/{shape}/{type_hash}"
                ears.append(session.declare_subscriber(key, hear))

        ears: list[Any] = []
        session.liveliness().declare_subscriber("@ros2_lv/7/**", meet)
        kind = "geometry_msgs::msg::dds_::Twist_"
        key = f"7/boat/cmd_vel/{kind}/{sys.argv[3]}"
        print("ready", flush=True)
        end = time.monotonic() + seconds
        while time.monotonic() < end and "over" not in seen:
            session.put(key, b"rubbish")
            session.put(key, twist(0.4))
            time.sleep(0.05)
            clock = seen["last"].get("boat/clock", {}).get("clock", {"sec": 0, "nanosec": 0})
            if clock["sec"] + clock["nanosec"] * 1e-9 > 1.9:
                break
        time.sleep(0.2)
    seen["numbers"] = {
        topic: found == list(range(found[0], found[0] + len(found)))
        for topic, found in seen["numbers"].items()
    }
    return seen


if __name__ == "__main__":
    print(json.dumps(listen(int(sys.argv[1]), float(sys.argv[2]))))
