"""Autopilots that flood, intrude or fall silent, and what flies under their name."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.teleop.autopilot import ardupilot
from seals.teleop.autopilot.ardupilot import ArduPilot
from seals.teleop.autopilot.link import FlightState
from tests.unit.test_hostile_peers import ended


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
            OSError: it cannot be commanded.
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
