"""ROS 2 messages of the state and the sensor readings of a run."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import optional_import
from seals.frames import quaternion_of
from seals.plugin_options import options_of
from seals.rendering.camera_view import Shot
from seals.rendering.optics import to_bytes
from seals.sensors.mount import Mount
from seals.sensors.options import SensorOptions
from seals.world import World
from seals.world.actor import Actor
from seals.world.sensor_suite import carrier_of

ROBOT = "robot"
"""Actor that the messages are of."""
WORLD = "world"
"""Frame of the world: east-north-up."""
ATMOSPHERE = 101325.0
"""Pressure at the water surface [Pa]: messages hold absolute pressures, sensors gauge ones."""
UNKNOWN = -1.0
"""First entry of a covariance whose quantity is not measured."""


STATE = {
    "clock": "rosgraph_msgs/msg/Clock",
    "odom": "nav_msgs/msg/Odometry",
    "tf": "tf2_msgs/msg/TFMessage",
    "joint_states": "sensor_msgs/msg/JointState",
}
"""Type of each topic of the state."""
READINGS = ("Imu", "FluidPressure", "Range", "MagneticField")
"""Types of the topic of a sensor, one of which it has."""


class Message(NamedTuple):
    """Message on a topic.

    Args:
        topic: its name without the leading slash.
        kind: type, such as ``sensor_msgs/msg/Imu``.
        value: the message, an object of the type store.
    """

    topic: str
    kind: str
    value: Any


@functools.cache
def _type_store() -> Any:
    """Return the message types of ROS 2.

    Raises:
        MissingExtra: rosbags is not installed.
    """
    with optional_import("ROS messages need rosbags", "Install it: pip install 'aam-seals[ros2]'"):
        from rosbags.typesys import Stores, get_typestore
    return get_typestore(Stores.ROS2_JAZZY)


class Messages:
    """Maker of the messages of a run."""

    def __init__(self) -> None:
        self.store = _type_store()

    def make(self, kind: str, **values: Any) -> Any:
        """Return a message of a type."""
        return self.store.types[kind](**values)

    def stamp(self, time: float) -> Any:
        """Return a time [s] as a message."""
        whole = round(time * 1e9)
        return self.make("builtin_interfaces/msg/Time", sec=whole // 10**9, nanosec=whole % 10**9)

    def header(self, time: float, frame: str) -> Any:
        """Return a header."""
        return self.make("std_msgs/msg/Header", stamp=self.stamp(time), frame_id=frame)

    def vector(self, values: Floats, kind: str = "Vector3") -> Any:
        """Return three numbers as a ``Vector3`` or a ``Point``."""
        x, y, z = (float(value) for value in values)
        return self.make(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)

    def turn(self, rotation: Floats) -> Any:
        """Return a rotation matrix as a quaternion."""
        x, y, z, w = (float(value) for value in quaternion_of(rotation))
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def topics(self, sensors: Iterable[str]) -> list[tuple[str, str]]:
        """Return topic and type of all messages that a run with these sensors may have."""
        found = list(STATE.items())
        for name in sensors:
            found += [(name, f"sensor_msgs/msg/{kind}") for kind in READINGS]
            found += [(f"{name}/{topic}", kind) for topic, kind in CAMERA.items()]
        return found

    def clock(self, time: float) -> Message:
        """Return the simulated time."""
        kind = STATE["clock"]
        return Message("clock", kind, self.make(kind, clock=self.stamp(time)))

    def state(self, world: World) -> Iterator[Message]:
        """Yield pose and twist of the robot, its joints, and the frames of all links."""
        actor: Actor = world.actors[ROBOT]
        kinematics, moving = actor.look()
        robot, now = actor.robot, world.time
        origins, turns = kinematics.origins[0], kinematics.rotations[0]
        pose = self.make(
            "geometry_msgs/msg/Pose",
            position=self.vector(origins[0], "Point"),
            orientation=self.turn(turns[0]),
        )
        twist = self._twist(moving.twists[0, 0])
        covariance = np.zeros(36)
        kind = STATE["odom"]
        yield Message(
            "odom",
            kind,
            self.make(
                kind,
                header=self.header(now, WORLD),
                child_frame_id=robot.links[0],
                pose=self.make(
                    "geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=covariance
                ),
                twist=self.make(
                    "geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=covariance
                ),
            ),
        )
        frames = [
            self._frame(now, WORLD, name, origins[k], turns[k])
            for k, name in enumerate(robot.links)
        ]
        frames += [self._frame(now, *mounted) for mounted in _mounted(actor)]
        kind = STATE["tf"]
        yield Message("tf", kind, self.make(kind, transforms=frames))
        if robot.joints:
            kind = STATE["joint_states"]
            speed = moving.speed[0, -len(robot.joints) :]
            joints = self.make(
                kind,
                header=self.header(now, ""),
                name=list(robot.joints),
                position=np.array(actor.body.joint_positions(), dtype=float),
                velocity=np.array(speed, dtype=float),
                effort=np.zeros(0),
            )
            yield Message("joint_states", kind, joints)

    def readings(self, world: World) -> Iterator[Message]:
        """Yield a message for each reading that arrived after the last step."""
        actor: Actor = world.actors[ROBOT]
        for taken, name, values in actor.sensor_suite.arrived:
            yield from self._reading(actor, name, taken, values)

    def _twist(self, twist: Floats) -> Any:
        linear, angular = self.vector(twist[:3]), self.vector(twist[3:])
        return self.make("geometry_msgs/msg/Twist", linear=linear, angular=angular)

    def _frame(self, time: float, parent: str, child: str, origin: Floats, turn: Floats) -> Any:
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.vector(origin),
            rotation=self.turn(turn),
        )
        return self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(time, parent),
            child_frame_id=child,
            transform=transform,
        )

    def _reading(
        self, actor: Actor, name: str, time: float, values: Mapping[str, Floats]
    ) -> Iterator[Message]:
        """Yield the messages of one reading; none for channels that no usual message has."""
        head = self.header(time, name)
        first = {channel: float(np.reshape(value, -1)[0]) for channel, value in values.items()}
        if "specific_force" in values and "angular_velocity" in values:
            yield self._imu(name, head, values)
        elif "pressure" in values:
            kind = "sensor_msgs/msg/FluidPressure"
            absolute = first["pressure"] + ATMOSPHERE
            yield Message(
                name, kind, self.make(kind, header=head, fluid_pressure=absolute, variance=0.0)
            )
        elif "range" in values:
            yield self._range(actor, name, head, first["range"])
        elif "magnetic_field" in values:
            kind = "sensor_msgs/msg/MagneticField"
            value = self.vector(values["magnetic_field"])
            unknown = np.zeros(9)
            yield Message(
                name,
                kind,
                self.make(
                    kind, header=head, magnetic_field=value, magnetic_field_covariance=unknown
                ),
            )
        elif "picture" in values:
            view = actor.sensor_suite.cameras.get(name)
            if view is not None and isinstance(view.shot, Shot):
                for topic, kind, value in camera_messages(self.store, head, view.shot):
                    yield Message(f"{name}/{topic}", kind, value)

    def _imu(self, name: str, head: Any, values: Mapping[str, Floats]) -> Message:
        kind, unknown = "sensor_msgs/msg/Imu", np.zeros(9)
        absent = np.array([UNKNOWN, *[0.0] * 8])
        imu = self.make(
            kind,
            header=head,
            orientation=self.turn(np.eye(3)),
            orientation_covariance=absent,
            angular_velocity=self.vector(values["angular_velocity"]),
            angular_velocity_covariance=unknown,
            linear_acceleration=self.vector(values["specific_force"]),
            linear_acceleration_covariance=unknown,
        )
        return Message(name, kind, imu)

    def _range(self, actor: Actor, name: str, head: Any, value: float) -> Message:
        kind, limits = "sensor_msgs/msg/Range", options_of(actor.sensors[name], _Limits)
        echo = self.make(
            kind,
            header=head,
            radiation_type=0,
            field_of_view=0.0,
            min_range=float(limits.nearest),
            max_range=float(limits.farthest),
            range=value,
            variance=0.0,
        )
        return Message(name, kind, echo)


class _Limits:
    """Distances between which a range finder measures [m], where it states them."""

    nearest: float = 0.0
    farthest: float = math.inf


def _mounted(actor: Actor) -> Iterator[tuple[str, str, Floats, Floats]]:
    """Yield link, name, place and turn of every sensor; a camera's are its optical axes."""
    from seals.rendering.camera import OPTICAL

    for name, sensor in actor.sensors.items():
        own = options_of(sensor, SensorOptions)
        mount = Mount(name, own.position or [0.0, 0.0, 0.0], own.rpy or [0.0, 0.0, 0.0])
        turn = mount.turn @ OPTICAL if name in actor.sensor_suite.cameras else mount.turn
        yield actor.robot.links[carrier_of(name, sensor, actor.robot)], name, mount.arm, turn


CAMERA = {
    "image_raw": "sensor_msgs/msg/Image",
    "camera_info": "sensor_msgs/msg/CameraInfo",
    "depth/image_raw": "sensor_msgs/msg/Image",
    "points": "sensor_msgs/msg/PointCloud2",
}
"""Type of each topic of a camera, below its name."""


def camera_messages(store: Any, head: Any, shot: Shot) -> Iterator[tuple[str, str, Any]]:
    """Yield topic, type and message of the outputs of a camera: image, depth, points, intrinsics.

    Args:
        store: message types.
        head: header in the camera's optical frame.
        shot: the image.
    """
    depth = np.asarray(shot.picture.depth, dtype=np.float32)
    if "rgb" in shot.what:
        colour = to_bytes(np.asarray(shot.picture.colour))
        yield "image_raw", CAMERA["image_raw"], _image(store, head, colour, "rgb8")
    lens = shot.lens
    k = np.array([lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0])
    # ROS counts pixels from the middle of the first one
    k[[2, 5]] -= 0.5
    region = store.types["sensor_msgs/msg/RegionOfInterest"](
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    yield (
        "camera_info",
        CAMERA["camera_info"],
        store.types["sensor_msgs/msg/CameraInfo"](
            header=head,
            height=lens.height,
            width=lens.width,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=k,
            r=np.eye(3).reshape(-1),
            p=np.insert(k.reshape(3, 3), 3, 0.0, axis=1).reshape(-1),
            binning_x=0,
            binning_y=0,
            roi=region,
        ),
    )
    if "depth" in shot.what:
        # where nothing is met the depth is infinite, as REP 118 has it
        yield "depth/image_raw", CAMERA["depth/image_raw"], _image(store, head, depth, "32FC1")
        yield "points", CAMERA["points"], _points(store, head, shot, depth)


def _image(store: Any, head: Any, pixels: Any, encoding: str) -> Any:
    rows = np.ascontiguousarray(pixels)
    height, width = rows.shape[:2]
    raw = rows.view(np.uint8).reshape(-1)
    return store.types["sensor_msgs/msg/Image"](
        header=head,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=len(raw) // height,
        data=raw,
    )


def _points(store: Any, head: Any, shot: Shot, depth: Any) -> Any:
    """Points in optical axes, of all pixels where something is met."""
    lens = shot.lens
    v, u = np.indices(depth.shape)
    met = np.isfinite(depth)
    z = depth[met]
    x, y = (u[met] + 0.5 - lens.cx) / lens.fx * z, (v[met] + 0.5 - lens.cy) / lens.fy * z
    data = np.stack([x, y, z], axis=1).astype("<f4")
    field = store.types["sensor_msgs/msg/PointField"]
    return store.types["sensor_msgs/msg/PointCloud2"](
        header=head,
        height=1,
        width=len(data),
        fields=[field(name=n, offset=4 * k, datatype=7, count=1) for k, n in enumerate("xyz")],
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(data),
        data=data.view(np.uint8).reshape(-1),
        is_dense=True,
    )
