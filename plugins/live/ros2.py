"""ROS 2 bridge over zenoh: publishes the state of a run, receives commands.

Its node is compatible with rmw_zenoh; no ROS installation is needed.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import struct
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from seals.control import Reference
from seals.errors import ConfigError, optional_import, printable
from seals.field_roles import roles
from seals.plugins.live.mcap import FILE, Recording
from seals.plugins.live.ros_messages import ROBOT, Messages
from seals.run.live_output import Beat, Pace
from seals.run.settings import RunSettings
from seals.schema import check_tree, count, param
from seals.world import World

QOS = "::,10:,:,:,,"
"""Quality of service in a liveliness token: reliable, volatile, the last 10 messages."""
PUBLISHER, SUBSCRIBER, NODE = "MP", "MS", "NN"
MOST = 1 << 16
"""Longest command that is read [bytes]."""
PATIENCE = 1000
"""Time for a session to be opened with another program [ms]; 10,000 is usual."""
MOST_SESSIONS = 32
"""Programs that are connected at a time."""


def _type_key(kind: str) -> str:
    """Return the name of a type as it stands in keys.

    Example:
        >>> _type_key("sensor_msgs/msg/Imu")
        'sensor_msgs::msg::dds_::Imu_'
    """
    package, folder, name = kind.split("/")
    return f"{package}::{folder}::dds_::{name}_"


def _topic_key(domain: int, topic: str, kind: str, type_hash: str) -> str:
    """Return the key expression of a topic.

    Example:
        >>> _topic_key(0, "clock", "rosgraph_msgs/msg/Clock", "RIHS01_69")
        '0/clock/rosgraph_msgs::msg::dds_::Clock_/RIHS01_69'
    """
    return f"{domain}/{topic}/{_type_key(kind)}/{type_hash}"


def _attachment(number: int, stamp: int, source: bytes) -> bytes:
    """Return the attachment of a message: its number, time [ns] and source of 16 bytes.

    Example:
        >>> len(_attachment(1, 2, bytes(16)))
        33
    """
    return struct.pack("<qqB", number, stamp, len(source)) + source


def session_of(
    connect: Sequence[str],
    listen: Sequence[str],
    *,
    taken: Sequence[str],
    published: Sequence[str],
) -> Any:
    """Open a session that talks to the given endpoints only, without multicast.

    Args:
        connect: endpoints to connect to.
        listen: endpoints to listen on.
        taken: keys of messages that are taken from others.
        published: keys that others may subscribe to.

    Raises:
        MissingExtra: zenoh is not installed.
        ConfigError: an endpoint cannot be used.
    """
    with optional_import(
        "live=ros2 needs eclipse-zenoh", "Install it: pip install 'aam-seals[ros2]'"
    ):
        import zenoh
    config = zenoh.Config()
    values = {
        "mode": "peer",
        "connect/endpoints": list(connect),
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": False,
        "listen/endpoints": list(listen),
        "listen/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "access_control": _access(taken, published),
        "transport/link/rx/max_message_size": 16 * MOST,
        "transport/unicast/max_sessions": MOST_SESSIONS,
        # an end waits for whoever was called and says nothing
        "transport/unicast/open_timeout": PATIENCE,
        "transport/unicast/accept_timeout": PATIENCE,
    }
    try:
        for key, value in values.items():
            config.insert_json5(key, json.dumps(value))
        return zenoh.open(config)
    except zenoh.ZError as error:
        words = printable(str(error))[:160]
        raise ConfigError(
            f"live.connect={list(connect)} live.listen={list(listen)}: {words}.\n"
            "Allowed: endpoints such as tcp/127.0.0.1:7447; port 0 for any that is free"
        ) from error


class ZenohNode:
    """Node with publishers and subscribers, visible in the graph of ROS.

    Args:
        session: of zenoh; closed with the node.
        domain: ROS_DOMAIN_ID.
        name: of the node.
        namespace: of the node and its topics, without slashes; empty for none.
        store: message types.
    """

    def __init__(self, session: Any, domain: int, name: str, namespace: str, store: Any) -> None:
        self._session, self._domain, self._store = session, domain, store
        self._space = f"{namespace}/" if namespace else ""
        self._id = str(session.info.zid())
        self._owner = f"%/{f'%{namespace}' if namespace else '%'}/{name}"
        self._publishers: dict[str, tuple[Any, bytes]] = {}
        self._numbers: dict[str, int] = {}
        self._kept: list[Any] = []
        self._entities = 0
        self._declare(NODE, "")

    def _declare(self, kind: str, rest: str) -> str:
        """Declare a liveliness token and return it."""
        number, self._entities = self._entities, self._entities + 1
        token = f"@ros2_lv/{self._domain}/{self._id}/0/{number}/{kind}/{self._owner}{rest}"
        self._kept.append(self._session.liveliness().declare_token(token))
        return token

    def _endpoint(self, kind: str, topic: str, message: str) -> tuple[str, str]:
        """Declare a publisher or a subscriber; return its key and its token."""
        full = f"{self._space}{topic}"
        type_hash = self._store.hash_rihs01(message)
        mangled = f"/{full}".replace("/", "%")
        token = self._declare(kind, f"/{mangled}/{_type_key(message)}/{type_hash}/{QOS}")
        return _topic_key(self._domain, full, message, type_hash), token

    def publish(self, topic: str, kind: str, message: Any) -> None:
        """Send a message."""
        if topic not in self._publishers:
            key, token = self._endpoint(PUBLISHER, topic, kind)
            source = hashlib.blake2b(token.encode(), digest_size=16).digest()
            self._publishers[topic] = self._session.declare_publisher(key), source
        publisher, source = self._publishers[topic]
        number = self._numbers[topic] = self._numbers.get(topic, 0) + 1
        raw = bytes(self._store.serialize_cdr(message, kind))
        publisher.put(raw, attachment=_attachment(number, time.time_ns(), source))

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> None:
        """Pass the messages of a topic to a function, in zenoh's thread; report damaged ones."""
        key, _ = self._endpoint(SUBSCRIBER, topic, kind)
        said = threading.Event()

        def hear(sample: Any) -> None:
            raw = bytes(sample.payload)
            try:
                if len(raw) > MOST:
                    raise ValueError(f"{len(raw)} bytes")
                take(self._store.deserialize_cdr(raw, kind))
            except Exception as error:  # whatever a peer sends shall not end the run
                if not said.is_set():
                    said.set()
                    print(f"refused: a message on {topic}: {printable(str(error))[:120]}")

        self._kept.append(self._session.declare_subscriber(key, hear))

    def close(self) -> None:
        """Leave the graph."""
        for thing in self._kept:
            thing.undeclare()
        self._session.close()


_GRAPH = "@ros2_lv/**"
"""Liveliness tokens, by which the nodes of ROS 2 know of each other."""
_EVERY = (
    *("put", "delete", "declare_subscriber", "query", "reply", "declare_queryable"),
    *("liveliness_token", "liveliness_query", "declare_liveliness_subscriber"),
)


def _access(taken: Sequence[str], published: Sequence[str]) -> dict[str, Any]:
    """Return the value of ``access_control`` in the configuration of a session.

    Whatever others declare is kept as long as they are connected. Subscribers of what is published
    are needed, and asking for the graph; all else is dropped unseen, or a flood of it would fill
    the memory and the time of a run.

    Args:
        taken: keys of messages that are taken.
        published: keys that others may subscribe to.

    Example:
        >>> _access(["0/cmd_vel/a/b"], [])["default_permission"]
        'deny'
    """
    rules = [
        _rule("told", "egress", _EVERY, ["**", _GRAPH]),
        _rule("asked", "ingress", ("liveliness_query", "declare_liveliness_subscriber"), [_GRAPH]),
        _rule("taken", "ingress", ("put",), taken),
        _rule("published", "ingress", ("declare_subscriber",), published),
    ]
    rules = [rule for rule in rules if rule["key_exprs"]]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": "all"}],
        "policies": [{"rules": [rule["id"] for rule in rules], "subjects": ["all"]}],
    }


def _rule(name: str, flow: str, messages: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    words = {"id": name, "permission": "allow", "flows": [flow]}
    return {**words, "messages": list(messages), "key_exprs": list(keys)}


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
        speed: simulated seconds per second of real time, at most; 0 for no limit.
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
        for key, value in (("node", self.node), ("namespace", self.namespace)):
            if not _NAME.fullmatch(value) and (value or key == "node"):
                raise ConfigError(
                    f"live.{key}={value} is not a name of ROS.\nAllowed: letters, digits and _"
                )
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
            _topic_key(self.domain, f"{space}{topic}", kind, hashed.hash_rihs01(kind))
            for topic, kind in topics
        ]

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
