"""ROS 2 node over zenoh, compatible with rmw_zenoh; no ROS installation is needed."""

from __future__ import annotations

import hashlib
import json
import struct
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from seals.errors import ConfigError, optional_import, printable

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


def topic_key(domain: int, topic: str, kind: str, type_hash: str) -> str:
    """Return the key expression of a topic.

    Example:
        >>> topic_key(0, "clock", "rosgraph_msgs/msg/Clock", "RIHS01_69")
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
        "access_control": access(taken, published),
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
        return topic_key(self._domain, full, message, type_hash), token

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


def access(taken: Sequence[str], published: Sequence[str]) -> dict[str, Any]:
    """Return the value of ``access_control`` in the configuration of a session.

    Whatever others declare is kept as long as they are connected. Subscribers of what is published
    are needed, and asking for the graph; all else is dropped unseen, or a flood of it would fill
    the memory and the time of a run.

    Args:
        taken: keys of messages that are taken.
        published: keys that others may subscribe to.

    Example:
        >>> access(["0/cmd_vel/a/b"], [])["default_permission"]
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
