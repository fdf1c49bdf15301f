"""Connection to ArduPilot's SITL by its JSON interface over UDP."""

from __future__ import annotations

import json
import socket
import struct
import time
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.run.live_output import Pace
from seals.teleop.autopilot.link import FlightState, Range, Refusals, admitted, listen, silent

PORT = 9002
HEAD = struct.Struct("<HHI")
CHANNELS = {18458: 16, 29569: 32}
"""Number of outputs by the magic number of a packet."""
LATE = 16
"""Frames by which a packet may be late without counting as a restart."""
QUIET = 1.0
"""Silence after which an autopilot at another address takes its place, at most [s]."""
MOST_AGAIN = 20
"""Answers to frames that come again, in a second: few, where nobody knows who asks for them."""
MOST = 1024
"""Bytes of a packet that are read: one more than any good one has."""


class _Frame(NamedTuple):
    """Outputs of the autopilot.

    Args:
        rate: steps a second that it asks for [Hz].
        number: of the frame.
        pulses: [us], shape (16,) or (32,); 0 for no pulse.
    """

    rate: int
    number: int
    pulses: Floats


def _parse(packet: bytes) -> _Frame | str:
    """Return the frame of a packet, or the reason why it is none.

    Example:
        >>> _parse(struct.pack("<HHI16H", 18458, 400, 7, *[1500] * 16)).number
        7
        >>> _parse(b"GET / HTTP/1.1")
        'a packet without the magic number 18458 or 29569'
    """
    magic = int.from_bytes(packet[:2], "little")
    if len(packet) < HEAD.size or magic not in CHANNELS:
        return "a packet without the magic number 18458 or 29569"
    count = CHANNELS[magic]
    if len(packet) != HEAD.size + 2 * count:
        return f"a packet of the wrong length: {count} outputs take {HEAD.size + 2 * count} bytes"
    _, rate, number = HEAD.unpack_from(packet)
    return _Frame(rate, number, np.frombuffer(packet, "<u2", count, HEAD.size).astype(float))


class ArduPilot:
    """Lockstep with ArduPilot: one step for each frame that it counts.

    A frame that comes again is answered again without a step; a count that begins anew ends the
    session.

    Args:
        host: address to listen on.
        port: to listen on.
        timeout: silence that ends the session [s].
        speed: simulated seconds per second of real time, 0 for no limit.
        step: of the simulation [s].
        allowed: address of the autopilot; None for any in a private network.
    """

    one_way: ClassVar[Range] = (1000.0, 2000.0)
    two_way: ClassVar[Range] = (1000.0, 2000.0)

    def __init__(
        self,
        host: str,
        port: int,
        timeout: float,
        speed: float,
        step: float,
        *,
        allowed: str | None = None,
    ) -> None:
        self._ear = listen(socket.SOCK_DGRAM, host, port)
        self.where = "udp:{}:{}".format(*self._ear.getsockname())
        self._timeout, self._step, self._speed, self._allowed = timeout, step, speed, allowed
        self.refusals = Refusals()
        self._peer: Any = None
        self._first: tuple[_Frame, Any] | None = None
        self._forget()

    def _forget(self) -> None:
        self.ended, self.restarted, self.frames, self.lost = "", False, 0, 0
        self._count, self._said, self._pace = -1, b"", Pace(self._speed)
        self._again, self._second = 0, 0.0

    def meet(self) -> None:
        """Wait for the first frame.

        Raises:
            ConfigError: there is none.
        """
        self._first = self._heard(time.monotonic() + self._timeout)
        if self._first is None:
            raise silent(self.where, self._timeout, "sim_vehicle.py -f JSON:127.0.0.1")
        frame, self._peer = self._first
        wanted, own = frame.rate, 1.0 / self._step
        if abs(wanted - own) > 1.0:
            print(
                f"the autopilot requests {wanted} steps a second, the run uses {own:.6g}: set "
                f"SIM_RATE_HZ {own:.0f}, or time.step={1.0 / max(wanted, 1):.6g}"
            )

    def renew(self) -> None:
        """Begin the next session with the frame that ended this one."""
        self._forget()

    def exchange(self, state: FlightState) -> Floats | None:
        """Answer the last frame with a state, and return the pulses of the next [us]."""
        self._pace.wait(state.time)
        if self._count >= 0:
            # the line of JSON for a state. Its reader looks for keys from the front and takes no
            # blanks
            fields: dict[str, Any] = {
                "timestamp": state.time,
                "imu": {"gyro": state.gyro.tolist(), "accel_body": state.accelerometer.tolist()},
                "position": state.position.tolist(),
                "quaternion": state.quaternion.tolist(),
                "velocity": state.velocity.tolist(),
                "airspeed": state.airspeed,
                "velocity_wind": state.wind.tolist(),
            }
            fields |= {f"rng_{k + 1}": value for k, value in enumerate(state.reading("range")[:6])}
            voltage, current = state.reading("battery_voltage"), state.reading("battery_current")
            if voltage and current:
                fields["battery"] = {"voltage": voltage[0], "current": current[0]}
            self._said = (
                f"\n{json.dumps(fields, separators=(',', ':'), allow_nan=False)}\n".encode()
            )
            self._send()
        waiting, self._first = self._first, None
        found = waiting or self._next()
        if found is None:
            self.ended = self.ended or f"the autopilot was silent for {self._timeout:g} s"
            return None
        frame, self._peer = found
        if self._count >= 0:
            self.lost += frame.number - self._count - 1
        self._count = frame.number
        self.frames += 1
        return np.where(frame.pulses > 0.0, frame.pulses, np.nan)

    def _next(self) -> tuple[_Frame, Any] | None:
        """Wait for a frame that is new; None when there is none or the count began anew."""
        end, other = time.monotonic() + self._timeout, None
        while (found := self._heard(end)) is not None:
            frame, peer = found
            anew = frame.number == 0 != self._count or frame.number < self._count - LATE
            if peer != self._peer:
                # one that counts from the start takes over, if the one that was met stays silent
                if other is None and (anew or frame.number == 0):
                    quiet = min(QUIET, 0.5 * self._timeout)
                    other, end = found, min(end, time.monotonic() + quiet)
                else:
                    self._refuse_second(peer)
                continue
            if other is not None:
                self._refuse_second(other[1])
            if anew:
                other = found
                break
            if frame.number > self._count:
                return found
            end, other = time.monotonic() + self._timeout, None
            if frame.number == self._count:
                self._repeat()
        if other is not None:
            # the session ends, and the next one begins with this frame
            self._first, self.restarted = other, True
            self._peer, self.ended = other[1], "the autopilot restarted"
        return None

    def _send(self) -> None:
        """Send the answer to the autopilot that was met."""
        try:
            self._ear.sendto(self._said, self._peer)
        except OSError as error:  # it may be out of reach for a while, and asks again
            self.refusals.say("a reply that could not be sent", f"({error.strerror or error})")

    def _repeat(self) -> None:
        """Answer a frame that came again, so often in a second."""
        now = time.monotonic()
        if now > self._second + 1.0:
            self._again, self._second = 0, now
        self._again += 1
        if self._again <= MOST_AGAIN:
            self._send()
        else:
            self.refusals.say(f"a frame that is repeated more than {MOST_AGAIN} times a second")

    def _refuse_second(self, peer: Any) -> None:
        self.refusals.say("a frame of a second autopilot", f"at {peer[0]}:{peer[1]}")

    def _heard(self, end: float) -> tuple[_Frame, Any] | None:
        """Wait for a good packet; None at a time of the clock [s]."""
        while (left := end - time.monotonic()) > 0.0:
            self._ear.settimeout(left)
            try:
                packet, peer = self._ear.recvfrom(MOST)
            except TimeoutError:
                return None
            except ConnectionError:
                # the peer of the last answer has gone; another may come
                continue
            if not admitted(peer[0], self._allowed) or not peer[1]:
                self.refusals.say(
                    "a packet from an address outside private networks, which peer=ADDRESS admits",
                    f"({peer[0]}:{peer[1]})",
                )
                continue
            found = _parse(packet)
            if isinstance(found, _Frame):
                return found, peer
            self.refusals.say(found, f"({len(packet)} bytes from {peer[0]}:{peer[1]})")
        return None

    def close(self) -> None:
        """Release the socket."""
        self._ear.close()
