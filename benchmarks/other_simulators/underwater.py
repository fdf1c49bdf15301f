"""Forty dives of a BlueROV2 Heavy after von Benzon et al. 2022, typed in anew.

    python -m benchmarks.other_simulators.underwater OUT [--only NAME ...]

The paper's model in Fossen's form (doi 10.3390/jmse10121898; the source of its simulator was not
used): rigid body, added mass, linear and quadratic damping, weight and buoyancy, eight thrusters
with a lag, a current, and a controller of its own. Axes are forward-left-up, the world's z is up.
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
    Noise,
    cases_of,
    cross,
    measured,
    split_sensors,
    urdf,
    write_set,
)

SEED = 4702
RATE, STEPS, WARM, LASTS = 50, 3, 5.0, 36.0
"""Rows and commands a second, steps a row, seconds before the log, and its length."""
G, WATER = 9.81, 998.2
MASS, VOLUME, LIFTS_AT = 13.5, 0.0134, 0.01
"""Mass [kg], displaced volume [m^3], height of its centre above that of gravity [m]."""
INERTIA = np.array([0.26, 0.23, 0.37])
ADDED = np.array([6.36, 7.12, 18.68, 0.189, 0.135, 0.222])
LINEAR = np.array([13.7, 0.0, 33.0, 0.0, 0.8, 0.0])
SQUARE = np.array([141.0, 217.0, 190.0, 1.19, 0.47, 1.5])
LEVEL, UPRIGHT, DOWN = (0.156, 0.111), (0.120, 0.218), -0.085
"""Places of the level and of the upright thrusters beside the centre [m]; height of the level."""
LAG, FORCE = 0.05, 40.0
"""Lag of the thrusters [s] and their largest force [N]."""
_X, _Y = (1, 1, -1, -1), (1, -1, 1, -1)
PLACES = np.array(
    [[LEVEL[0] * a, LEVEL[1] * b, DOWN] for a, b in zip(_X, _Y, strict=True)]
    + [[UPRIGHT[0] * a, UPRIGHT[1] * b, 0.0] for a, b in zip(_X, _Y, strict=True)]
)
_H = np.sqrt(0.5)
AXES = np.array([[_H, -_H, 0], [_H, _H, 0], [_H, _H, 0], [_H, -_H, 0], *[[0, 0, 1.0]] * 4])
SHARES = np.vstack([AXES.T, np.cross(PLACES, AXES).T])
"""Forces and torques of the body of one newton of each thruster."""
NOISE = Noise(position=0.004, attitude=0.004, rate=0.004, force=0.04)

Pose = Callable[[float], tuple[Floats, Floats]]
"""Wanted position [m] and roll, pitch, yaw [rad] over time."""


def sines(
    size: Sequence[float], hertz: Sequence[float], turns: Sequence[float] = (0, 0, 0)
) -> Pose:
    """Return a Lissajous path with attitudes that swing by ``turns`` [rad]."""
    a, w = np.asarray(size), 2.0 * np.pi * np.asarray(hertz)
    b, v = np.asarray(turns), 2.0 * np.pi * np.array([0.21, 0.17, 0.06])

    def path(t: float) -> tuple[Floats, Floats]:
        return a * np.sin(w * t + [0.0, 0.9, 2.1]) + [0, 0, -5.0], b * np.sin(
            v * t + [0.4, 1.3, 0.0]
        )

    return path


def circle(radius: float, speed: float) -> Pose:
    """Return a level circle, nose first [m, m/s]."""
    w = speed / radius

    def path(t: float) -> tuple[Floats, Floats]:
        at = radius * np.array([np.cos(w * t), np.sin(w * t), 0.0]) + [0, 0, -5.0]
        return at, np.array([0.0, 0.0, w * t + np.pi / 2])

    return path


def places(seed: int, *, reach: float = 0.8, leg: float = 4.0, smooth: bool = True) -> Pose:
    """Return legs between random places in a cube [m, s], or jumps from one to the next."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-reach, reach, (40, 3)) * [1.0, 1.0, 0.6] + [0, 0, -5.0]
    yaw = rng.uniform(-1.0, 1.0, 40)

    def path(t: float) -> tuple[Floats, Floats]:
        n, s = int(t // leg), (t % leg) / leg
        share = s**3 * (10 - 15 * s + 6 * s * s) if smooth else 1.0
        turn = yaw[n] + share * (yaw[n + 1] - yaw[n])
        return at[n] + share * (at[n + 1] - at[n]), np.array([0.0, 0.0, turn])

    return path


def skew(v: Floats) -> Floats:
    """Matrix of a cross product."""
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def matrix(q: Floats) -> Floats:
    """Rotation of a quaternion x, y, z, w."""
    v, w = q[:3], q[3]
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * skew(v)


def euler(angles: Floats) -> Floats:
    """Rotation by yaw, pitch and roll."""
    (a, b, c), (d, e, f) = np.cos(angles), np.sin(angles)
    yaw = np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]])
    pitch = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    return yaw @ pitch @ np.array([[1, 0, 0], [0, a, -d], [0, d, a]])


class Vehicle:
    """Fossen's equations about the body origin, with what is hidden from the robot folder."""

    def __init__(self, path: Pose, changes: Mapping[str, Any]) -> None:
        """Start level at the beginning of a path, with the thrusters off."""
        self.changes, at = changes, path(0.0)
        yaw = at[1][2]
        self.state = np.zeros(21)
        self.state[:7] = [*at[0], 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)]
        self.state[7:10] = euler(np.array([0, 0, yaw])).T @ (path(0.02)[0] - at[0]) / 0.02
        self.at(-WARM)

    def at(self, t: float) -> None:
        """Set what holds at a time of the log [s]."""
        c = self.changes
        load, place, until = c.get("payload", (0.0, (0, 0, 0), 1e9))
        load, place = (load if t < until else 0.0), np.asarray(place, float)
        centre = np.asarray(c.get("centre", (0, 0, 0)), float)
        self.mass, self.pull = MASS + load, (MASS * centre + load * place) * G
        own = np.diag(INERTIA * c.get("inertia", 1.0))
        rigid = np.zeros((6, 6))
        for m, r, i in ((MASS, centre, own), (load, place, np.zeros((3, 3)))):
            rigid[:3, :3] += m * np.eye(3)
            rigid[:3, 3:] -= m * skew(r)
            rigid[3:, :3] += m * skew(r)
            rigid[3:, 3:] += i - m * skew(r) @ skew(r)
        self.rigid, self.added = rigid, np.diag(ADDED)
        self.inverse = np.linalg.inv(rigid + self.added)
        # a load of lead displaces water, too
        self.lift = WATER * G * (VOLUME + c.get("volume", 0.0) + load / 11340.0)
        self.lifts = np.asarray(c.get("lifts", (0.0, 0.0, LIFTS_AT)), float)
        self.gain = np.full(8, c.get("thrust", 1.0)) * (1 - c.get("sag", 0.0) * max(t, 0.0) / LASTS)
        for thruster, loss, begin in c.get("weak", ()):
            self.gain[thruster - 1] *= 1.0 - loss if t >= begin else 1.0

    def water(self, t: float, at: Floats) -> Floats:
        """Velocity of the water over ground, world axes [m/s]."""
        c, flow = self.changes, np.zeros(3)
        if "current" in c:
            flow[:] = c["current"]
        if "tide" in c:
            size, seconds = c["tide"]
            flow[0] += size * np.sin(2 * np.pi * max(t, 0.0) / seconds)
        if "shear" in c:
            flow[0] += c["shear"] * (at[2] + 5.0)
        if "waves" in c:
            size, seconds = c["waves"]
            phase = 2 * np.pi * t / seconds
            flow += size * np.array([np.cos(phase), 0.0, np.sin(phase)])
        return flow

    def slope(self, t: float, state: Floats, command: Floats) -> Floats:
        """Derivative of place, attitude, velocity (body axes) and thrust."""
        c, q, nu, push = self.changes, state[3:7], state[7:13], state[13:21]
        turn = matrix(q)
        spin, up = nu[3:], turn.T @ [0, 0, 1.0]
        flow = turn.T @ self.water(t, state[:3])
        through = nu - [*flow, 0, 0, 0]
        drag = (LINEAR + SQUARE * np.abs(through)) * through
        weight = -np.concatenate([self.mass * G * up, cross(self.pull, up)])
        lift = self.lift * np.concatenate([up, cross(self.lifts, up)])
        force = push * self.gain
        if "inflow" in c:
            ahead = np.einsum("ki,ki->k", AXES, through[:3] + np.cross(spin, PLACES))
            force = force * (1 - c["inflow"] * ahead * np.sign(push))
        thrust = SHARES @ force
        loads = thrust + weight + lift - drag - self.coriolis(self.rigid, nu)
        loads = loads - self.coriolis(self.added, through)
        # the current is steady over ground: its derivative in body axes is -w x flow
        loads[:3] -= self.added[:3, :3] @ cross(spin, flow)
        if "tether" in c:
            anchor, length, stiffness = c["tether"]
            way = np.asarray(anchor) - state[:3]
            far = float(np.linalg.norm(way))
            loads[:3] += turn.T @ (stiffness * max(far - length, 0.0) / far * way)
        bend = 0.5 * np.array([*(q[3] * spin + cross(q[:3], spin)), -q[:3] @ spin])
        wanted = command
        if "dead_zone" in c:
            wanted = np.where(np.abs(command) < c["dead_zone"], 0.0, command)
        lag = (wanted - push) / c.get("lag", LAG)
        return np.concatenate([turn @ nu[:3], bend, self.inverse @ loads, lag])

    @staticmethod
    def coriolis(inertia: Floats, nu: Floats) -> Floats:
        """Coriolis and centripetal loads of an inertia matrix (Fossen 2011, theorem 3.2)."""
        linear, angular = np.split(inertia @ nu, 2)
        spin = nu[3:]
        return np.concatenate([cross(spin, linear), cross(nu[:3], linear) + cross(spin, angular)])

    def step(self, t: float, command: Floats, dt: float) -> None:
        """Advance by one Runge-Kutta step [s]."""
        s = self.state
        k1 = self.slope(t, s, command)
        k2 = self.slope(t + dt / 2, s + dt / 2 * k1, command)
        k3 = self.slope(t + dt / 2, s + dt / 2 * k2, command)
        k4 = self.slope(t + dt, s + dt * k3, command)
        self.state = s + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.state[3:7] /= np.linalg.norm(self.state[3:7])


class Pilot:
    """PID control of all six axes, shared among the thrusters by the pseudo-inverse."""

    gains = (np.array([4.0, 4.0, 4.0, 36.0, 36.0, 9.0]), np.array([3.0, 3.0, 3.0, 9.0, 9.0, 5.0]))
    largest = np.array([2.0, 2.0, 2.0, 8.0, 8.0, 4.0])
    weights = np.concatenate([MASS + ADDED[:3], INERTIA + ADDED[3:]])

    def __init__(self, path: Pose) -> None:
        """Follow a path."""
        self.path, self.sum = path, np.zeros(6)
        self.shares = np.linalg.pinv(SHARES)

    def __call__(self, t: float, state: Floats) -> Floats:
        """Forces of the thrusters [N] at a time since the start [s]."""
        d = 0.02
        (p0, a0), (p1, a1), (p2, a2) = (self.path(max(t + k * d, 0.0)) for k in (-1, 0, 1))
        turn, wanted = matrix(state[3:7]), euler(a1)
        off = wanted.T @ turn
        error = -0.5 * np.array(
            [off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]]
        )
        place = turn.T @ (p1 - state[:3])
        slope = turn.T @ ((p2 - p0) / (2 * d)) - state[7:10]
        bend = turn.T @ ((p2 - 2 * p1 + p0) / d**2)
        change = (euler(a2) - euler(a0)) / (2 * d)
        rate = wanted.T @ change
        rate = np.array([rate[2, 1], rate[0, 2], rate[1, 0]]) - state[10:13]
        off_by = np.concatenate([place, error])
        self.sum = np.clip(self.sum + off_by / RATE, -2.0, 2.0)
        ask = self.gains[0] * off_by + self.gains[1] * np.concatenate([slope, rate]) + self.sum
        ask = self.weights * (
            np.clip(ask, -self.largest, self.largest)
            + np.concatenate([np.clip(bend, -1, 1), np.zeros(3)])
        )
        ask += (LINEAR + SQUARE * np.abs(state[7:13])) * state[7:13]
        # leave the thrusters some force to turn with
        ask[:3] = np.clip(ask[:3], -90.0, 90.0)
        return np.clip(self.shares @ ask, -FORCE, FORCE)


def dive(*, rng: np.random.Generator, path: Pose, **changes: Any) -> Columns:
    """Dive along a path and return the log.

    Args:
        rng: of the noise.
        path: wanted.
        changes: what acts; see ``Vehicle`` and ``measured``.
    """
    sensors = split_sensors(changes)
    late, dt = round(changes.pop("late", 0.0) * RATE * STEPS), 1.0 / (RATE * STEPS)
    vehicle, pilot = Vehicle(path, changes), Pilot(path)
    rows: dict[str, list[Any]] = {
        k: [] for k in ("t", "position", "q_xyzw", "rate", "turning", "force", "cmd")
    }
    sent = [np.zeros(8)] * (late + 1)
    for n in range(int((WARM + LASTS) * RATE)):
        t = n / RATE - WARM
        vehicle.at(t)
        s = vehicle.state
        command = pilot(n / RATE, s)
        if t > -1e-9:
            slope, turn = vehicle.slope(t, s, sent[-1 - late]), matrix(s[3:7])
            felt = slope[7:10] + np.cross(s[10:13], s[7:10]) + turn.T @ [0, 0, G]
            found = (t, s[:3], s[3:7], s[10:13], slope[10:13], felt, command)
            for key, value in zip(rows, found, strict=True):
                rows[key].append(np.array(value))
        for k in range(STEPS):
            sent = [*sent[-late - 1 :], command]
            vehicle.step(t + k * dt, sent[-1 - late], dt)
    return table(rng, {k: np.array(v) for k, v in rows.items()}, sensors)


def table(rng: np.random.Generator, rows: dict[str, Floats], sensors: Any) -> Columns:
    """Return the columns of the log."""
    seen = measured(rng, rows["t"], rows, noise=NOISE, **sensors)
    out = {"time": rows["t"]}
    names = {"position": ("east", "north", "up"), "q_xyzw": ("q1", "q2", "q3", "q0")}
    names |= {"force": ("imu_ax", "imu_ay", "imu_az"), "rate": ("imu_p", "imu_q", "imu_r")}
    for key, columns in names.items():
        out |= {c: seen[key][:, k] for k, c in enumerate(columns)}
    return out | {f"thruster{k + 1}": rows["cmd"][:, k] for k in range(8)}


def _law(name: str, linear: Floats, unit: str = "coefficient") -> dict[str, Any]:
    law: dict[str, Any] = {"effect": name, "medium": "water"}
    return law | {f"{unit}_{a}": float(v) for a, v in zip("xyz", linear, strict=True)}


def robot(
    *, linear: float = 1.0, square: float = 1.0, turning: float = 1.0, added: float = 1.0
) -> dict[str, str]:
    """Return the files of a robot folder; the factors scale what the paper states."""
    thrusters = {
        "actuator": "thrusters",
        "position": PLACES.tolist(),
        "axis": AXES.round(9).tolist(),
    }
    thrusters |= {"time_constant": [LAG], "max_force": [FORCE]}
    effects: dict[str, Any] = {}
    if linear:
        effects["slow_drag"] = _law("linear_drag", linear * LINEAR[:3])
    if square:
        effects["drag"] = _law("quadratic_drag", square * SQUARE[:3])
    if turning:
        law = _law("angular_drag", turning * LINEAR[3:])
        effects["turning"] = law | {
            k: v for k, v in _law("", turning * SQUARE[3:], "quadratic").items() if "_" in k
        }
    if added:
        law = {"effect": "added_mass"}
        law |= {f"mass_{a}": float(added * v) for a, v in zip("xyz", ADDED[:3], strict=True)}
        law |= {f"inertia_{a}": float(added * v) for a, v in zip("xyz", ADDED[3:], strict=True)}
        effects["water_inertia"] = law
    hull: dict[str, Any] = {
        "type": "box",
        "size": [0.457, 0.338, 0.254],
        "position": [0.0, 0.0, LIFTS_AT],
    }
    sheet: dict[str, Any] = {
        "summary": "BlueROV2 Heavy after von Benzon et al. 2022",
        "urdf": "rov.urdf",
    }
    sheet |= {
        "fixed_base": False,
        "hulls": {"base_link": {"shapes": [hull], "displaced_volume": VOLUME}},
    }
    sheet |= {"effects": effects, "actuators": {"thrusters": thrusters}}
    sheet |= {"sensors": {"imu": {"sensor": "imu", "link": "base_link"}}}
    words = yaml.safe_dump(sheet, sort_keys=False, default_flow_style=None)
    shape = urdf("rov", MASS, INERTIA.tolist(), hull["size"], LIFTS_AT)
    return {"robot.yaml": words, "rov.urdf": shape}


ROBOTS = {
    "rov": robot(),
    "rov_no_linear": robot(linear=0.0),
    "rov_no_square": robot(square=0.0),
    "rov_no_turning": robot(turning=0.0),
    "rov_no_added": robot(added=0.0),
    "rov_half_added": robot(added=0.5),
    "rov_drag2": robot(square=2.0),
}
_COLUMNS = {"time": "t", "east": "position_x", "north": "position_y", "up": "position_z"}
_COLUMNS |= {"q0": "orientation_w"} | {f"q{k + 1}": f"orientation_{a}" for k, a in enumerate("xyz")}
_COLUMNS |= {f"imu_a{a}": f"specific_force_{a}" for a in "xyz"}
_COLUMNS |= {f"imu_{n}": f"angular_velocity_{a}" for n, a in zip("pqr", "xyz", strict=True)}
_COLUMNS |= {f"thruster{k}": f"thruster_cmd_{k}" for k in range(1, 9)}
MAPS = {
    "map.yaml": {"reader": "csv", "columns": _COLUMNS},
    "water.yaml": {"environment": {"water_level": 0.0}},
}
PATHS: dict[str, Callable[..., Pose]] = {"sines": sines, "circle": circle, "places": places}
CASES = cases_of(
    Path(__file__).with_suffix(".yaml"),
    PATHS,
    robot="rov",
    convert=("meta=water.yaml",),
    rate=RATE,
)


if __name__ == "__main__":
    write_set(CASES, dive, seed=SEED, robots=ROBOTS, maps=MAPS, packages=("numpy",))
