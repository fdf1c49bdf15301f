"""Peers of the live outputs that flood, intrude or fall silent."""

from __future__ import annotations

import contextlib
import math
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from seals.plugins.guides.commanded import Commanded
from seals.plugins.live import gate
from seals.plugins.live.ros2 import LiveRos2

PAGES = ["https://app.foxglove.dev"]
REQUEST = b"GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n%s\r\n"


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ("Host: localhost:8765", ""),
        ("Host: localhost:8765\r\nOrigin: https://app.foxglove.dev", ""),
        ("Host: localhost:8765\r\nOrigin: file://", ""),
        ("Host: localhost:8765\r\nOrigin: http://evil.example", "another page"),
        ("Host: localhost:8765\r\nOrigin: https://app.foxglove.dev.evil.example", "another page"),
        ("Host: localhost:8765\r\nOrigin: http://localhost:8765", "another page"),
        ("Host: localhost:8765\r\nOrigin: null", "another page"),
        ("Host: localhost\r\nOrigin: file://\r\nOrigin: http://evil.example", "another page"),
        ("Host: evil.example", "not a name of this machine"),
        ("Host: localhost\r\nHost: evil.example", "not a name of this machine"),
        ("Accept: */*", "not a name of this machine"),
        ("Host: localhost\r\n Origin: http://evil.example", "not a request of a WebSocket"),
    ],
)
def test_the_gate_asks_who_it_is(fields: str, said: str) -> None:
    """Foreign pages, foreign names, and headers that two readers would read differently."""
    head = f"GET / HTTP/1.1\r\n{fields}\r\n\r\n".encode()
    why = gate.refusal(head, "127.0.0.1", PAGES)
    assert said in why
    assert bool(why) is bool(said)
    assert gate.refusal(head.replace(b"GET", b"POST"), "127.0.0.1", PAGES)


class Behind(threading.Thread):
    """Server behind the gate: answers every request with one word, then counts what it hears."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.ear = socket.create_server(("127.0.0.1", 0), backlog=100)
        self.heard = 0
        self.met = 0

    def run(self) -> None:
        """Take every connection until the socket is closed."""
        while True:
            try:
                wire, _ = self.ear.accept()
            except OSError:
                return
            self.met += 1
            threading.Thread(target=self.serve, args=(wire,), daemon=True).start()

    def serve(self, wire: socket.socket) -> None:
        """Answer one connection."""
        with wire, contextlib.suppress(OSError):
            wire.sendall(b"welcome")
            while data := wire.recv(1 << 16):
                self.heard += len(data)


@pytest.fixture
def guarded() -> Iterator[tuple[gate.Gate, Behind]]:
    """Return a gate, and the server behind it."""
    behind = Behind()
    behind.start()
    made = gate.Gate("127.0.0.1", 0, PAGES)
    made.open(*behind.ear.getsockname())
    yield made, behind
    made.close()
    behind.ear.close()


def asked(made: gate.Gate, fields: bytes = b"") -> socket.socket:
    """Return a connection that has sent a request."""
    wire = socket.create_connection(("127.0.0.1", made.port), timeout=10)
    with contextlib.suppress(ConnectionError):
        wire.sendall(REQUEST % (made.port, fields))
    return wire


def ended(wire: socket.socket) -> bool:
    """Return whether a connection was ended by the other side."""
    try:
        return wire.recv(64) == b""
    except ConnectionError:
        return True


def test_the_gate_lets_programs_in_and_pages_not(guarded: tuple[gate.Gate, Behind]) -> None:
    """Who is refused never reaches the server."""
    made, behind = guarded
    with asked(made, b"Origin: http://evil.example\r\n") as page:
        assert page.recv(100).startswith(b"HTTP/1.1 403 Forbidden")
    assert behind.met == 0
    with asked(made) as program:
        assert program.recv(64) == b"welcome"


def test_the_gate_takes_no_flood(guarded: tuple[gate.Gate, Behind]) -> None:
    """A client that sends more than it can have to ask is cut off."""
    made, behind = guarded
    with asked(made) as client:
        assert client.recv(64) == b"welcome"
        with contextlib.suppress(ConnectionError):
            for _ in range(8):
                client.sendall(bytes(gate.MOST_SAID))
        assert ended(client)
    assert behind.heard <= gate.MOST_SAID + 200


def test_the_gate_takes_no_crowd(guarded: tuple[gate.Gate, Behind]) -> None:
    """Of a hundred connections those beyond the bound are dropped; later ones come in again."""
    made, behind = guarded
    wires = [asked(made) for _ in range(100)]
    served = [wire for wire in wires if not ended(wire)]
    assert len(served) == behind.met == gate.MOST_CONNECTIONS
    for wire in wires:
        wire.close()
    for _ in range(100):
        with asked(made) as later:
            if not ended(later):
                break
        time.sleep(0.05)
    else:
        pytest.fail("nobody is served any more")


@pytest.mark.parametrize("said", [b"", b"GET / HTTP/1.1\r\n", b"x" * 20_000])
def test_the_gate_waits_for_nobody(
    said: bytes, guarded: tuple[gate.Gate, Behind], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who says nothing, half a request or an endless one is let go."""
    monkeypatch.setattr(gate, "PATIENCE", 0.2)
    made, behind = guarded
    with socket.create_connection(("127.0.0.1", made.port), timeout=10) as wire:
        with contextlib.suppress(ConnectionError):
            wire.sendall(said)
        assert ended(wire)
    assert behind.met == 0


def test_foxglove_tells_a_foreign_page_nothing(tmp_path: Path) -> None:
    """The server of the SDK stands behind the gate, and a page of the web is refused."""
    pytest.importorskip("foxglove", reason="needs aam-seals[foxglove]")
    client = pytest.importorskip("websockets.sync.client", reason="needs websockets")
    from websockets.exceptions import InvalidStatus

    from seals.run.build import run_settings

    settings: Any = run_settings(["robot=ball", "live=foxglove", "live.port=0"])
    settings.live.open(settings, tmp_path)
    try:
        place = f"ws://127.0.0.1:{settings.live._gate.port}"
        words: dict[str, Any] = {"subprotocols": ["foxglove.sdk.v1"], "max_size": None}
        with pytest.raises(InvalidStatus, match="403"):
            client.connect(place, origin="http://evil.example", **words)
        with client.connect(place, origin="https://app.foxglove.dev", **words) as heard:
            assert '"serverInfo"' in heard.recv()
    finally:
        settings.live.close()


@pytest.mark.parametrize("value", [1e308, -1e308, math.inf, math.nan, 1e9])
def test_an_absurd_velocity_is_no_command(value: float) -> None:
    """Sums of it overflow; headings of it have no sine."""
    live: Any = LiveRos2()
    live._guide, live._yaw, live._last = Commanded(), 0.5, 0.0
    before = live._guide.wanted
    for axis in range(4):
        numbers = [0.0] * 4
        numbers[axis] = value
        twist = SimpleNamespace(
            linear=SimpleNamespace(**dict(zip("xyz", numbers[:3], strict=True))),
            angular=SimpleNamespace(z=numbers[3]),
        )
        for _ in range(100):
            live._steer(SimpleNamespace(time=0.1), twist)
    assert live._guide.wanted is before


def test_a_heading_stays_in_one_turn() -> None:
    """However long somebody turns."""
    live: Any = LiveRos2()
    live._guide, live._yaw, live._last = Commanded(), 0.5, 0.0
    still = SimpleNamespace(x=0.0, y=0.0, z=0.0)
    for _ in range(1000):
        live._steer(SimpleNamespace(time=10.0), SimpleNamespace(linear=still, angular=_turn(900.0)))
    assert abs(live._guide.wanted.yaw) <= math.pi


def _turn(rate: float) -> Any:
    return SimpleNamespace(z=rate)


@pytest.fixture
def peers() -> Iterator[tuple[Any, Any, Any]]:
    """Return the session of a node that listens, that of a peer of it, and the library."""
    zenoh = pytest.importorskip("zenoh", reason="needs aam-seals[ros2]")
    from seals.plugins.live.ros2 import session_of

    with socket.socket() as ear:
        ear.bind(("127.0.0.1", 0))
        place = f"tcp/127.0.0.1:{ear.getsockname()[1]}"
    node = session_of([], [place], taken=["it"], published=["0/clock"])
    config = zenoh.Config()
    config.insert_json5("connect/endpoints", f'["{place}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    peer = zenoh.open(config)
    yield node, peer, zenoh
    peer.close()
    node.close()


def test_a_node_keeps_nothing_that_others_declare(peers: tuple[Any, Any, Any]) -> None:
    """A flood of tokens, subscribers and queryables takes no memory; what is published is heard."""
    node, peer, _ = peers
    kept, clock, ticks = list[Any](), node.declare_publisher("0/clock"), list[Any]()
    asked = node.declare_queryable("0/answer", lambda query: query.reply("0/answer", b"here"))
    for k in range(50):
        kept.append(peer.liveliness().declare_token(f"@ros2_lv/0/flood{k}"))
        kept.append(peer.declare_subscriber(f"0/flood{k}", lambda sample: None))
        kept.append(
            peer.declare_queryable(f"0/flood{k}", lambda query: query.reply(query.key_expr, b"x"))
        )
    kept.append(peer.declare_subscriber("**", lambda sample: None))
    # the last that is declared, and admitted: what came before it has arrived, too
    kept.append(peer.declare_subscriber("0/clock", ticks.append))
    for _ in range(100):
        clock.put(b"tick")
        if ticks:
            break
        time.sleep(0.05)
    assert ticks
    flooded = [node.declare_publisher(f"0/flood{k}") for k in (0, 49)]
    assert not any(publisher.matching_status.matching for publisher in flooded)
    assert not list(node.liveliness().get("@ros2_lv/**", timeout=0.5))
    assert not [reply for reply in node.get("0/flood49", timeout=0.5) if reply.ok]
    assert not [reply for reply in peer.get("0/answer", timeout=0.5) if reply.ok]
    asked.undeclare()


def test_a_node_takes_its_commands_alone(peers: tuple[Any, Any, Any]) -> None:
    """Messages of other keys, and of all keys at once, do not arrive."""
    node, peer, _ = peers
    heard: list[str] = []
    ears = [
        node.declare_subscriber(key, lambda sample: heard.append(str(sample.key_expr)))
        for key in ("it", "other")
    ]
    for _ in range(100):
        for key in ("other", "**", "it"):
            peer.put(key, b"go")
        if len(heard) > 3:
            break
        time.sleep(0.05)
    assert set(heard) == {"it"}
    for ear in ears:
        ear.undeclare()


def test_a_huge_message_does_not_arrive(peers: tuple[Any, Any, Any]) -> None:
    """Zenoh gathers no more of it than a command may have."""
    node, peer, zenoh = peers
    sizes: list[int] = []
    ear_of_node = node.declare_subscriber("it", lambda sample: sizes.append(len(sample.payload)))
    try:
        block = zenoh.CongestionControl.BLOCK
        speaker = peer.declare_publisher("it", congestion_control=block)
        for _ in range(100):
            speaker.put(b"small")
            if sizes:
                break
            time.sleep(0.05)
        assert sizes
        speaker.put(bytes(8 << 20))
        for _ in range(20):
            speaker.put(b"small")
            time.sleep(0.05)
    finally:
        ear_of_node.undeclare()
    assert max(sizes) == 5
