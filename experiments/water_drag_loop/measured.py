"""Log of a textbook tow, with the drag of the particle water as stated model."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import nnls

from seals.arrays import Floats
from seals.experiments.water_drag_loop.tank import MOMENT
from seals.experiments.water_drag_loop.textbook import (
    DENSITY,
    LAG,
    MASS,
    RADIUS,
    VOLUME,
    Course,
)
from seals.logs import Log
from seals.logs.native import write_native

DEPTH = 5.0
"""Of the textbook's sphere: far from the surface [m]."""
NOISE = {
    "angular_velocity": (0.005, "rad/s"),
    "specific_force": (0.03, "m/s^2"),
    "position": (0.003, "m"),
    "orientation": (0.004, "rad, rotation-vector error in body axes"),
}
"""Of the sensors of the measurement: 1-sigma and unit, at 100 Hz."""
SPAN = 0.12
"""Length of the pieces whose impulses are balanced [s]."""


class Nominal(NamedTuple):
    """Coefficients of the particle water for the towed sphere.

    Args:
        added: mass [kg].
        quadratic: drag [N s^2/m^2].
        left: force that the two leave over, root of the mean square [N].
    """

    added: float
    quadratic: float
    left: float

    def meta(self) -> dict[str, Any]:
        """Vehicle, stated model, sensors and what is known of them."""
        n = self
        axes = ("x", "y", "z")
        moment = [[MOMENT if i == j else 0.0 for j in range(3)] for i in range(3)]
        sphere = {"type": "sphere", "position": [0.0] * 3, "rpy": [0.0] * 3, "size": [RADIUS]}
        thruster = {"position": [0.0] * 3, "axis": [1.0, 0.0, 0.0], "time_constant": LAG}
        added = {f"mass_{a}": n.added for a in axes} | {f"inertia_{a}": 0.0 for a in axes}
        entries: list[dict[str, Any]] = [
            {"name": "gravity"},
            {"name": "thruster_force", "law": "F = cmd with first-order lag"},
            {"name": "buoyancy", "medium": "water"},
            {"name": "quadratic_drag", "medium": "water",
             "parameters": {f"coefficient_{a}": n.quadratic for a in axes}},
            {"name": "added_mass", "medium": "water", "parameters": added},
        ]  # fmt: skip
        # how well the statements of the log are known
        each = "relative, each axis and each coefficient (linear and quadratic) by itself"
        table = {
            "mass": (0.002, "relative"),
            "inertia": (0.03, "relative, each axis"),
            "thrust_coefficient": (0.003, "relative, common to all actuators"),
            "thrust_coefficient_each": (0.002, "relative, each actuator"),
            "thruster_time_constant": (0.002, "s"),
            "centre_of_gravity": (0.0006, "m, each axis"),
            "displaced_volume": (0.0002, "relative"),
            "centre_of_buoyancy": (0.001, "m, each axis"),
            "drag_coefficient": (0.08, each),
            "angular_drag_coefficient": (0.15, each),
            # what particle water shows of it depends on how the sphere is towed
            "added_mass": (0.4, "relative, each axis"),
            "command_delay": (0.0005, "s"),
            "accelerometer_bias": (0.03, "m/s^2, each axis"),
            "accelerometer_scale": (0.003, "relative, each axis"),
            "gyroscope_bias": (0.003, "rad/s, each axis"),
            "sensor_misalignment": (0.003, "rad, each axis"),
            "sensor_delay": (0.0005, "s"),
        }
        return {
            "vehicle": {
                "name": "towed_sphere",
                "mass": MASS,
                "inertia": moment,
                "centre_of_gravity": [0.0] * 3,
                "rotors": [],
                "thrusters": [{**thruster, "max_force": 900.0}],
                "hull": {
                    "primitives": [sphere],
                    "displaced_volume": VOLUME,
                    "centre_of_buoyancy": [0.0] * 3,
                    "plan_area": float(np.pi * RADIUS**2),
                },
                "arm": None,
                "battery": {"full_voltage": None},
            },
            "environment": {
                "gravity": [0.0, 0.0, -9.81],
                "water_level": 0.0,
                "tank_bottom": -100.0,
                "ground_level": None,
                "air_density": 1.2,
                "water_density": DENSITY,
            },
            "baseline": entries,
            "sensors": {
                "imu": {"position": [0.0] * 3, "orientation": [1.0, 0.0, 0.0, 0.0]},
                "channels": {
                    name: {"sigma": sigma, "rate": 100, "unit": unit}
                    for name, (sigma, unit) in NOISE.items()
                },
            },
            "tolerance": {
                name: {"sigma": sigma, "meaning": text} for name, (sigma, text) in table.items()
            },
            "disturbance": {
                "kind": "unmodelled swirl, zero mean, coloured",
                "force_sigma": 0.02,
                "torque_sigma": 0.0005,
                "correlation_time": 0.35,
                "accuracy": "within a factor of two",
            },
        }


def nominal_of(courses: list[Course]) -> Nominal:
    """Return added mass and drag of tows in particle water, by the balance of impulses.

    int f dt - m dv = m_a dv + c int v abs(v) dt over pieces of a tow, in the sense of least
    squares, none below zero: the form of the textbook's law.
    """
    rows, sides = [], []
    for c in courses:
        force, keep = np.zeros_like(c.command), np.exp(-np.diff(c.time) / LAG)
        for row, kept in enumerate(keep):
            force[row + 1] = c.command[row] + (force[row] - c.command[row]) * kept
        h = float(c.time[1] - c.time[0])
        n = round(SPAN / h)
        square = c.velocity * np.abs(c.velocity)
        for k in range(0, len(c.time) - n, n // 3):
            part = slice(k, k + n + 1)
            gain = float(c.velocity[k + n] - c.velocity[k])
            rows.append((gain, float(np.trapezoid(square[part], dx=h))))
            sides.append(float(np.trapezoid(force[part], dx=h)) - MASS * gain)
    found, _ = nnls(np.array(rows), np.array(sides))
    left = np.array(rows) @ found - np.array(sides)
    added, quadratic = (float(x) for x in found)
    return Nominal(added, quadratic, float(np.sqrt(np.mean(left**2))) / SPAN)


def write_measurement(folder: Path, course: Course, nominal: Nominal, *, seed: int) -> Path:
    """Write a textbook's tow as a native log.

    Args:
        folder: where to.
        course: of the sphere.
        nominal: model that the log states.
        seed: of the sensors' noise.
    """
    rng, rows = np.random.default_rng(seed), len(course.time)

    def noise(channel: str) -> Floats:
        return NOISE[channel][0] * rng.standard_normal((rows, 3))

    place, force = noise("position"), noise("specific_force")
    place[:, 0] += course.position
    place[:, 2] -= DEPTH
    force[:, 0] += course.acceleration
    force[:, 2] += 9.81
    spin, turn = noise("angular_velocity"), noise("orientation")
    columns = {"t": course.time, "thruster_cmd_1": course.command}
    for name, values in (("position", place), ("angular_velocity", spin)):
        columns |= {f"{name}_{a}": values[:, k] for k, a in enumerate("xyz")}
    columns |= {f"specific_force_{a}": force[:, k] for k, a in enumerate("xyz")}
    columns |= {"orientation_w": np.sqrt(1.0 - 0.25 * np.sum(turn**2, axis=1))}
    columns |= {f"orientation_{a}": 0.5 * turn[:, k] for k, a in enumerate("xyz")}
    log = Log(name=folder.name, columns=columns, meta=nominal.meta(), source="textbook law")
    return write_native(log, folder, replace=True)
