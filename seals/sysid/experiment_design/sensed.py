"""Simulated sensor readings as columns of a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.frames import exponential, matrix_of, multiply, rotate
from seals.motion import Reading
from seals.sysid.experiment_design.experiment import Experiment
from seals.sysid.validation.model import Model
from seals.world.felt import accelerations
from seals.world.readings import ReadingChain


@dataclass
class Track:
    """One simulated run: states at its rows and one step before and after each, commands.

    Nothing lies before a row at which the run itself starts.
    """

    states: list[Configuration]
    before: list[Configuration | None]
    after: list[Configuration]
    commands: list[Floats]
    joints: list[Floats]


def measured(
    experiment: Experiment,
    model: Model,
    track: Track,
    *,
    parts: int,
    volts: float | None,
    rng: np.random.Generator,
) -> dict[str, Floats]:
    """Return log columns: commands, and noisy sensor readings at the sensors' rates.

    Args:
        experiment: step of the log, channels of the sensors.
        model: what acts, errors of the sensors among it.
        track: of the run.
        parts: steps of the simulator between rows.
        volts: of the battery.
        rng: of the noise.
    """
    vehicle, rows = model.vehicle, len(track.states)
    time: Floats = np.arange(rows, dtype=float) * experiment.step
    out: dict[str, Floats] = {"t": time}
    command = np.array(track.commands)
    for k in range(command.shape[1]):
        out[f"{vehicle.commands}_{k + 1}"] = command[:, k]
    joints = np.array(track.joints)
    for k in range(joints.shape[1]):
        out[f"joint_position_cmd_{k + 1}"] = joints[:, k]
    exact = _exact(experiment, model, track, parts)
    channels = experiment.meta["sensors"]["channels"]
    for name, values in exact.items():
        if name not in channels:
            continue
        every = max(1, round(1.0 / (float(channels[name]["rate"]) * experiment.step)))
        seen = np.arange(rows)[:, None] % every == 0
        out |= _named(name, np.where(seen, _noisy(name, values, vehicle.sigma[name], rng), np.nan))
    if "battery_voltage" in channels and volts:
        out["battery_voltage"] = volts + vehicle.sigma["battery_voltage"] * rng.standard_normal(
            rows
        )
    return out


def _noisy(name: str, values: Floats, sigma: float, rng: np.random.Generator) -> Floats:
    """Values with noise; attitudes come out as w, x, y, z."""
    if name == "orientation":
        turned = multiply(values, exponential(sigma * rng.standard_normal((len(values), 3))))
        return np.asarray(turned, dtype=np.float64)[:, [3, 0, 1, 2]]
    noisy: Floats = values + sigma * rng.standard_normal(values.shape)
    return noisy


def _named(name: str, values: Floats) -> dict[str, Floats]:
    if values.shape[1] == 1 and name == "depth":
        return {name: values[:, 0]}
    letters: Any = "wxyz" if name == "orientation" else "xyz"
    if name == "joint_position":
        letters = [str(k + 1) for k in range(values.shape[1])]
    return {f"{name}_{a}": values[:, k] for k, a in enumerate(letters)}


def _exact(experiment: Experiment, model: Model, track: Track, parts: int) -> dict[str, Floats]:
    """Return the readings of exact sensors, one row for each row of the log."""
    vehicle, step = model.vehicle, experiment.step / parts
    now = Configuration(*(np.array(x) for x in zip(*track.states, strict=True)))
    turn = matrix_of(now.quaternion)
    back = turn.transpose(0, 2, 1)
    three = zip(track.before, track.states, track.after, strict=True)
    rates = [_acceleration(x, step) for x in three]
    linear, angular = (np.array(part) for part in zip(*rates, strict=True))
    angular = rotate(back, angular)
    linear[:, 2] += vehicle.environment.gravity
    spin, force = rotate(back, now.angular_velocity), rotate(back, linear)
    arm, mount = vehicle.imu_position, vehicle.imu_turn.T
    force = force + np.cross(angular, arm) + np.cross(spin, np.cross(spin, arm))
    seen = Reading(*(part @ mount for part in (spin, force, angular, spin)))
    reading = _late(model, seen, experiment.step)
    for b in ReadingChain(model.bound).errors:
        reading = b.hooks.measure(reading, b.params)
    level = vehicle.environment.water_level or 0.0
    out = {
        "angular_velocity": np.asarray(reading.angular_velocity),
        "specific_force": np.asarray(reading.specific_force),
        "position": now.position,
        "orientation": now.quaternion,
        "velocity": rotate(back, now.velocity),
        "depth": level - now.position[:, 2:3],
    }
    return out if not now.joints.shape[1] else {**out, "joint_position": now.joints}


def _acceleration(
    three: tuple[Configuration | None, Configuration, Configuration], step: float
) -> tuple[Floats, Floats]:
    """Linear and angular acceleration at the second of three states, world axes, (3,) each."""
    found = [c for c in three if c is not None]
    seen = Configuration(*(np.array(x) for x in zip(*found, strict=True)))
    linear, angular = accelerations(seen, step)
    return linear[-1], angular[-1]


def _late(model: Model, reading: Reading, step: float) -> Reading:
    """Delay readings as the model's sensors do."""
    at = np.arange(len(reading.angular_velocity)) - model.sensor_delay / step
    rows = np.arange(len(at))
    parts = [
        np.stack([np.interp(at, rows, np.asarray(v)[:, k]) for k in range(3)], axis=1)
        for v in reading
    ]
    return Reading(*parts)
