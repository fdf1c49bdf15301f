"""Predicted log of a simulated manoeuvre: rows, sensors, and the model along them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import BatchDynamics
from seals.effects.binding import has_hook
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.predictors.plant import Plant
from seals.sysid.predictors.problem import Problem


class _Planned(Plant):
    """Plant whose added inertia varies over the batch if one of its parameters does."""

    def twin(
        self, values: Mapping[str, Any], batch: int, *, stiff: bool = True, over_steps: bool = False
    ) -> BatchDynamics:
        """Batch dynamics of the stated model with changes, see `Plant.twin`."""
        effects = self.candidate_set.effects
        arrays = {k.partition(".")[0] for k, v in values.items() if np.ndim(v)} & set(effects)
        moved = {n for n in arrays if has_hook(effects[n], "inertia")}
        full = {
            key: np.full(batch, np.asarray(values.get(key, 0.0)))
            for key, parameter in self.candidate_set.parameters.items()
            if parameter.instance in moved
        }
        return super().twin({**values, **full}, batch, stiff=stiff, over_steps=over_steps)


def planned_plant(
    problem: Problem,
    trajectory: Trajectory | None,
    lengths: Sequence[int],
    step: float,
    *,
    command: Floats,
    joint_command: Floats,
    voltage: Floats | None,
    vehicle: Vehicle | None = None,
) -> Plant:
    """Return the model of a vehicle along simulated flights, with the sensors of the log."""
    vehicle = problem.vehicle if vehicle is None else vehicle
    ends = np.cumsum(lengths)
    every, sigma = _sensors(problem, step)
    rows = int(ends[-1])
    samples = Samples(
        time=np.concatenate([np.arange(n) * step for n in lengths]),
        step=step,
        runs=tuple((int(e - n), int(e)) for e, n in zip(ends, lengths, strict=True)),
        channels={} if trajectory is None else _channels(problem, trajectory, every, rows),
        command=command,
        voltage=voltage if problem.samples.voltage is not None and vehicle.full_voltage else None,
        joint_command=joint_command,
    )
    return _Planned(
        replace(vehicle, sigma=sigma),
        problem.plant.candidate_set,
        samples,
        parts=problem.plant.parts if trajectory is None or not len(vehicle.lag) else 1,
    )


def _sensors(problem: Problem, step: float) -> tuple[dict[str, int], dict[str, float]]:
    """Sampling interval of each channel in rows, and noise of equal information per second."""
    every, sigma = {}, dict(problem.vehicle.sigma)
    for name, values in problem.samples.channels.items():
        given = np.isfinite(values).mean(axis=0)
        # a column without samples, such as the third axis of a Doppler log, is not read at all
        rate = float(given[given > 0.0].mean()) / problem.samples.step if given.any() else 0.0
        every[name] = max(1, round(1.0 / max(rate * step, 1e-9)))
        sigma[name] *= float(np.sqrt(1.0 / max(rate * every[name] * step, 1e-9)))
    return every, sigma


def _channels(
    problem: Problem, trajectory: Trajectory, every: Mapping[str, int], rows: int
) -> dict[str, Floats]:
    """Return the readings of exact sensors; rows without a sample are NaN.

    The inertial readings stay zero: separations are differences of predictions.
    """
    level = problem.vehicle.environment.water_level or 0.0
    exact = {
        "position": trajectory.position,
        "orientation": trajectory.quaternion,
        "velocity": trajectory.velocity,
        "depth": level - trajectory.position[:, 2:3],
        "joint_position": trajectory.joints,
        "angular_velocity": trajectory.angular_velocity,
        "specific_force": np.zeros((rows, 3)),
    }
    out = {}
    for name, stride in every.items():
        if name not in exact:
            continue
        seen = np.arange(rows)[:, None] % stride == 0
        out[name] = np.where(seen, exact[name], np.nan)
    return out
