"""Answers of `mujoco.sysid` to flights of multirotors: fit all parameters, name the significant.

    python mujoco_sysid.py SET OUT [--only NAME ...]
    python mujoco_sysid.py --log FOLDER

SET is one of `benchmarks.other_simulators`; FOLDER holds a log as `seals benchmark` writes it, and
its answer is the last line that is printed. Needs `pip install "mujoco[sysid]" pyyaml`, not SEALS.
The vehicle is a MuJoCo model: a free body, rotors as filtered actuators at sites, the fluid of
MuJoCo (viscosity for a linear drag, density for a quadratic one, wind). Windows of half a second
start from the measured pose. Mass, centre of gravity, moments of inertia, gain of every rotor, lag,
delays, biases, drags and wind are fitted together with `mujoco.sysid.optimize`; those whose
interval by `calculate_intervals` (1 % over all parameters) leaves the stated value are declared.
MuJoCo has no added mass of its own for each axis, so that dives are not answered.
"""

from __future__ import annotations

import argparse
import contextlib
import gzip
import importlib
import io
import json
import time
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SUB, WINDOW, EVERY, SKIP = 2, 0.5, 0.5, 5
"""Steps a row, length of a window and distance of starts [s], rows between compared ones."""
NOISE = {"position": 0.003, "orientation": 0.004, "angular_velocity": 0.01, "specific_force": 0.08}
LEVEL, MOST = 0.01, 15
"""Share of false names over all parameters, and iterations."""
PRIOR = 0.3
"""Width of mass, inertia and gains as shares: together they are free otherwise."""


class Flight:
    """A log and the model that goes with it."""

    def __init__(self) -> None:
        """Hold nothing yet."""
        self.columns: dict[str, Floats] = {}
        self.rotors: dict[str, Any] = {}
        self.drags: list[dict[str, Any]] = []
        self.mass, self.inertia, self.step = 0.0, np.zeros(3), 0.0
        self.time, self.speed = np.zeros(0), np.zeros((0, 0))
        self.noise = dict(NOISE)

    @classmethod
    def of_log(cls, folder: Path) -> Flight:
        """Read ``log.csv`` and ``vehicle.json``."""
        self = cls()
        table = np.genfromtxt(folder / "log.csv", delimiter=",", names=True)
        self.columns = {name: np.asarray(table[name]) for name in table.dtype.names or ()}
        told = json.loads((folder / "vehicle.json").read_text(encoding="utf-8"))
        vehicle = told["vehicle"]
        self.mass = float(vehicle["mass"])
        self.inertia = np.diag(np.array(vehicle["inertia"], float))
        each = vehicle["rotors"]
        self.rotors = {
            key: [rotor[key] for rotor in each]
            for key in ("position", "direction", "thrust_coefficient", "torque_coefficient")
        } | {"time_constant": [each[0]["time_constant"]]}
        for law in told["baseline"]:
            given = law.get("parameters") or {}
            self.drags.append({"effect": law["name"], **given})
        sigmas = told["sensors"]["channels"]
        self.noise = {name: float(sigmas[name]["sigma"]) for name in NOISE}
        self.time = self.columns["t"]
        names = "123456789"[: len(each)]
        self.speed = self.channel("rotor_speed_cmd", names)
        self.step = float(np.median(np.diff(self.time)))
        return self

    @classmethod
    def of_case(cls, case: Path) -> Flight:
        """Read log, map and robot of a case."""
        self = cls()
        truth = yaml.safe_load((case / "truth.yaml").read_text(encoding="utf-8"))
        given = case.parents[1]
        chart = yaml.safe_load((given / truth.get("map", "map.yaml")).read_text(encoding="utf-8"))
        text = gzip.decompress((case / "log.csv.gz").read_bytes())
        table = np.genfromtxt(io.BytesIO(text), delimiter=",", names=True)
        self.columns = {to: np.asarray(table[own]) for own, to in chart["columns"].items()}
        robot = given / "robots" / truth["robot"]
        sheet = yaml.safe_load((robot / "robot.yaml").read_text(encoding="utf-8"))
        body = ET.parse(robot / sheet["urdf"]).getroot().find("link/inertial")
        assert body is not None
        self.mass = float(body.find("mass").attrib["value"])  # type: ignore[union-attr]
        shape = body.find("inertia").attrib  # type: ignore[union-attr]
        self.inertia = np.array([float(shape[f"i{a}{a}"]) for a in "xyz"])
        self.rotors = sheet["actuators"]["rotors"]
        self.drags = list(sheet.get("effects", {}).values())
        self.time, self.speed = self.columns["t"], self._speeds(truth)
        self.step = float(np.median(np.diff(self.time)))
        return self

    def channel(self, stem: str, ends: str) -> Floats:
        """Columns of a channel."""
        return np.column_stack([self.columns[f"{stem}_{e}"] for e in ends])

    def _speeds(self, truth: Mapping[str, Any]) -> Floats:
        """Commanded speeds [rad/s]."""
        count = len(self.rotors["position"])
        if "rotor_speed_cmd_1" in self.columns:
            return self.channel("rotor_speed_cmd", "1234"[:count])
        words = dict(w.split("=") for w in truth["convert"])
        low, high = yaml.safe_load(words["motors.range"])
        share = (self.channel("motor_pwm", "1234"[:count]) - low) / (high - low)
        speeds: Floats = share * self.rotors["max_speed"][0]
        return speeds

    def drag(self) -> tuple[float, float]:
        """Stated linear and quadratic drag, means of the level axes [N s/m, N s^2/m^2]."""
        linear = square = 0.0
        for law in self.drags:
            if law["effect"] == "quadratic_drag":
                square += 0.5 * (law["coefficient_x"] + law["coefficient_y"])
            if law["effect"] == "linear_drag":
                linear += 0.5 * (law["coefficient_x"] + law["coefficient_y"])
            if law["effect"] == "rotor_drag":
                linear += law["coefficient"] * self.mass * 9.81
        return linear, square

    def xml(self) -> str:
        """MuJoCo model; the fluid acts on the box that has the stated inertia."""
        k = self.rotors["thrust_coefficient"][0]
        turn = self.rotors["torque_coefficient"][0] / k
        sites, motors = [], []
        lag = self.rotors["time_constant"][0]
        for n, (place, way) in enumerate(
            zip(self.rotors["position"], self.rotors["direction"], strict=True)
        ):
            at = " ".join(str(v) for v in place)
            sites.append(f'<site name="r{n}" pos="{at}"/>')
            motors.append(
                f'<general name="m{n}" site="r{n}" gear="0 0 1 0 0 {-way * turn}" '
                f'dyntype="filterexact" dynprm="{lag}" gainprm="1"/>'
            )
        inertia = " ".join(str(v) for v in self.inertia)
        return f"""<mujoco><option timestep="{self.step / SUB}" gravity="0 0 -9.81"
          integrator="RK4"><flag contact="disable"/></option>
        <worldbody><body name="base"><freejoint/>
        <inertial pos="0 0 0" mass="{self.mass}" diaginertia="{inertia}"/>
        <site name="imu"/>{"".join(sites)}</body></worldbody>
        <actuator>{"".join(motors)}</actuator>
        <sensor><framepos objtype="site" objname="imu"/><framequat objtype="site" objname="imu"/>
        <gyro site="imu"/><accelerometer site="imu"/></sensor></mujoco>"""


def parameters(flight: Flight) -> Any:
    """Return all parameters of the model at their stated values."""
    sysid: Any = importlib.import_module("mujoco.sysid")

    linear, square = flight.drag()
    half = 0.5 * np.sqrt(6.0 / flight.mass * np.abs(flight.inertia.sum() - 2 * flight.inertia))
    viscosity = linear / (np.pi * 2.0 * half.sum())
    density = square / (2.0 * np.mean([half[1] * half[2], half[0] * half[2]]))
    lag, rotors = flight.rotors["time_constant"][0], len(flight.rotors["position"])
    told: dict[str, Any] = {
        "payload": (flight.mass, 0.3 * flight.mass, 3 * flight.mass),
        "centre_of_gravity": ([0.0] * 3, [-0.1] * 3, [0.1] * 3),
        "inertia": ([1.0] * 3, [0.3] * 3, [3.0] * 3),
        "rotors": ([1.0] * rotors, [0.1] * rotors, [2.0] * rotors),
        "rotor_lag": (lag, 0.003, 0.3),
        "command_delay": (0.0, -0.05, 0.2),
        "sensor_delay": (0.0, -0.1, 0.1),
        "accelerometer_bias": ([0.0] * 3, [-2.0] * 3, [2.0] * 3),
        "gyroscope_bias": ([0.0] * 3, [-0.5] * 3, [0.5] * 3),
        "linear_drag": (viscosity, 0.0, 10.0),
        "quadratic_drag": (density, 0.0, 100.0),
        "wind": ([0.0] * 3, [-15.0] * 3, [15.0] * 3),
    }
    found = sysid.ParameterDict()
    for name, (stated, low, high) in told.items():
        found.add(sysid.Parameter(name, stated, low, high))
    return found


def _windows(flight: Flight) -> tuple[Floats, list[int]]:
    """Return start states (time, place, attitude, velocities, thrusts) and their rows."""
    from scipy.signal import savgol_filter

    place = flight.channel("position", "xyz")
    smooth = savgol_filter(place, 15, 3, axis=0)
    velocity = savgol_filter(place, 15, 3, deriv=1, delta=flight.step, axis=0)
    attitude = flight.channel("orientation", "wxyz")
    attitude = attitude * np.sign(np.sum(attitude * np.roll(attitude, 1, axis=0), axis=1))[:, None]
    spin = savgol_filter(flight.channel("angular_velocity", "xyz"), 5, 2, axis=0)
    k, lag = flight.rotors["thrust_coefficient"][0], flight.rotors["time_constant"][0]
    push = np.empty_like(flight.speed)
    push[0] = k * flight.speed[0] ** 2
    share = np.exp(-flight.step / lag)
    for n in range(1, len(push)):
        push[n] = share * push[n - 1] + (1 - share) * k * flight.speed[n - 1] ** 2
    count = round(WINDOW / flight.step)
    rows = list(range(20, len(place) - count - 20, round(EVERY / flight.step)))
    states = [np.concatenate([[0.0], smooth[r], attitude[r], velocity[r], spin[r], push[r]])
              for r in rows]  # fmt: skip
    return np.array(states), rows


class _Residual:
    """Residuals of all windows, as `mujoco.sysid.optimize` takes them."""

    def __init__(self, flight: Flight) -> None:
        """Prepare starts and what was measured."""
        mujoco: Any = importlib.import_module("mujoco")

        self.flight, self.spec = flight, mujoco.MjSpec.from_string(flight.xml())
        self.starts, self.rows = _windows(flight)
        self.orders: dict[float, Floats] = {}
        self.count = round(WINDOW / flight.step)
        stems = {"position": "xyz", "orientation": "wxyz"}
        stems |= {"angular_velocity": "xyz", "specific_force": "xyz"}
        self.seen = np.concatenate([flight.channel(s, e) for s, e in stems.items()], axis=1)

    def __call__(self, x: Floats, params: Any) -> tuple[list[Floats], None, None]:
        """Return residuals over noise, for one vector or for each column of a matrix."""
        given = np.asarray(x, float)
        if given.ndim == 1:
            return [self.of(given, params)], None, None
        return [np.column_stack([self.of(column, params) for column in given.T])], None, None

    def of(self, x: Floats, params: Any) -> Floats:
        """Residuals over noise, and those of the priors."""
        mujoco: Any = importlib.import_module("mujoco")
        rollout: Any = importlib.import_module("mujoco.rollout")

        params.update_from_vector(x)
        value = {name: np.asarray(params[name].value, float) for name in _names(params)}
        spec, flight = self.spec.copy(), self.flight
        body = spec.body("base")
        body.mass, body.ipos = float(value["payload"][0]), value["centre_of_gravity"]
        body.inertia = flight.inertia * value["inertia"]
        spec.option.viscosity = float(value["linear_drag"][0])
        spec.option.density = float(value["quadratic_drag"][0])
        spec.option.wind = value["wind"]
        for n, motor in enumerate(spec.actuators):
            motor.dynprm[0], motor.gainprm[0] = value["rotor_lag"][0], value["rotors"][n]
        model = spec.compile()
        grid = np.arange(self.count * SUB) * flight.step / SUB
        delay = float(value["command_delay"][0])
        if delay not in self.orders:
            self.orders = {delay: np.array([self.commands(flight.time[r] + grid - delay)
                                            for r in self.rows])} | self.orders  # fmt: skip
        orders = self.orders[delay]
        _, sensed = rollout.rollout(model, mujoco.MjData(model), self.starts, orders)
        told = np.asarray(sensed)[:, SUB - 1 :: SUB]
        parts = []
        late = float(value["sensor_delay"][0]) / flight.step
        for n, row in enumerate(self.rows):
            parts.append(self.compared(told[n], row, value, late))
        prior = np.concatenate([[value["payload"][0] / flight.mass - 1.0],
                                value["inertia"] - 1.0, value["rotors"] - 1.0]) / PRIOR  # fmt: skip
        return np.concatenate([*parts, prior])

    def commands(self, moments: Floats) -> Floats:
        """Thrusts that are wanted, held from row to row."""
        rows = np.searchsorted(self.flight.time, moments + 1e-9, side="right") - 1
        # a held command gives no slope over a delay: soften the edges of the hold over a row
        part = np.clip(
            (moments - self.flight.time[np.clip(rows, 0, None)]) / self.flight.step, 0, 1
        )
        k = self.flight.rotors["thrust_coefficient"][0]
        thrust = k * self.flight.speed**2
        last = len(thrust) - 1
        here, before = np.clip(rows, 0, last), np.clip(rows - 1, 0, last)
        edge = np.clip(part * 2.0, 0.0, 1.0)[:, None]
        softened: Floats = thrust[before] * (1.0 - edge) + thrust[here] * edge
        return softened

    def compared(self, told: Floats, row: int, value: Mapping[str, Floats], late: float) -> Floats:
        """Residuals of a window."""
        picked = np.arange(SKIP, self.count - 11, SKIP)
        seen = self.seen[row + 1 + picked]
        spot = np.clip(picked - late, 0, self.count - 1.001)
        low = spot.astype(int)
        share = (spot - low)[:, None]
        delayed = told[low, 7:] * (1 - share) + told[low + 1, 7:] * share
        pose = told[picked]
        a = pose[:, 3:7]
        b = seen[:, 3:7]
        vector = b[:, :1] * a[:, 1:] - a[:, :1] * b[:, 1:] - np.cross(b[:, 1:], a[:, 1:])
        out: Floats = vector * np.sign(np.sum(a * b, axis=1))[:, None]
        turn = 2.0 * out
        noise = self.flight.noise
        parts = {
            "position": pose[:, :3] - seen[:, :3],
            "orientation": turn,
            "angular_velocity": delayed[:, :3] + value["gyroscope_bias"] - seen[:, 7:10],
            "specific_force": delayed[:, 3:] + value["accelerometer_bias"] - seen[:, 10:13],
        }
        return np.concatenate([(part / noise[name]).ravel() for name, part in parts.items()])


def _names(params: Any) -> list[str]:
    """Names of a `ParameterDict`."""
    return list(params.keys())


def _declared(flight: Flight) -> tuple[str, ...]:
    """Fit all parameters and return the effects of those that left their stated value."""
    sysid: Any = importlib.import_module("mujoco.sysid")

    begin, residual = parameters(flight), _Residual(flight)
    stated = begin.as_vector().copy()
    with contextlib.redirect_stdout(io.StringIO()):
        found, result = sysid.optimize(begin, residual, verbose=False, max_iters=MOST, eps=1e-4)
    left, _, _ = residual(found.as_vector(), found)
    _, half = sysid.calculate_intervals(left, np.asarray(result.jac), alpha=LEVEL / len(stated))
    moved = np.abs(found.as_vector() - stated) > half
    effects, first = [], 0
    for name in _names(begin):
        size = begin[name].size
        which = moved[first : first + size]
        if which.any():
            effects.append(("thrust_coefficient" if which.all() else "weak_rotor")
                           if name == "rotors" else name)  # fmt: skip
        first += size
    return tuple(effects)


def _answer(effects: tuple[str, ...]) -> dict[str, Any]:
    """Return an answer in the form of ``diagnosis.json``."""
    verdict = "named" if effects else "nothing_missing"
    return {"verdict": verdict, "effects": [{"name": n, "parameters": {}} for n in effects]}


def main() -> None:
    """Answer the cases that were asked for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("set", type=Path, nargs="?")
    parser.add_argument("out", type=Path, nargs="?")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--log", type=Path)
    asked = parser.parse_args()
    if asked.log is not None:
        print(json.dumps(_answer(_declared(Flight.of_log(asked.log)))))
        return
    if asked.set is None or asked.out is None:
        parser.error("give SET and OUT, or --log FOLDER")
    for path in sorted(asked.set.glob("cases/*/truth.yaml")):
        case, begin = path.parent, time.perf_counter()
        if asked.only and case.name not in asked.only:
            continue
        effects = _declared(Flight.of_case(case))
        place = asked.out / case.name
        place.mkdir(parents=True, exist_ok=True)
        (place / "diagnosis.json").write_text(json.dumps(_answer(effects)), encoding="utf-8")
        print(case.name, f"{time.perf_counter() - begin:.0f} s", *effects, flush=True)


if __name__ == "__main__":
    main()
