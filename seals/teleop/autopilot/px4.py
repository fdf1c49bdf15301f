"""Connection to PX4 by its hardware-in-the-loop messages of MAVLink over TCP, in lockstep."""

from __future__ import annotations

import math
import socket
import time
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import optional_import
from seals.run.live_output import Beat, Pace
from seals.teleop.autopilot.link import FlightState, Range, Refusals, admitted, listen, silent
from seals.teleop.autopilot.settings import HilSettings

PORT = 4560
EARTH = 6371000.0
"""Radius of the sphere on which PX4 projects [m]."""
BROWSERS = (b"GET", b"POS", b"PUT", b"HEA", b"OPT", b"DEL", b"PAT", b"\x16\x03\x01")
"""How requests of web pages begin, which may hold messages of MAVLink: HTTP, TLS."""
ARMED, ALL_FIELDS = 128, 0x1FFF
ATMOSPHERE = 101325.0
GAUSS, HECTOPASCAL = 1e-4, 100.0
GREETING = 0.2
"""Wait for the first byte of a connection [s]."""
START = 0.02
"""Wait for outputs in each step until the first come [s]: PX4 starts on sensors alone."""


def _air_pressure(height: float) -> float:
    """Return the pressure of the standard atmosphere at a height above the sea [Pa].

    Example:
        >>> round(_air_pressure(0.0)), round(_air_pressure(1000.0))
        (101325, 89875)
    """
    return float(ATMOSPHERE * (1.0 - 2.25577e-5 * height) ** 5.25588)


class Px4:
    """Lockstep with PX4: one step for each HIL_ACTUATOR_CONTROLS that answers a HIL_SENSOR.

    Until the first one comes, steps go on without: PX4 starts up on sensors alone.

    Args:
        host: address to listen on.
        port: to listen on.
        timeout: silence that ends the session [s].
        speed: simulated seconds per second of real time, 0 for no limit.
        step: of the simulation [s].
        hil: sensors and origin.
        seed: of the sensors' noise.
        allowed: address of the autopilot; None for any in a private network.

    Raises:
        MissingExtra: pymavlink is not installed.
        ConfigError: the address cannot be had.
    """

    one_way: ClassVar[Range] = (0.0, 1.0)
    two_way: ClassVar[Range] = (-1.0, 1.0)

    def __init__(
        self,
        host: str,
        port: int,
        timeout: float,
        speed: float,
        step: float,
        *,
        hil: HilSettings,
        seed: int,
        allowed: str | None = None,
    ) -> None:
        with optional_import(
            "protocol=px4 needs pymavlink", "Install it: pip install 'aam-seals[autopilot]'"
        ):
            from pymavlink.dialects.v20 import common
        self._dialect: Any = common
        self._ear = listen(socket.SOCK_STREAM, host, port)
        self._ear.listen(1)
        self.where = "tcp:{}:{}".format(*self._ear.getsockname())
        self._timeout, self._step, self._hil, self._allowed = timeout, step, hil, allowed
        self._rng = np.random.default_rng(seed)
        self._pace, self._fix = Pace(speed), Beat(hil.gps_rate)
        self.refusals = Refusals()
        self.ended, self.restarted, self.frames, self.lost = "", False, 0, 0
        self._wire: socket.socket | None = None
        self._spoken, self._begin = False, 0.0
        self._speaker: Any = None
        self._ears: Any = None

    def meet(self) -> None:
        """Wait for PX4 to connect.

        Raises:
            ConfigError: it does not.
        """
        self._begin = time.monotonic()
        while self._wire is None:
            self._ear.settimeout(max(self._begin + self._timeout - time.monotonic(), 1e-3))
            try:
                wire, peer = self._ear.accept()
            except TimeoutError:
                raise silent(self.where, self._timeout, "make px4_sitl none_iris") from None
            if not admitted(peer[0], self._allowed):
                self.refusals.say(
                    "an address outside private networks, which peer=ADDRESS admits",
                    f"({peer[0]}:{peer[1]})",
                )
                wire.close()
            elif self._foreign(wire):
                self.refusals.say(
                    "a web page, or a client that disconnected immediately",
                    f"from {peer[0]}:{peer[1]}",
                )
                wire.close()
            else:
                self._wire = wire
        self._begin = time.monotonic()
        self._wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._speaker = self._dialect.MAVLink(_Writer(self._wire), srcSystem=1, srcComponent=200)
        self._ears = self._dialect.MAVLink(None)
        self._ears.robust_parsing = True

    def _foreign(self, wire: socket.socket) -> bool:
        """Return whether a connection is one of a browser, which speaks at once; PX4 need not."""
        wire.settimeout(GREETING)
        try:
            begin = wire.recv(3, socket.MSG_PEEK)
        except TimeoutError:
            return False
        except ConnectionError:
            return True
        return not begin or begin in BROWSERS

    def renew(self) -> None:
        """Do nothing: a closed connection is not reopened."""

    def exchange(self, state: FlightState) -> Floats | None:
        """Send the sensors' readings, and return the controls that answer them."""
        self._pace.wait(state.time)
        # a time of zero would count as none
        stamp = round((state.time + self._step) * 1e6)
        try:
            self._sensors(state, stamp)
            if self._fix.due(state.time):
                self._satellites(state, stamp)
            airspeed = max(_short(state.airspeed * 100.0), 0)
            self._speaker.hil_state_quaternion_send(
                stamp,
                state.quaternion.tolist(),
                *state.gyro.tolist(),
                *self._place(*state.position.tolist()),
                *(_short(v * 100.0) for v in state.velocity.tolist()),
                airspeed,
                airspeed,
                *(_short(a / 9.80665 * 1e3) for a in state.accelerometer.tolist()),
            )
            return self._controls(stamp)
        except (ConnectionError, EOFError):
            self.ended = "the autopilot closed the connection"
        except TimeoutError:
            self.ended = f"the autopilot was silent for {self._timeout:g} s"
        return None

    def _noisy(self, values: Floats, sigma: float) -> list[float]:
        noisy: list[float] = (values + sigma * self._rng.normal(size=len(values))).tolist()
        return noisy

    def _sensors(self, state: FlightState, stamp: int) -> None:
        hil = self._hil
        height = hil.origin[2] - float(state.position[2])
        deep = state.reading("pressure")
        pressure = ATMOSPHERE + deep[0] if deep and deep[0] > 0.0 else _air_pressure(height)
        pressure = self._noisy(np.array([pressure]), hil.pressure_noise)[0]
        field = np.asarray(hil.field) @ state.rotation
        magnetic = np.array(self._noisy(field, hil.magnetometer_noise)) / GAUSS
        dynamic = 0.5 * 1.2 * state.airspeed * abs(state.airspeed)
        seen = (1.0 - (pressure / ATMOSPHERE) ** (1.0 / 5.25588)) / 2.25577e-5
        self._speaker.hil_sensor_send(
            stamp,
            *self._noisy(state.accelerometer, hil.accelerometer_noise),
            *self._noisy(state.gyro, hil.gyroscope_noise),
            *magnetic.tolist(),
            pressure / HECTOPASCAL,
            dynamic / HECTOPASCAL,
            seen,
            20.0,
            ALL_FIELDS,
        )

    def _place(self, north: float, east: float, down: float) -> tuple[int, int, int]:
        """Return latitude and longitude [1e-7 deg] and altitude [mm]."""
        latitude, longitude, altitude = self._hil.origin
        north_turn = math.degrees(north / EARTH)
        east_turn = math.degrees(east / (EARTH * math.cos(math.radians(latitude))))
        return (
            round((latitude + north_turn) * 1e7),
            round((longitude + east_turn) * 1e7),
            round((altitude - down) * 1e3),
        )

    def _satellites(self, state: FlightState, stamp: int) -> None:
        noise = self._hil.gps_noise
        place = self._place(*self._noisy(state.position, noise))
        north, east, down = self._noisy(state.velocity, self._hil.gps_velocity_noise)
        over_ground = math.hypot(north, east)
        course = round(math.degrees(math.atan2(east, north)) * 100.0) % 36000
        error = max(round(noise * 100.0), 1)
        self._speaker.hil_gps_send(
            stamp,
            3,
            *place,
            error,
            error,
            min(round(over_ground * 100.0), 65534),
            *(_short(v * 100.0) for v in (north, east, down)),
            course,
            12,
        )

    def _controls(self, stamp: int) -> Floats:
        """Wait for the controls of this step; none until the first ones come.

        Raises:
            TimeoutError: PX4 has been heard before, and is silent now.
            EOFError: it has left.
        """
        assert self._wire is not None
        end = time.monotonic() + (self._timeout if self.frames else START)
        while (left := end - time.monotonic()) > 0.0:
            self._wire.settimeout(left)
            try:
                raw = self._wire.recv(4096)
            except TimeoutError:
                break
            if not raw:
                raise EOFError
            if not self._spoken and raw[:3] in BROWSERS:
                self.refusals.say("a web page")
                raise EOFError
            self._spoken = True
            found = self._newest(raw, stamp)
            if found is not None:
                self.frames += 1
                return found
        if self.frames or time.monotonic() > self._begin + self._timeout:
            raise TimeoutError
        return np.full(16, np.nan)

    def _newest(self, raw: bytes, stamp: int) -> Floats | None:
        """Return the last controls among some bytes that are not older than the sensors."""
        found = None
        for message in self._ears.parse_buffer(raw) or []:
            kind = message.get_type()
            if kind == "BAD_DATA":
                self.refusals.say("bytes that are not a MAVLink message")
            elif kind == "HIL_ACTUATOR_CONTROLS":
                if message.time_usec + 0.5e6 * self._step < stamp and self.frames:
                    self.refusals.say("controls that are older than the sensors' readings")
                    continue
                controls = np.array(message.controls, dtype=float)
                finite = np.where(np.isfinite(controls), controls, np.nan)
                found = finite if message.mode & ARMED else np.full(len(finite), np.nan)
        return found

    def close(self) -> None:
        """Release the sockets."""
        if self._wire is not None:
            self._wire.close()
        self._ear.close()


class _Writer:
    """File that MAVLink writes into: the socket."""

    def __init__(self, wire: socket.socket) -> None:
        self._wire = wire

    def write(self, raw: bytes) -> None:
        self._wire.sendall(raw)


def _short(value: float) -> int:
    """Return a number as 16 bits hold it."""
    return max(-32767, min(32767, round(value)))
