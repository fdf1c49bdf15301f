"""ROS 2 bridge over zenoh: publishes the state of a run, receives commands."""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from seals.control import Reference
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.plugins.live.mcap import FILE, Recording
from seals.plugins.live.ros_messages import ROBOT, Messages
from seals.plugins.live.zenoh_node import ZenohNode, session_of, topic_key
from seals.run.live_output import Beat, Pace
from seals.run.settings import RunSettings
from seals.schema import check_tree, count, param
from seals.world import World

VELOCITY, COMMANDS = "cmd_vel", "commands"
"""Topics that are taken: ``Twist`` by guide=commanded, ``Float64MultiArray`` by a controller."""
FASTEST = 1e3
"""Speed from which on a command is taken for none [m/s or rad/s]."""
_NAME = re.compile(r"[A-Za-z_]\w*")


@roles(data="node namespace record", address="connect listen")
@dataclass(kw_only=True)
class LiveRos2:
    """Publishes a run as a node of ROS 2 that rmw_zenoh nodes see, and takes commands.

    Args:
        rate: of pose, frames and joints [Hz]; readings come at the rates of their sensors.
        speed: simulated seconds in one second of the clock, at most; 0 for no limit.
        domain: ROS_DOMAIN_ID.
        node: name of the node.
        namespace: of node and topics; empty for none.
        connect: endpoints of zenoh to connect to, the router of rmw_zenoh; retried until it is
            there.
        listen: endpoints to listen on.
        record: whether the messages are also written to `ros2.mcap`.
    """

    rate: float = param(50.0, "Hz", bounds=(0.1, 1e4), tolerance=0.0, source="chosen", fit=False)
    speed: float = param(1.0, "1", bounds=(0.0, 1e3), tolerance=0.0, source="chosen", fit=False)
    domain: int = count(0, bounds=(0, 232))
    node: str = "seals"
    namespace: str = ""
    connect: list[str] = field(default_factory=lambda: ["tcp/127.0.0.1:7447"])
    listen: list[str] = field(default_factory=lambda: ["tcp/127.0.0.1:0"])
    record: bool = False

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="live")

    def open(self, settings: RunSettings, folder: Path) -> None:
        """Join the graph; listen to commands where guide or controller take them.

        Raises:
            MissingExtra: zenoh or rosbags is not installed.
            ConfigError: a name or an endpoint cannot be used.
        """
        self._check()
        self._messages = Messages()
        self._beat, self._pace = Beat(self.rate), Pace(self.speed)
        self._guide, self._controller = settings.guide, settings.controller
        taken = {VELOCITY: "geometry_msgs/msg/Twist"} if hasattr(self._guide, "tell") else {}
        if hasattr(self._controller, "tell"):
            taken[COMMANDS] = "std_msgs/msg/Float64MultiArray"
        session = session_of(
            self.connect,
            self.listen,
            taken=self._keys(taken.items()),
            published=self._keys(self._messages.topics(settings.sensors)),
        )
        self._node = ZenohNode(
            session, self.domain, self.node, self.namespace, self._messages.store
        )
        self._lock, self._heard = threading.Lock(), dict[str, Any]()
        self._yaw: float | None = None
        self._last = 0.0
        for topic, kind in taken.items():
            self._take(topic, kind)
        self._recording = None
        if self.record:
            folder.mkdir(parents=True, exist_ok=True)
            self._recording = Recording(folder / FILE, self._messages.store)

    def _keys(self, topics: Iterable[tuple[str, str]]) -> list[str]:
        """Return the keys of topics of given types."""
        space, hashed = f"{self.namespace}/" * bool(self.namespace), self._messages.store
        return [
            topic_key(self.domain, f"{space}{topic}", kind, hashed.hash_rihs01(kind))
            for topic, kind in topics
        ]

    def _check(self) -> None:
        for key, value in (("node", self.node), ("namespace", self.namespace)):
            if not _NAME.fullmatch(value) and (value or key == "node"):
                raise ConfigError(
                    f"live.{key}={value} is no name of ROS.\nAllowed: letters, digits and _"
                )

    def _take(self, topic: str, kind: str) -> None:
        def keep(message: Any) -> None:
            with self._lock:
                self._heard[topic] = message

        self._node.subscribe(topic, kind, keep)

    def tick(self, world: World) -> None:
        """Publish new rows, pass commands on, and wait for the clock."""
        found = list(self._messages.readings(world))
        if self._beat.due(world.time):
            found += [self._messages.clock(world.time), *self._messages.state(world)]
        for message in found:
            self._node.publish(*message)
            if self._recording is not None:
                self._recording.write(world.time, message)
        with self._lock:
            heard = dict(self._heard)
            self._heard.pop(COMMANDS, None)
        if COMMANDS in heard:
            self._controller.tell(np.asarray(heard[COMMANDS].data, dtype=float))
        if VELOCITY in heard:
            self._steer(world, heard[VELOCITY])
        self._last = world.time
        self._pace.wait(world.time)

    def _steer(self, world: World, twist: Any) -> None:
        """Hand on a velocity in axes that head as the robot shall and stay level."""
        values = np.array([getattr(twist.linear, axis) for axis in "xyz"] + [twist.angular.z])
        if not np.all(np.abs(values) < FASTEST):
            return
        if self._yaw is None:
            turn = world.actors[ROBOT].look()[0].rotations[0, 0]
            self._yaw = math.atan2(turn[1, 0], turn[0, 0])
        else:
            self._yaw = math.remainder(
                self._yaw + float(values[3]) * (world.time - self._last), 2.0 * math.pi
            )
        c, s = math.cos(self._yaw), math.sin(self._yaw)
        x, y, z = values[:3].tolist()
        velocity = np.array([c * x - s * y, s * x + c * y, z])
        self._guide.tell(Reference(velocity=velocity, yaw=self._yaw, yaw_rate=float(values[3])))

    def close(self) -> None:
        """Leave the graph."""
        self._node.close()
        if self._recording is not None:
            self._recording.close()
