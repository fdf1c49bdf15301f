"""Twenty-eight flights of the Crazyflie of `drone-models`, with its own laws.

    python -m benchmarks.other_simulators.crazyflies OUT [--only NAME ...]

The package (MIT; Marcel Rath, Martin Schuck) states numbers of measured vehicles and their
equations as a right-hand side: drag along the body's axes, rotors of first order, gyroscopic
torques of the propellers. This file integrates it with a Runge-Kutta step of 2 ms, flies it with
a geometric controller, and changes its numbers; nothing of the package is copied. Most flights
have thrust and torque by the square of the speed and one lag up and down, as a robot folder
states them; `u01_published` has all of the package's numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomllib
import yaml
from scipy.spatial.transform import Rotation

from benchmarks.other_simulators.flight_sets import (
    Columns,
    Floats,
    cases_of,
    cross,
    split_sensors,
    urdf,
    write_set,
)
from benchmarks.other_simulators.multirotors import PATHS, Path3, columns, table

SEED = 5101
RATE, STEPS, WARM, LASTS = 100, 5, 3.0, 16.0
"""Rows and commands a second, steps a row, seconds before the log, and its length."""
G, LAG, TURNS = 9.81, 0.06, 60.0 / (2.0 * np.pi)
VEHICLE = "cf2x_L250"
STIFF, DAMPED = 3.2, 2.6
"""Gains of position [1/s^2] and velocity [1/s]."""
TURN, CALM, TRIM = 70.0, 13.0, 60.0
"""Gains of attitude [1/s^2], rate [1/s] and the attitude's integral [1/s^3]."""


def numbers() -> dict[str, Any]:
    """Return the package's numbers of the vehicle."""
    text = resources.files("drone_models").joinpath("data/params.toml").read_text("utf-8")
    known = tomllib.loads(text)[VEHICLE]
    keys = ("mass", "L", "J", "rpm2thrust", "rpm2torque", "mixing_matrix", "prop_inertia")
    keys = (*keys, "drag_matrix", "rotor_dyn_coef", "gravity_vec")
    return {key: np.asarray(known[key], float) for key in keys}


def stated() -> dict[str, Any]:
    """Return the numbers that a robot folder states: squares of the speed through the hover."""
    known = numbers()
    arm, mass = float(known["L"]), float(known["mass"])
    a, b, c = known["rpm2thrust"]
    speed = (-b + np.sqrt(b * b + c * (mass * G - 4.0 * a))) / (2.0 * c)
    u, v, w = known["rpm2torque"]
    return {
        "mass": mass,
        "J": known["J"],
        "arms": np.sign(known["mixing_matrix"][:2].T)[:, ::-1] * [-arm, arm],
        "spin": known["mixing_matrix"][2],
        "thrust": mass * G / 4.0 / speed**2,
        "torque": (u + v * speed + w * speed**2) / speed**2,
        "hover": speed,
    }


class Plant:
    """The package's right-hand side, its numbers over time, and forces that it lacks."""

    def __init__(self, path: Path3, changes: Mapping[str, Any]) -> None:
        """Build the vehicle at the beginning of a path."""
        self.known, self.sheet, self.changes = numbers(), stated(), changes
        from drone_models.first_principles import dynamics

        self.law = dynamics
        p, s = self.known, self.sheet
        if not changes.get("published"):
            p["rpm2thrust"] = np.array([0.0, 0.0, s["thrust"]])
            p["rpm2torque"] = np.array([0.0, 0.0, s["torque"]])
            p["rotor_dyn_coef"] = np.array([1.0, 0.0, 1.0, 0.0]) / changes.get("lag", LAG)
            p["prop_inertia"] = np.array(changes.get("propellers", 0.0) * p["prop_inertia"])
            p["drag_matrix"] = p["drag_matrix"] * changes.get("drag", 0.0)
        p["J"] = p["J"] * np.asarray(changes.get("inertia", (1.0, 1.0, 1.0)))[:, None]
        mass, place = changes.get("payload", (0.0, (0.0, 0.0, 0.0)))
        whole = float(p["mass"]) + mass
        self.centre = np.asarray(changes.get("centre", (0.0, 0.0, 0.0)), float)
        if mass:
            self.centre = mass * np.asarray(place, float) / whole
            for m, arm in ((float(p["mass"]), -self.centre), (mass, place - self.centre)):
                p["J"] = p["J"] + m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        p["mass"] = np.array(whole)
        p["J_inv"] = np.linalg.inv(p["J"])
        at, speed = path(0.0)[:2]
        half = path(0.0)[3] / 2.0
        turn = [0.0, 0.0, np.sin(half), np.cos(half)]
        self.state = np.concatenate([at, turn, speed, np.zeros(3), np.full(4, s["hover"])])

    def loss(self, t: float) -> Floats:
        """Share of thrust and torque that each rotor lacks."""
        c = self.changes
        lost = np.full(4, 1.0 - c.get("thrust", 1.0) + c.get("sag", 0.0) * max(t, 0.0) / LASTS)
        for rotor, share in c.get("weak", ()):
            lost[rotor - 1] += share
        return lost

    def wind(self, t: float) -> Floats:
        """Wind in the axes of the world [m/s]."""
        air = np.array(self.changes.get("wind", (0.0, 0.0, 0.0)), float)
        if "gust" in self.changes:
            size, every, width = self.changes["gust"]
            phase = (max(t, 0.0) + every / 2) % every
            air[0] += 0.5 * size * (1 - np.cos(2 * np.pi * phase / width)) * (phase < width)
        return air

    def slope(self, t: float, state: Floats, command: Floats) -> Floats:
        """Derivative of position, attitude, velocity, rate and rotor speeds."""
        p, speed = self.known, state[13:]
        turn = Rotation.from_quat(state[3:7]).as_matrix()
        a, b, c = p["rpm2thrust"]
        d, e, f = p["rpm2torque"]
        thrust, torque = a + b * speed + c * speed**2, d + e * speed + f * speed**2
        lost, arms = self.loss(t), np.column_stack([self.sheet["arms"], np.zeros(4)])
        force = -np.array([0.0, 0.0, lost @ thrust])
        moment = np.array([-(arms[:, 1] * lost) @ thrust, (arms[:, 0] * lost) @ thrust, 0.0])
        moment[2] = -(self.sheet["spin"] * lost) @ torque
        left = np.array([0.0, 0.0, (1.0 - lost) @ thrust])
        moment = moment - cross(self.centre, left)
        # the drag of the air that moves: the package's law knows still air only
        force = force - p["drag_matrix"] @ (turn.T @ self.wind(t))
        parts = self.law(
            *(state[:3], state[3:7], state[7:10], state[10:13], command, speed),
            *(turn @ force, turn @ moment),
            **p,
        )
        x, y, z, w = state[3:7]
        # the package warns of its own derivative of the attitude
        rate = np.array([[w, -z, y], [z, w, -x], [-y, x, w], [-x, -y, -z]]) @ state[10:13] / 2.0
        return np.concatenate([parts[0], rate, *parts[2:]])

    def step(self, t: float, command: Floats, dt: float) -> None:
        """Advance by one Runge-Kutta step [s]."""
        s = self.state
        k1 = self.slope(t, s, command)
        k2 = self.slope(t + dt / 2, s + dt / 2 * k1, command)
        k3 = self.slope(t + dt / 2, s + dt / 2 * k2, command)
        k4 = self.slope(t + dt, s + dt * k3, command)
        self.state = s + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.state[3:7] /= np.linalg.norm(self.state[3:7])


def commanded(sheet: Mapping[str, Any], state: Floats, wanted: Any, pull: Floats) -> Floats:
    """Return the speeds of the rotors [rpm] that a geometric controller asks for.

    Args:
        sheet: numbers of the vehicle as its pilot knows them.
        state: of the vehicle.
        wanted: position, velocity, acceleration, heading and its rate.
        pull: integrals of the errors of position [m s] and attitude [rad s]; goes on in place.
    """
    at, speed, bend, yaw, rate = wanted
    turn, spin = Rotation.from_quat(state[3:7]).as_matrix(), state[10:13]
    pull[:3] = np.clip(pull[:3] + (at - state[:3]) / RATE, -2.0, 2.0)
    up = bend + STIFF * (at - state[:3]) + DAMPED * (speed - state[7:10]) + 0.8 * pull[:3]
    up = up + np.array([0.0, 0.0, G])
    z = up / np.linalg.norm(up)
    y = cross(z, np.array([np.cos(yaw), np.sin(yaw), 0.0]))
    y /= np.linalg.norm(y)
    goal = np.column_stack([cross(y, z), y, z])
    error = goal.T @ turn
    error = 0.5 * np.array(
        [error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]]
    )
    # 3 mm off the centre ask for 65 rad/s^2 at hover: the integral has to reach beyond that
    pull[3:] = np.clip(pull[3:] + error / RATE, -4.0, 4.0)
    turning = turn.T @ np.array([0.0, 0.0, rate])
    moment = -sheet["J"] @ (TURN * error + CALM * (spin - turning) + TRIM * pull[3:])
    arms = sheet["arms"]
    yawing = sheet["spin"] * sheet["torque"] / sheet["thrust"]
    rows = np.array([np.ones(4), arms[:, 1], -arms[:, 0], yawing])
    lift = sheet["mass"] * float(up @ turn[:, 2])
    thrust = np.linalg.solve(rows, [lift, *moment])
    share = sheet["mass"] * G / 4.0
    return np.sqrt(np.clip(thrust, 0.1 * share, 2.5 * share) / sheet["thrust"])


def fly(*, rng: np.random.Generator, path: Path3, **changes: Any) -> Columns:
    """Fly a path and return the log.

    Args:
        rng: of noise.
        path: wanted.
        changes: what acts; see ``Plant`` and ``measured``.
    """
    sensors = split_sensors(changes)
    late = round(changes.pop("late", 0.0) * RATE * STEPS)
    plant, dt, pull = Plant(path, changes), 1.0 / (RATE * STEPS), np.zeros(6)
    rows: dict[str, list[Any]] = {
        k: [] for k in ("t", "position", "q", "rate", "turning", "force", "cmd", "w")
    }
    sent = [np.full(4, plant.sheet["hover"])] * (late + 1)
    for n in range(int((WARM + LASTS) * RATE)):
        t, s = n / RATE - WARM, plant.state
        command = commanded(plant.sheet, s, path(n / RATE), pull)
        if t > -1e-9:
            slope = plant.slope(t, s, sent[-1 - late])
            turn, lever, w = Rotation.from_quat(s[3:7]).as_matrix(), -plant.centre, s[10:13]
            force = turn.T @ (slope[7:10] + np.array([0.0, 0.0, G]))
            force = force + np.cross(slope[10:13], lever) + np.cross(w, np.cross(w, lever))
            found = (t, s[:3] + turn @ lever, s[3:7], w, slope[10:13], force)
            for key, value in zip(rows, (*found, command / TURNS, s[13:] / TURNS), strict=True):
                rows[key].append(np.array(value))
        for k in range(STEPS):
            sent = [*sent[-late - 1 :], command]
            plant.step(t + k * dt, sent[-1 - late], dt)
    return table(rng, {k: np.array(v) for k, v in rows.items()}, sensors, percent=False)


def robot(*, lag: float = LAG, drag: bool = False, turned: float = -1.0) -> dict[str, str]:
    """Return the files of a robot folder as the package's numbers state it."""
    s, law = stated(), numbers()["drag_matrix"]
    places = [[float(x), float(y), 0.0] for x, y in s["arms"]]
    rotors: dict[str, Any] = {"actuator": "rotors", "position": places}
    # a rotor turns against the torque that it puts on the body
    rotors |= {"direction": [turned * float(d) for d in s["spin"]], "radius": [0.0235]}
    rotors |= {"thrust_coefficient": [float(s["thrust"]) * TURNS**2]}
    rotors |= {"torque_coefficient": [float(s["torque"]) * TURNS**2], "max_speed": [3500.0]}
    sheet: dict[str, Any] = {"summary": "Crazyflie as drone-models states it"}
    sheet |= {"urdf": "crazyflie.urdf", "fixed_base": False}
    sheet["actuators"] = {"rotors": rotors | {"time_constant": [lag]}}
    if drag:
        air: dict[str, Any] = {"effect": "linear_drag", "medium": "air"}
        air |= {f"coefficient_{a}": -float(law[k, k]) for k, a in enumerate("xyz")}
        sheet["effects"] = {"air": air}
    sheet["sensors"] = {"imu": {"sensor": "imu", "link": "base_link"}}
    words = yaml.safe_dump(sheet, sort_keys=False, default_flow_style=None)
    body = urdf("crazyflie", s["mass"], np.diag(s["J"]), (0.09, 0.09, 0.03))
    return {"robot.yaml": words, "crazyflie.urdf": body}


if __name__ == "__main__":
    write_set(
        cases_of(Path(__file__).with_suffix(".yaml"), PATHS, robot="cf"),
        fly,
        seed=SEED,
        robots={
            "cf": robot(),
            "cf_drag": robot(drag=True),
            "cf_quick": robot(lag=0.02),
            "cf_turned": robot(turned=1.0),
        },
        maps={"map.yaml": columns("rotor_speed_cmd")},
        packages=("drone-models", "numpy", "scipy"),
    )
