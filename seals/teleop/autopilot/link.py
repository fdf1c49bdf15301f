"""Interface and common base of connections to an autopilot, its recorded outputs, its axes.

Autopilots take north-east-down in the world, forward-right-down on the body.
"""

from __future__ import annotations

import ipaddress
import socket
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from seals.arrays import Floats
from seals.control import RobotState
from seals.errors import ConfigError, printable
from seals.frames import quaternion_of
from seals.logs.atomic import write_table
from seals.logs.table import read_parquet

ENU_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Matrix from east-north-up to north-east-down, and back."""
FLU_FRD = np.array([1.0, -1.0, -1.0])
"""Signs from forward-left-up to forward-right-down, and back."""


class FlightState(NamedTuple):
    """Motion and readings of a robot at one instant, in an autopilot's axes.

    Args:
        time: [s].
        position: of the body origin, north-east-down [m], shape (3,).
        velocity: likewise [m/s].
        acceleration: likewise [m/s^2].
        rotation: from forward-right-down to north-east-down, shape (3, 3).
        gyro: angular velocity, forward-right-down [rad/s], shape (3,).
        accelerometer: specific force of the body origin, forward-right-down [m/s^2], shape (3,).
        wind: velocity of the air, north-east-down [m/s], shape (3,).
        readings: last reading of every sensor, by sensor and channel.
    """

    time: float
    position: Floats
    velocity: Floats
    acceleration: Floats
    rotation: Floats
    gyro: Floats
    accelerometer: Floats
    wind: Floats
    readings: Mapping[str, Mapping[str, Floats]]

    @property
    def quaternion(self) -> Floats:
        """Attitude w, x, y, z, shape (4,)."""
        return quaternion_of(self.rotation)[[3, 0, 1, 2]]

    @property
    def airspeed(self) -> float:
        """Speed through the air along the body's x axis [m/s]."""
        return float((self.velocity - self.wind) @ self.rotation[:, 0])

    def reading(self, channel: str) -> list[float]:
        """Return the finite values that sensors last gave for a channel, one each, in order."""
        found = (values[channel] for values in self.readings.values() if channel in values)
        return [float(value[0]) for value in found if np.isfinite(value[0])]


def flight_state(
    now: RobotState, change: Floats | None, gravity: float, wind: Floats
) -> FlightState:
    """Convert the state of a robot.

    Args:
        now: the state.
        change: acceleration of the last step, world axes [m/s^2], shape (3,); None at the start.
        gravity: [m/s^2].
        wind: velocity of the air, world axes [m/s].
    """
    change = np.zeros(3) if change is None else change
    force = (change + np.array([0.0, 0.0, gravity])) @ now.rotation
    return FlightState(
        now.time,
        ENU_NED @ now.position,
        ENU_NED @ now.velocity,
        ENU_NED @ change,
        ENU_NED @ now.rotation * FLU_FRD,
        FLU_FRD * now.angular_velocity,
        FLU_FRD * force,
        ENU_NED @ wind,
        now.readings,
    )


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
        raise ConfigError(
            f"port={port} is not allowed.\nAllowed: 1024 to 65535, or 0 for any free port"
        )
    ear = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        ear.bind((host, port))
    except OSError as error:
        ear.close()
        raise ConfigError(
            f"host={host} port={port} cannot be opened: {error.strerror or error}.\n"
            "End the program that uses it, or choose another: port=NUMBER"
        ) from error
    return ear


def allowed_peer(address: str | None) -> str | None:
    """Return the address of the autopilot as configured.

    Raises:
        ConfigError: it is not an address.
    """
    try:
        return None if address is None else str(ipaddress.IPv4Address(address))
    except ValueError as error:
        raise ConfigError(
            f"peer={address} is not an address.\n"
            "Allowed: the address of the machine of the autopilot, such as peer=203.0.113.7"
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
        f"no autopilot connected to {where} within {timeout:g} s.\n"
        f"Start it first, or wait longer: {start}; timeout=SECONDS"
    )


OUTPUTS = "outputs.parquet"
"""File of the outputs in the run folder: ``t`` and one column for each channel."""


class Track:
    """Outputs of an autopilot, each held until the next.

    Args:
        times: [s], rising.
        outputs: NaN for none, shape (times, channels).
    """

    def __init__(self, times: Floats, outputs: Floats) -> None:
        self.times, self.outputs = times, outputs

    def at(self, time: float) -> Floats | None:
        """Return the outputs in force at a time [s]; None before the first."""
        k = int(np.searchsorted(self.times, time + 1e-9, side="right")) - 1
        return None if k < 0 else self.outputs[k]

    def write(self, path: Path) -> None:
        """Write the file."""
        columns = {f"channel_{k + 1}": values for k, values in enumerate(self.outputs.T)}
        write_table(path, {"t": self.times, **columns})


def read_track(path: Path) -> Track:
    """Read a file of outputs.

    Raises:
        LogError: it cannot be read.
        ConfigError: it holds no times that rise, or no channels.
    """
    found = read_parquet(path)
    times = found.pop("t", np.zeros(0))
    names = [f"channel_{k + 1}" for k in range(len(found))]
    if not len(times) or not np.all(np.diff(times) > 0.0) or set(names) != set(found) or not found:
        raise ConfigError(
            f"script {path} is not a table of outputs.\n"
            f"Allowed: {OUTPUTS} of a flight by seals autopilot: t rising, channel_1, channel_2 ..."
        )
    return Track(times, np.stack([found[name] for name in names], axis=1))
