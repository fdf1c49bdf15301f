"""Forty flights of the quadcopter of `quad-sim-python`, with its own laws and its own controller.

    python -m benchmarks.other_simulators.multirotors OUT [--only NAME ...]

The package (MIT; John Bass, Ricardo de Azambuja) states its equations as a right-hand side; this
file integrates it with a Runge-Kutta step of 2 ms, changes its numbers over time, and adds the
forces that it has no law for. Nothing of the package is copied.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.other_simulators.flight_sets import (
    Columns,
    Floats,
    cases_of,
    cross,
    measured,
    split_sensors,
    urdf,
    write_set,
)

SEED = 4701
RATE, STEPS, WARM, LASTS = 100, 5, 3.0, 18.0
"""Rows and commands a second, steps a row, seconds before the log, and its length."""
G, MASS, ARM, LAG = 9.81, 1.2, 0.16, 0.0075
INERTIA = (0.0123, 0.0123, 0.0224)
THRUST, TORQUE, RADIUS, TOP = 1.076e-5, 1.632e-7, 0.1, 925.0
ARMS = np.array([[ARM, ARM, 0.05], [ARM, -ARM, 0.05], [-ARM, -ARM, 0.05], [-ARM, ARM, 0.05]])
SLOPE, OFFSET = 8.49, 74.7
"""The package's curve of its motors: speed [rad/s] of a command in percent."""

Path3 = Callable[[float], tuple[Floats, Floats, Floats, float, float]]
"""Wanted position, velocity, acceleration, heading and its rate, over time."""


def sines(
    size: Sequence[float], hertz: Sequence[float], yaw: float = 0.0, turn: float = 0.0
) -> Path3:
    """Return a Lissajous path [m, Hz], with a heading of ``yaw`` +- ``turn`` [rad]."""
    a, w = np.asarray(size), 2.0 * np.pi * np.asarray(hertz)
    phase = np.array([0.0, 0.9, 2.1])

    def path(t: float) -> tuple[Floats, Floats, Floats, float, float]:
        s, c = np.sin(w * t + phase), np.cos(w * t + phase)
        heading, rate = yaw + turn * np.sin(0.9 * t), 0.9 * turn * np.cos(0.9 * t)
        return a * s + [0, 0, 3.0], a * w * c, -a * w * w * s, heading, rate

    return path


def circle(radius: float, speed: float) -> Path3:
    """Return a level circle, flown nose first [m, m/s]."""
    w = speed / radius

    def path(t: float) -> tuple[Floats, Floats, Floats, float, float]:
        out = np.array([np.cos(w * t), np.sin(w * t), 0.0])
        along = np.array([-out[1], out[0], 0.0])
        yaw = (w * t + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
        return radius * out + [0, 0, 3.0], speed * along, -speed * w * out, yaw, w

    return path


def places(seed: int, *, reach: float = 3.0, leg: float = 2.0) -> Path3:
    """Return smooth legs (least jerk) between random places in a cube [m, s]."""
    at = np.random.default_rng(seed).uniform(-reach, reach, (60, 3)) * [1.0, 1.0, 0.4] + [0, 0, 3.0]

    def path(t: float) -> tuple[Floats, Floats, Floats, float, float]:
        n, s = int(t // leg), (t % leg) / leg
        go = at[n + 1] - at[n]
        share = s**3 * (10 - 15 * s + 6 * s * s)
        speed = 30 * s * s * (1 - s) ** 2 / leg
        bend = 60 * s * (1 - s) * (1 - 2 * s) / leg**2
        return at[n] + share * go, speed * go, bend * go, 0.0, 0.0

    return path


def jumps(seed: int, *, reach: float = 1.5, leg: float = 2.5) -> Path3:
    """Return places that the controller itself flies to, without a path between [m, s]."""
    at = np.random.default_rng(seed).uniform(-reach, reach, (60, 3)) * [1.0, 1.0, 0.5] + [0, 0, 3.0]

    def path(t: float) -> tuple[Floats, Floats, Floats, float, float]:
        return at[int(t // leg)].copy(), np.zeros(3), np.zeros(3), 0.0, 0.0

    return path


def low() -> Path3:
    """Return a path close above the ground."""
    above = sines((1.2, 1.0, 0.15), (0.21, 0.17, 0.23))

    def path(t: float) -> tuple[Floats, Floats, Floats, float, float]:
        at, speed, bend, yaw, rate = above(t)
        return at - [0, 0, 2.7], speed, bend, yaw, rate

    return path


def dryden(
    rng: np.random.Generator, speed: float, sigma: float, step: float
) -> Callable[[float], Floats]:
    """Return turbulence [m/s] along and across a wind: first-order filters of white noise.

    MIL-F-8785C at 6 m: lengths of 100 m along and 50 m across.
    """
    rows = int((WARM + LASTS) / step) + 2
    air = np.zeros((rows, 2))
    for k, length in enumerate((20.0, 10.0)):
        share = np.exp(-speed * step / length)
        kick = sigma * np.sqrt(1 - share * share) * rng.normal(size=rows)
        for n in range(1, rows):
            air[n, k] = share * air[n - 1, k] + kick[n]
    return lambda t: air[min(int(max(t, 0.0) / step), rows - 1)]


class Load:
    """A load that swings on a string below the vehicle: spring and damper along the string."""

    def __init__(self, mass: float, length: float) -> None:
        """Hang a load [kg] on a string [m]."""
        self.mass, self.length = mass, length

    def start(self, position: Floats) -> Floats:
        """Place and velocity of the load at rest."""
        return np.concatenate([position - [0, 0, self.length + self.mass * G / 400.0], np.zeros(3)])

    def pull(self, load: Floats, position: Floats, velocity: Floats) -> tuple[Floats, Floats]:
        """Force on the vehicle [N] and derivative of the load."""
        way = load[:3] - position
        far = float(np.linalg.norm(way))
        unit = way / far
        tension = 400.0 * (far - self.length) + 2.0 * float(unit @ (load[3:] - velocity))
        force = max(tension, 0.0) * unit
        return force, np.concatenate([load[3:], -force / self.mass - [0, 0, G]])


def matrix(q: Floats) -> Floats:
    """Rotation of a quaternion w, x, y, z."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Plant:
    """The package's right-hand side, its numbers over time, and forces that it lacks."""

    def __init__(self, path: Path3, changes: Mapping[str, Any], rng: np.random.Generator) -> None:
        """Build the vehicle at the beginning of a path."""
        from quad_sim_python.quad import Quadcopter, quad_params

        self.sheet = quad_params | {"IB": np.diag(INERTIA), "Cd": changes.get("drag", 0.0)}
        self.sheet["tau"] = changes.get("lag", LAG)
        at, speed = path(0.0)[:2]
        begin = [*at, 0.0, 0.0, path(0.0)[3], *speed, 0.0, 0.0, 0.0]
        self.quad = Quadcopter(0.0, begin, orient="ENU", params=dict(self.sheet))
        for key in ("mixerFM", "mixerFMinv", "FF", "w_hover", "thr_hover"):
            self.sheet[key] = self.quad.params[key]
        half = path(0.0)[3] / 2.0
        self.quad.state[3:7] = [np.cos(half), 0.0, 0.0, np.sin(half)]
        self.changes, self.centre = changes, np.zeros(3)
        self.air = dryden(rng, 5.0, changes["dryden"], 0.01) if "dryden" in changes else None
        self.load = Load(*changes["slung"]) if "slung" in changes else None
        self.load_state = self.load.start(at) if self.load else np.zeros(6)

    def at(self, t: float) -> None:
        """Set the numbers of the package that hold at a time of the log [s]."""
        c, p = self.changes, self.quad.params
        thrust, torque = np.full(4, THRUST), np.full(4, TORQUE * c.get("torque", 1.0))
        thrust, torque = thrust * c.get("thrust", 1.0), torque * c.get("thrust", 1.0)
        for rotor, loss, share, begin in c.get("weak", ()):
            if t >= begin:
                thrust[rotor - 1] *= 1.0 - loss
                torque[rotor - 1] *= 1.0 - loss * share
        if "bent" in c:
            rotor, size, hertz = c["bent"]
            thrust[rotor - 1] *= 1.0 + size * np.sin(2 * np.pi * hertz * t)
        if "ground" in c:
            thrust = thrust / (1.0 - (RADIUS / (4.0 * max(self.quad.state[2] + 0.05, 0.06))) ** 2)
        p["kTh"], p["kTo"] = thrust, torque
        p["kp"] = 1.0 - c.get("sag", 0.0) * max(t, 0.0) / LASTS
        mass, place, until = c.get("payload", (0.0, (0, 0, 0), 1e9))
        mass = mass if t < until else 0.0
        p["mB"] = MASS + mass + c.get("mass", 0.0)
        before = self.centre
        self.centre = np.asarray(c.get("centre", (0, 0, 0)), float)
        inertia = np.diag(INERTIA) * np.asarray(c.get("inertia", (1, 1, 1)))
        if mass:
            self.centre = mass * np.asarray(place, float) / p["mB"]
            for m, arm in ((MASS, -self.centre), (mass, place - self.centre)):
                inertia = inertia + m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        p["IB"], self.inverse = inertia, np.linalg.inv(inertia)
        arms = ARMS - self.centre
        self.torques = np.array(
            [arms[:, 1] * thrust, -arms[:, 0] * thrust, torque * [1, -1, 1, -1]]
        )
        self.moved(self.centre - before)

    def moved(self, shift: Floats) -> None:
        """Move place and velocity from the old centre of gravity to the new one (body axes [m])."""
        state = self.quad.state
        turn = matrix(state[3:7])
        state[:3] += turn @ shift
        state[7:10] += turn @ np.cross(state[10:13], shift)

    def wind(self, t: float) -> tuple[float, float, float]:
        """Speed, heading and elevation of the wind as the package takes them [m/s, rad, rad]."""
        speed, heading = self.changes.get("wind", (0.0, 0.0))
        vector = speed * np.array([np.cos(heading), np.sin(heading)])
        if "gust" in self.changes:
            size, every, width = self.changes["gust"]
            phase = (max(t, 0.0) + every / 2) % every
            vector[0] += (
                0.5 * size * (1 - np.cos(2 * np.pi * phase / width)) if phase < width else 0.0
            )
        if self.air:
            vector = vector + self.air(t + WARM)
        return float(np.hypot(*vector)), float(np.arctan2(vector[1], vector[0])), 0.0

    def slope(
        self, t: float, state: Floats, load: Floats, command: Floats, wind: Any
    ) -> tuple[Floats, Floats]:
        """Derivatives of vehicle and load.

        The package's rate of yaw has (Ixx - Izz) p q / Izz, where Euler's equation has Ixx - Iyy;
        one flight keeps that, all others turn by Euler's equation about the centre of gravity.
        """
        p = self.quad.params
        out = self.quad.state_dot(t, state, command, wind)
        if not self.changes.get("published"):
            speed = np.clip(state[13:21:2], p["minWmotor"], p["maxWmotor"]) ** 2
            w = state[10:13]
            out[10:13] = self.inverse @ (self.torques @ speed - cross(w, p["IB"] @ w))
        if not self.load:
            return out, np.zeros(6)
        force, moved = self.load.pull(load, state[:3], state[7:10])
        out[7:10] += force / p["mB"]
        return out, moved

    def step(self, t: float, command: Floats, dt: float) -> None:
        """Advance by one Runge-Kutta step [s]."""
        wind, s, b = self.wind(t), self.quad.state, self.load_state
        k1, l1 = self.slope(t, s, b, command, wind)
        k2, l2 = self.slope(t, s + dt / 2 * k1, b + dt / 2 * l1, command, wind)
        k3, l3 = self.slope(t, s + dt / 2 * k2, b + dt / 2 * l2, command, wind)
        k4, l4 = self.slope(t, s + dt * k3, b + dt * l3, command, wind)
        self.quad.state = s + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.load_state = b + dt / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
        self.quad.state[3:7] /= np.linalg.norm(self.quad.state[3:7])


def fly(*, rng: np.random.Generator, path: Path3, percent: bool = False, **changes: Any) -> Columns:
    """Fly a path and return the log.

    Args:
        rng: of noise and turbulence.
        path: wanted.
        percent: the log has commands in percent, as the package's motors take them.
        changes: what acts; see ``Plant`` and ``measured``.
    """
    from quad_sim_python.ctrl import Controller

    sensors = split_sensors(changes)
    late = round(changes.pop("late", 0.0) * RATE * STEPS)
    plant, dt = Plant(path, changes, rng), 1.0 / (RATE * STEPS)
    pilot = Controller(plant.sheet, orient="ENU")
    rows: dict[str, list[Any]] = {
        k: [] for k in ("t", "position", "q", "rate", "turning", "force", "cmd", "w")
    }
    sent = [np.full(4, plant.sheet["w_hover"])] * (late + 1)
    slope = np.zeros(21)
    for n in range(int((WARM + LASTS) * RATE)):
        t = n / RATE - WARM
        plant.at(t)
        s = plant.quad.state
        at, speed, bend, yaw, rate = path(n / RATE)
        pilot.control(
            *(1.0 / RATE, "xyz_pos", "yaw", at, speed, bend, np.zeros(3), yaw, rate),
            *(s[:3], s[7:10], slope[7:10], s[3:7], s[10:13], slope[10:13], 0.0),
        )
        command = pilot.getMotorSpeeds()
        slope = plant.slope(t, s, plant.load_state, sent[-1 - late], plant.wind(t))[0]
        if t > -1e-9:
            turn = matrix(s[3:7])
            lever, w = -plant.centre, s[10:13]
            force = turn.T @ (slope[7:10] + np.array([0.0, 0.0, G]))
            force = force + np.cross(slope[10:13], lever) + np.cross(w, np.cross(w, lever))
            found = (
                t,
                s[:3] + turn @ lever,
                s[[4, 5, 6, 3]],
                w,
                slope[10:13],
                force,
                command,
                s[13:21:2],
            )
            for key, value in zip(rows, found, strict=True):
                rows[key].append(np.array(value))
        for k in range(STEPS):
            sent = [*sent[-late - 1 :], command]
            plant.step(t + k * dt, sent[-1 - late], dt)
    return table(rng, {k: np.array(v) for k, v in rows.items()}, sensors, percent=percent)


def table(
    rng: np.random.Generator, rows: dict[str, Floats], sensors: Any, *, percent: bool
) -> Columns:
    """Return the columns of the log."""
    states = {"position": rows["position"], "q_xyzw": rows["q"], "rate": rows["rate"]}
    states |= {"turning": rows["turning"], "force": rows["force"]}
    seen = measured(rng, rows["t"], states, **sensors)
    out = {"t": rows["t"]}
    names = {"position": ("x", "y", "z"), "q_xyzw": ("qx", "qy", "qz", "qw")}
    names |= {"force": ("acc_x", "acc_y", "acc_z"), "rate": ("gyr_x", "gyr_y", "gyr_z")}
    for key, columns in names.items():
        out |= {c: seen[key][:, k] for k, c in enumerate(columns)}
    command = (rows["cmd"] - OFFSET) / SLOPE if percent else rows["cmd"]
    out |= {f"cmd{k + 1}": command[:, k] for k in range(4)}
    speed = rows["w"] + rng.normal(0.0, 0.5, rows["w"].shape)
    return out | {f"w{k + 1}": speed[:, k] for k in range(4)}


def robot(*, mass: float = MASS, lag: float = 2 * LAG, drag: float = 0.0) -> dict[str, str]:
    """Return the files of a robot folder as the package's numbers state it."""
    places = [[float(v) for v in arm] for arm in ARMS]
    rotors: dict[str, Any] = {"actuator": "rotors", "position": places}
    rotors |= {"direction": [-1.0, 1.0, -1.0, 1.0], "thrust_coefficient": [THRUST]}
    rotors |= {"torque_coefficient": [TORQUE], "radius": [RADIUS], "max_speed": [TOP]}
    sheet: dict[str, Any] = {
        "summary": "Quadcopter as quad-sim-python states it",
        "urdf": "quad.urdf",
    }
    sheet |= {"fixed_base": False, "actuators": {"rotors": rotors | {"time_constant": [lag]}}}
    if drag:
        law: dict[str, Any] = {"effect": "quadratic_drag", "medium": "air", "form": "isotropic"}
        sheet["effects"] = {"air": law | {f"coefficient_{a}": drag for a in "xyz"}}
    sheet["sensors"] = {"imu": {"sensor": "imu", "link": "base_link"}}
    words = yaml.safe_dump(sheet, sort_keys=False, default_flow_style=None)
    return {"robot.yaml": words, "quad.urdf": urdf("quad", mass, INERTIA, (0.3, 0.3, 0.1))}


ROBOTS = {
    "quad": robot(),
    "quad_drag": robot(drag=0.03),
    "quad_drag3": robot(drag=0.06),
    "quad_slow": robot(lag=0.03),
    "quad_light": robot(mass=1.1),
}
_POSE = {"t": "t", "x": "position_x", "y": "position_y", "z": "position_z"}
_POSE |= {f"q{a}": f"orientation_{a}" for a in "xyzw"}
_IMU = {f"acc_{a}": f"specific_force_{a}" for a in "xyz"}
_IMU |= {f"gyr_{a}": f"angular_velocity_{a}" for a in "xyz"}
_SPEEDS = {f"w{k}": f"rotor_speed_{k}" for k in range(1, 5)}


def columns(command: str) -> dict[str, Any]:
    """Return a map of the log's columns."""
    names = {f"cmd{k}": f"{command}_{k}" for k in range(1, 5)}
    return {"reader": "csv", "columns": _POSE | _IMU | names | _SPEEDS}


MAPS = {
    "map.yaml": columns("rotor_speed_cmd"),
    "map_percent.yaml": columns("motor_pwm"),
    "ground.yaml": {"environment": {"ground_level": 0.0}},
}
PATHS: dict[str, Callable[..., Path3]] = {
    "sines": sines,
    "circle": circle,
    "places": places,
    "jumps": jumps,
    "low": low,
}
CASES = cases_of(Path(__file__).with_suffix(".yaml"), PATHS, robot="quad")


if __name__ == "__main__":
    made_with = ("quad-sim-python", "numpy", "scipy")
    write_set(CASES, fly, seed=SEED, robots=ROBOTS, maps=MAPS, packages=made_with)
