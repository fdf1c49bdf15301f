"""Interface and common base of connections to an autopilot."""

from __future__ import annotations

import ipaddress
import socket
import sys
from typing import ClassVar, Protocol

from seals.arrays import Floats
from seals.errors import ConfigError, printable
from seals.teleop.autopilot.flight_state import FlightState

Range = tuple[float, float]


class Link(Protocol):
    """Interface of a connection to an autopilot, in lockstep: a state for a set of outputs.

    Attributes:
        one_way: outputs for standstill and full thrust of a drive that turns one way.
        two_way: outputs for the lowest and highest command of all others.
        ended: why the session is over; empty while it goes on.
        restarted: whether it is over because the autopilot began anew.
        frames: sets of outputs so far.
    """

    one_way: ClassVar[Range]
    two_way: ClassVar[Range]
    ended: str
    restarted: bool
    frames: int

    def meet(self) -> None:
        """Wait for the autopilot.

        Raises:
            ConfigError: it stays silent.
        """

    def renew(self) -> None:
        """Begin the next session with an autopilot that restarted."""

    def exchange(self, state: FlightState) -> Floats | None:
        """Send a state and return the outputs that answer it, NaN for none; None at the end."""

    def close(self) -> None:
        """Release the sockets."""


class Refusals:
    """Refused messages of a peer: each reason is reported once, all are counted."""

    def __init__(self) -> None:
        self.count = 0
        self._said: set[str] = set()

    def say(self, reason: str, details: str = "") -> None:
        """Count a message, and say its reason if that is new."""
        self.count += 1
        if reason not in self._said:
            self._said.add(reason)
            print(printable(f"refused: {reason} {details}".rstrip()), file=sys.stderr, flush=True)


def listen(kind: socket.SocketKind, host: str, port: int) -> socket.socket:
    """Return a socket that is bound to an address.

    Raises:
        ConfigError: the address cannot be had.
    """
    if not 0 <= port < 1 << 16:
        raise ConfigError(f"port={port} is not allowed.\nAllowed: 1024 to 65535, or 0 for any")
    ear = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        ear.bind((host, port))
    except OSError as error:
        ear.close()
        raise ConfigError(
            f"host={host} port={port} cannot be listened on: {error.strerror or error}.\n"
            "End the other program there, or choose another: port=NUMBER"
        ) from error
    return ear


def allowed_peer(address: str | None) -> str | None:
    """Return the address that an autopilot shall have, as it was told.

    Raises:
        ConfigError: it is no address.
    """
    try:
        return None if address is None else str(ipaddress.IPv4Address(address))
    except ValueError as error:
        raise ConfigError(
            f"peer={address} is no address.\n"
            "Allowed: that of the machine of the autopilot, such as peer=203.0.113.7"
        ) from error


def admitted(address: str, allowed: str | None) -> bool:
    """Return whether an autopilot may speak from an address, and be answered there.

    Who sends a packet can write any address into it: no answer goes to one outside this machine
    and private networks that nobody told.

    Args:
        address: of the other side.
        allowed: the only one that is admitted; None for those of private networks.

    Example:
        >>> admitted("192.168.1.7", None), admitted("8.8.8.8", None), admitted("8.8.8.8", "8.8.8.8")
        (True, False, True)
    """
    return address == allowed if allowed else ipaddress.ip_address(address).is_private


def silent(where: str, timeout: float, start: str) -> ConfigError:
    """Return the refusal that no autopilot spoke."""
    return ConfigError(
        f"no autopilot spoke to {where} within {timeout:g} s.\n"
        f"Start it first, or wait longer: {start}; timeout=SECONDS"
    )
