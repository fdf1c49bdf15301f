"""Simulated sensor readings as columns of a log."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.frames import exponential, multiply
from seals.logs.channels import column_names
from seals.sysid.experiment_design.experiment import Experiment
from seals.sysid.validation.model import Model
from seals.sysid.validation.replay import felt_at, reported


class Track(NamedTuple):
    """One simulated run.

    Args:
        seen: base and joints at the start and after every step of the simulator.
        commands: of the drives at every row of the log, shape (T, n).
        joints: of the joints, shape (T, J).
    """

    seen: Configuration
    commands: Floats
    joints: Floats


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
    vehicle, rows = model.vehicle, len(track.commands)
    out: dict[str, Floats] = {"t": np.arange(rows, dtype=float) * experiment.step}
    for name, table in ((vehicle.commands, track.commands), ("joint_position_cmd", track.joints)):
        out |= {f"{name}_{k + 1}": column for k, column in enumerate(table.T)}
    channels = experiment.meta["sensors"]["channels"]
    for name, values in _exact(experiment, model, track, parts).items():
        if name not in channels:
            continue
        every = max(1, round(1.0 / (float(channels[name]["rate"]) * experiment.step)))
        seen = np.arange(rows)[:, None] % every == 0
        read = np.where(seen, _noisy(name, values, vehicle.sigma[name], rng), np.nan)
        out |= zip(column_names(name, read.shape[1], name), read.T, strict=True)
    if "battery_voltage" in channels and volts:
        noise = vehicle.sigma["battery_voltage"] * rng.standard_normal(rows)
        out["battery_voltage"] = volts + noise
    return out


def _noisy(name: str, values: Floats, sigma: float, rng: np.random.Generator) -> Floats:
    """Values with noise; attitudes come out as w, x, y, z."""
    if name == "orientation":
        turned = multiply(values, exponential(sigma * rng.standard_normal((len(values), 3))))
        return np.asarray(turned, dtype=np.float64)[:, [3, 0, 1, 2]]
    return values + sigma * rng.standard_normal(values.shape)


def _exact(experiment: Experiment, model: Model, track: Track, parts: int) -> dict[str, Floats]:
    """Return the readings without noise, one row for each row of the log."""
    vehicle, step = model.vehicle, experiment.step
    at, joints = np.arange(len(track.commands)) * parts, track.joints.shape[1]
    gravity, level = vehicle.environment.gravity, vehicle.environment.water_level or 0.0
    now, felt = felt_at(track.seen, at, step / parts, gravity, straddle=not joints)
    spin, force, turn = np.split(
        reported(model, felt[None], 0, model.sensor_delay / step)[0], (3, 6), 1
    )
    out = {
        "angular_velocity": spin,
        "specific_force": force,
        "position": now.position,
        "orientation": multiply(now.quaternion, exponential(turn)) if turn.size else now.quaternion,
        "velocity": now.velocity,
        "depth": level - now.position[:, 2:3],
    }
    return {**out, "joint_position": now.joints} if joints else out
