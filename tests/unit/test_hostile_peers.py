"""Peers of the live outputs and of autopilots that flood, intrude or fall silent."""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.plugins.guides.commanded import Commanded
from seals.plugins.live import gate
from seals.plugins.live.ros2 import LiveRos2
from seals.teleop.autopilot import ardupilot
from seals.teleop.autopilot.ardupilot import ArduPilot
from seals.teleop.autopilot.flight_state import FlightState

PAGES = ["https://app.foxglove.dev"]
REQUEST = b"GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n%s\r\n"


def at_rest() -> FlightState:
    """Return the state of a robot at rest."""
    rest = np.zeros(3)
    return FlightState(0.0, rest, rest, rest, np.eye(3), rest, rest, rest, {})


@pytest.fixture
def link() -> Iterator[ArduPilot]:
    """Return a link to ArduPilot that waits a short while."""
    made = ArduPilot("127.0.0.1", 0, 0.4, 0.0, 0.01)
    yield made
    made.close()
    while Mouth.every:
        Mouth.every.pop().close()


class Mouth:
    """Autopilot that sends frames from an address of its own."""

    every: ClassVar[list[socket.socket]] = []

    def __init__(self, link: ArduPilot) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.every.append(self.socket)
        host, port = link.where.removeprefix("udp:").split(":")
        self.target = host, int(port)

    def say(self, *numbers: int, pulse: int = 1500) -> Mouth:
        """Send frames of given numbers."""
        for number in numbers:
            packet = struct.pack("<HHI16H", 18458, 100, number, *[pulse] * 16)
            self.socket.sendto(packet, self.target)
        return self


def met(link: ArduPilot) -> Mouth:
    """Return an autopilot whose first two frames were taken."""
    mouth = Mouth(link).say(1, 2)
    link.meet()
    for _ in range(2):
        assert link.exchange(at_rest()) is not None
    return mouth


@pytest.mark.parametrize("number", [0, 2, 700])
def test_a_second_autopilot_keeps_no_session_alive(link: ArduPilot, number: int) -> None:
    """The silence of the one that was met counts, whatever else arrives."""
    met(link)
    over = threading.Event()
    other = Mouth(link)

    def chatter() -> None:
        while not over.wait(0.02):
            other.say(number)

    speaker = threading.Thread(target=chatter)
    speaker.start()
    try:
        begin = time.monotonic()
        # seconds: a session that goes on would never return
        late = threading.Timer(5.0, over.set)
        late.start()
        assert link.exchange(at_rest()) is None
        assert time.monotonic() - begin < 3.0
        late.cancel()
    finally:
        over.set()
        speaker.join()
    assert link.refusals.count > 0
    assert link.restarted is (number == 0)


def test_a_second_autopilot_does_not_take_over(link: ArduPilot) -> None:
    """A count from the start at another address is refused while the first one speaks."""
    mouth = met(link)
    Mouth(link).say(0, pulse=1900)
    mouth.say(3, pulse=1200)
    outputs = link.exchange(at_rest())
    assert outputs is not None
    assert outputs[0] == 1200.0
    assert not link.restarted
    assert link.refusals.count == 1


def test_a_flood_of_autopilots_begins_one_run(link: ArduPilot) -> None:
    """Twenty that count from the start are one restart, not twenty folders."""
    met(link)
    mouths = [Mouth(link).say(0) for _ in range(20)]
    assert link.exchange(at_rest()) is None
    assert link.restarted
    assert link.refusals.count == 19
    link.renew()
    assert link.exchange(at_rest()) is not None
    assert link.exchange(at_rest()) is None
    assert not link.restarted
    assert len(mouths) == 20


class Wire:
    """Socket that hears packets with sources of its own choice, and notes what is sent."""

    def __init__(self, packets: list[tuple[int, tuple[str, int]]]) -> None:
        self.packets, self.sent = packets, list[tuple[str, int]]()
        self.broken = False

    def settimeout(self, time: float) -> None:
        """Do nothing."""

    def recvfrom(self, most: int) -> tuple[bytes, tuple[str, int]]:
        """Return the next packet.

        Raises:
            TimeoutError: there is none.
        """
        if not self.packets:
            raise TimeoutError
        number, source = self.packets.pop(0)
        return struct.pack("<HHI16H", 18458, 100, number, *[1500] * 16), source

    def sendto(self, data: bytes, place: tuple[str, int]) -> None:
        """Note a place.

        Raises:
            OSError: it is out of reach.
        """
        if self.broken:
            raise OSError(101, "Network is unreachable")
        self.sent.append(place)

    def close(self) -> None:
        """Do nothing."""


def heard(link: ArduPilot, *packets: tuple[int, tuple[str, int]]) -> Wire:
    """Let a link hear packets with forged sources up to its silence; return what it sent where."""
    wire = Wire(list(packets))
    link._ear.close()
    link._ear = wire  # type: ignore[assignment]
    with contextlib.suppress(ConfigError):
        link.meet()
        while link.exchange(at_rest()) is not None:
            pass
    return wire


@pytest.mark.parametrize("source", ["203.0.114.9", "8.8.8.8", "100.64.0.1", "1.1.1.1"])
def test_no_answer_goes_out_of_private_networks(link: ArduPilot, source: str) -> None:
    """A packet with the address of somebody else has nothing sent there, unless that is told."""
    place = (source, 9003)
    assert heard(link, *((k, place) for k in range(5))).sent == []
    assert link.refusals.count == 5
    link._allowed = source
    assert heard(link, *((k, place) for k in range(5))).sent == [place] * 5
    assert heard(link, (0, ("127.0.0.1", 9003))).sent == []


def test_answers_go_to_the_first_autopilot_alone(link: ArduPilot) -> None:
    """Others of private networks get none while it speaks; port 0 is nobody's."""
    first, other = ("192.168.1.7", 9003), ("192.168.1.8", 9003)
    packets = [(1, ("192.168.1.9", 0)), (1, first), *[(1, other), (2, other)] * 3, (2, first)]
    assert set(heard(link, *packets).sent) == {first}


def test_repeated_frames_are_answered_a_bounded_number_of_times(link: ArduPilot) -> None:
    """A flood of one frame is no flood of answers, which are longer."""
    first = ("192.168.1.7", 9003)
    sent = heard(link, *((1, first) for _ in range(5000))).sent
    assert 2 <= len(sent) <= 2 * (ardupilot.MOST_AGAIN + 1)


def test_an_answer_that_cannot_leave_ends_no_run(link: ArduPilot) -> None:
    """It is said, and the next frame is waited for."""
    wire = Wire([(k, ("10.0.0.7", 9003)) for k in range(5)])
    wire.broken = True
    link._ear.close()
    link._ear = wire  # type: ignore[assignment]
    link.meet()
    for _ in range(5):
        assert link.exchange(at_rest()) is not None
    assert link.refusals.count == 4


@pytest.fixture
def px4() -> Iterator[Any]:
    """Return a link to PX4 that waits a short while."""
    pytest.importorskip("pymavlink", reason="needs aam-seals[autopilot]")
    from seals.teleop.autopilot.px4 import Px4
    from seals.teleop.autopilot.settings import HilSettings

    made = Px4("127.0.0.1", 0, 1.0, 0.0, 0.004, hil=HilSettings(), seed=1)
    yield made
    made.close()


def controls() -> bytes:
    """Return a message of full thrust, armed."""
    from pymavlink.dialects.v20 import common

    speaker = common.MAVLink(None, srcSystem=1, srcComponent=1)
    message = common.MAVLink_hil_actuator_controls_message(2**62, [1.0] * 16, 128, 1)
    return bytes(message.pack(speaker))


POST = b"POST / HTTP/1.1\r\nHost: 127.0.0.1:4560\r\nContent-Length: 100\r\n\r\n"


@pytest.mark.parametrize("begin", [POST, b"GET / HTTP/1.1\r\n\r\n", b"\x16\x03\x01\x00"])
def test_a_web_page_flies_no_px4(px4: Any, begin: bytes) -> None:
    """A page that posts MAVLink to the port is refused, and PX4 is met after it."""
    page = socket.create_connection(px4._ear.getsockname())
    page.sendall(begin + controls())
    pilot = socket.create_connection(px4._ear.getsockname())
    px4.meet()
    assert px4.refusals.count == 1
    pilot.sendall(controls())
    outputs = px4.exchange(at_rest())
    assert outputs is not None
    assert outputs[0] == 1.0
    page.close()
    pilot.close()


def test_a_web_page_that_waits_flies_no_px4(px4: Any) -> None:
    """It ends the session; its controls are not heeded."""
    page = socket.create_connection(px4._ear.getsockname())
    px4.meet()
    page.sendall(POST + controls())
    assert px4.exchange(at_rest()) is None
    assert px4.refusals.count == 1
    page.close()


def test_a_mute_px4_ends_the_run(px4: Any) -> None:
    """A connection that takes sensors and never answers is silent, from the first step on."""
    peer = socket.create_connection(px4._ear.getsockname())
    px4.meet()
    begin = time.monotonic()
    while px4.exchange(at_rest()) is not None:
        assert time.monotonic() - begin < 5.0
    assert px4.ended == "the autopilot was silent for 1 s"
    peer.close()


def test_px4_comes_from_the_told_address(px4: Any) -> None:
    """A connection from another is closed, and the told one is met after it."""
    px4._allowed = "127.0.0.2"
    stranger = socket.create_connection(px4._ear.getsockname())
    pilot = socket.create_connection(px4._ear.getsockname(), source_address=("127.0.0.2", 0))
    px4.meet()
    assert px4.refusals.count == 1
    assert px4._wire.getpeername() == pilot.getsockname()
    assert ended(stranger)
    stranger.close()
    pilot.close()


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
        ("Host: evil.example", "no name of this machine"),
        ("Host: localhost\r\nHost: evil.example", "no name of this machine"),
        ("Accept: */*", "no name of this machine"),
        ("Host: localhost\r\n Origin: http://evil.example", "no request of a WebSocket"),
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

    from seals.config.compose import compose
    from seals.run.build import build_run

    settings: Any = build_run(compose(["robot=ball", "live=foxglove", "live.port=0"]))
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
    from seals.plugins.live.zenoh_node import session_of

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
