"""A stand-in for ArduPilot's SITL: it speaks its JSON interface and flies by PD laws of its own.

It shares no code with SEALS. ``python fake_ardupilot.py PORT MISSION`` prints what it saw as JSON.
"""

from __future__ import annotations

import json
import math
import socket
import struct
import sys
from typing import Any

Vector = list[float]
G = 9.81


class Sitl:
    """The wire: frames out, states in; a frame is sent again until it is answered."""

    def __init__(self, port: int, rate: int, channels: int = 16) -> None:
        """Open a socket."""
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(0.5)
        self.address, self.rate, self.count = ("127.0.0.1", port), rate, 0
        self.form = struct.Struct(f"<HHI{channels}H")
        self.magic, self.channels = (18458 if channels == 16 else 29569), channels
        self.last = -1.0

    def frame(self, pwm: list[int], count: int | None = None) -> bytes:
        """Return a frame."""
        padded = (pwm + [0] * self.channels)[: self.channels]
        number = self.count if count is None else count
        return self.form.pack(self.magic, self.rate, number, *padded)

    def step(self, pwm: list[int], tries: int = 60) -> dict[str, Any]:
        """Send a frame and return the state that answers it; one of an earlier time does not."""
        for _ in range(tries):
            state = self.ask(self.frame(pwm))
            while state is not None and state["timestamp"] <= self.last:
                state = self.answer()
            if state is not None:
                self.count, self.last = self.count + 1, state["timestamp"]
                return state
        raise TimeoutError("no answer")

    def ask(self, frame: bytes) -> dict[str, Any] | None:
        """Send a frame and return what comes back first."""
        self.socket.sendto(frame, self.address)
        return self.answer()

    def answer(self) -> dict[str, Any] | None:
        """Wait for a state."""
        try:
            line = self.socket.recv(65536)
        except (TimeoutError, ConnectionError):
            return None
        assert line.startswith(b"\n")
        assert line.endswith(b"\n")
        assert b" " not in line
        return json.loads(line)


def matrix(q: Vector) -> list[Vector]:
    """Rotation body to world of a quaternion w, x, y, z."""
    w, x, y, z = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


class Quad:
    """PD flight of a quadrotor in X, motors front right, back right, back left, front left.

    The first and third turn anticlockwise seen from above. Axes: north-east-down and
    forward-right-down.
    """

    mass, arm, k_t, k_q, top = 0.027, 0.0325, 1.28e-8, 7.6e-11, 3053.0
    inertia = (1.66e-5, 1.67e-5, 2.93e-5)

    def pwm(self, state: dict[str, Any], target: Vector) -> list[int]:
        """Pulses that lead to a place, heading north."""
        r = matrix(state["quaternion"])
        place, speed, gyro = state["position"], state["velocity"], state["imu"]["gyro"]
        pull = [
            max(-2.5, min(2.5, 4.0 * (target[k] - place[k]) - 3.2 * speed[k])) for k in range(3)
        ]
        pull[2] -= G
        # thrust is against the body's z axis
        thrust = -self.mass * sum(pull[k] * r[k][2] for k in range(3))
        size = math.sqrt(sum(a * a for a in pull))
        down = [-a / size for a in pull]
        # tilt error in body axes: z_body x z_wanted
        wanted = [sum(r[k][j] * down[k] for k in range(3)) for j in range(3)]
        yaw = math.atan2(r[1][0], r[0][0])
        error = [-wanted[1], wanted[0], -yaw]
        stiff = (150.0, 150.0, 20.0)
        damp = (20.0, 20.0, 8.0)
        torque = [self.inertia[k] * (stiff[k] * error[k] - damp[k] * gyro[k]) for k in range(3)]
        return [self.pulse(f) for f in self.mix(thrust, torque)]

    def mix(self, thrust: float, torque: Vector) -> Vector:
        """Forces of the motors."""
        roll, pitch = torque[0] / (4 * self.arm), torque[1] / (4 * self.arm)
        yaw = torque[2] * self.k_t / (4 * self.k_q)
        base = thrust / 4
        # a rotor that turns anticlockwise pushes the body clockwise: towards positive yaw
        return [
            base - roll + pitch + yaw,
            base - roll - pitch - yaw,
            base + roll - pitch + yaw,
            base + roll + pitch - yaw,
        ]

    def pulse(self, force: float) -> int:
        """Pulse of a motor, proportional to its speed."""
        speed = math.sqrt(max(force, 0.0) / self.k_t)
        return round(1000 + 1000 * min(speed / self.top, 1.0))


class Diver:
    """PD depth hold of the six-thruster vehicle: heave by the three upright thrusters."""

    def pwm(self, state: dict[str, Any], target: Vector) -> list[int]:
        """Pulses that hold a depth; 1500 rests, 1100 to 1900 is full force back and forth."""
        error = target[2] - state["position"][2]
        force = -(40.0 * error - 35.0 * state["velocity"][2]) / 3.0
        pulse = round(1500 + 400 * max(-1.0, min(1.0, force / 40.0)))
        return [pulse, 1500, pulse, 1500, pulse, 1500]


def fly(port: int, mission: dict[str, Any]) -> dict[str, Any]:
    """Fly the legs of a mission; return what was seen."""
    rate = int(mission["rate"])
    sitl = Sitl(port, rate, int(mission.get("channels", 16)))
    pilot: Any = {"quad": Quad, "diver": Diver}[mission["vehicle"]]()
    idle = [1000] * 4 if mission["vehicle"] == "quad" else [1500] * 6
    state = sitl.step(idle)
    # a second autopilot, and rubbish
    other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for junk in (b"", b"\x1a", b"GET / HTTP/1.1\r\n\r\n", b"\xff" * 4000, sitl.frame(idle)[:-3]):
        other.sendto(junk, sitl.address)
    other.sendto(sitl.frame([2000] * 4, count=1), sitl.address)
    first, ends, fields = state["timestamp"], [], sorted(state)
    for leg in mission["legs"]:
        for _ in range(round(leg["seconds"] * rate)):
            state = sitl.step(pilot.pwm(state, leg["place"]) if leg.get("on", True) else idle)
        ends.append({"position": state["position"], "velocity": state["velocity"]})
    # the last frame once more: the same answer, and no step
    again = sitl.ask(sitl.frame(idle, count=sitl.count - 1))
    return {
        "first": first,
        "last": state["timestamp"],
        "frames": sitl.count,
        "ends": ends,
        "fields": fields,
        "again": again == state,
        "accel": state["imu"]["accel_body"],
    }


if __name__ == "__main__":
    print(json.dumps(fly(int(sys.argv[1]), json.loads(sys.argv[2]))))
