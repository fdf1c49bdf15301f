"""Simulation of manoeuvres by batch dynamics, and the logs that they would give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import BatchDynamics, Rates, TwinState
from seals.frames import exponential, multiply, quaternion_of_rpy
from seals.motion import Inputs
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.experiment_design.control import Controller, Wanted
from seals.sysid.experiment_design.manoeuvres import Manoeuvre
from seals.sysid.experiment_design.motions import Path
from seals.sysid.experiment_design.recording import planned_plant
from seals.sysid.experiment_design.scene import ARM, CROSSING, WATER, Scene
from seals.sysid.predictors.plant import Plant
from seals.sysid.predictors.problem import Problem, transient_rows
from seals.sysid.predictors.rollout import simulated_trajectory

STEPS = {WATER: 0.04, CROSSING: 0.04}
"""Time between rows of a planned flight [s]: finer logs bring less noise, not more knowledge."""
STEP = 0.02
"""The same for other kinds of vehicles [s]."""
THINNED = {ARM: 2}
"""Rows of the loop for one row that is kept, where a model is dear to linearise."""
_SETTLE = 2.0
"""Time on the first place of the reference before the log begins [s]."""
_ESTIMATE = (0.002, 0.004, 0.004, 0.001)
"""Noise of the estimates: place [m], velocity [m/s], body rates [rad/s], attitude [rad]."""
_DISCHARGE = 0.002
"""Share of the battery's voltage that goes in a second."""
_NAMES = ("position", "quaternion", "velocity", "angular_velocity", "joints", "joint_velocity")


@dataclass(frozen=True, kw_only=True)
class Run:
    """Row range of one run of a manoeuvre in a `Rehearsal`.

    Args:
        manoeuvre: what is flown.
        load: known extra mass as a share of the vehicle's.
        path: what was asked for; None for a drop.
        first: row.
        last: row after the end.
    """

    manoeuvre: Manoeuvre
    load: float
    path: Path | None
    first: int
    last: int


@dataclass(frozen=True, kw_only=True)
class Rehearsal:
    """Simulated flights of manoeuvres, arranged like a measured log.

    Args:
        plant: of the vehicle over these rows.
        trajectory: states at all rows.
        runs: which rows belong to which manoeuvre.
    """

    plant: Plant
    trajectory: Trajectory
    runs: tuple[Run, ...]

    def rows(self, run: Run) -> slice:
        """Rows of a run."""
        return slice(run.first, run.last)


def rehearse(
    problem: Problem,
    scene: Scene,
    chosen: Sequence[Manoeuvre],
    values: Mapping[str, float],
    *,
    load: float = 0.0,
    seed: int = 0,
) -> Rehearsal:
    """Simulate manoeuvres by batch dynamics.

    Args:
        problem: vehicle, sensors and library.
        scene: room and powers.
        chosen: manoeuvres.
        values: changes of factors with which the true vehicle flies.
        load: known extra mass as a share of the vehicle's.
        seed: of gusts and noise.
    """
    if chosen[0].releases:
        return _dropped(problem, scene, chosen, values)
    return _flown(problem, scene, chosen, values, load=load, seed=seed)


LOAD = "mass.mass"
"""Factor that stands for a known mass at the middle of the base."""


def _flown(
    problem: Problem,
    scene: Scene,
    chosen: Sequence[Manoeuvre],
    values: Mapping[str, float],
    *,
    load: float,
    seed: int,
) -> Rehearsal:
    step = max(STEPS.get(scene.kind, STEP), problem.samples.step)
    jobs = [(m, b) for m in chosen for b in m.batteries]
    lead = transient_rows(problem.plant) * problem.samples.step
    flights = [_reference(scene, m, step, lead) for m, _ in jobs]
    if load:
        values = {**values, LOAD: values.get(LOAD, 0.0) + load * problem.vehicle.mass}
    seen, command = fly(problem, scene, flights, values, step=step, seed=seed)
    thin = THINNED.get(scene.kind, 1)
    step, command = step * thin, command[::thin]
    seen = {n: v[::thin] for n, v in seen.items()}
    flights = [
        Path(place=p.place[::thin], yaw=p.yaw[::thin], joints=p.joints[::thin]) for p in flights
    ]
    lengths = [len(p.yaw) for p in flights]
    voltage = [
        _voltage(problem.vehicle, b, n, step) for (_, b), n in zip(jobs, lengths, strict=True)
    ]
    trajectory = Trajectory(**{n: _joined(seen[n], lengths) for n in _NAMES})
    commands = _joined(command, lengths)
    bends = np.concatenate([p.joints for p in flights])
    plant = planned_plant(
        problem,
        trajectory,
        lengths,
        step,
        command=commands,
        joint_command=bends,
        voltage=np.concatenate(voltage),
    )
    runs, at = [], 0
    for (m, _), path, n in zip(jobs, flights, lengths, strict=True):
        runs.append(Run(manoeuvre=m, load=load, path=path, first=at, last=at + n))
        at += n
    return Rehearsal(plant=plant, trajectory=trajectory, runs=tuple(runs))


def _reference(scene: Scene, manoeuvre: Manoeuvre, step: float, lead: float) -> Path:
    """Reference at all rows: first a hold in which start transients decay, then the motion."""
    before = round(lead / step)
    rows = before + round(manoeuvre.seconds / step)
    time = (np.arange(rows, dtype=float) - before) * step
    assert manoeuvre.path is not None
    return manoeuvre.path(scene, np.maximum(time, 0.0))


def _voltage(vehicle: Vehicle, share: float, rows: int, step: float) -> Floats:
    full = vehicle.full_voltage or 0.0
    time: Floats = np.arange(rows, dtype=float) * step
    fall: Floats = full * (share - _DISCHARGE * time)[:, None]
    return fall


def _joined(values: Floats, lengths: Sequence[int]) -> Floats:
    return np.concatenate([values[:n, k] for k, n in enumerate(lengths)])


def fly(
    problem: Problem,
    scene: Scene,
    flights: Sequence[Path],
    values: Mapping[str, float],
    *,
    step: float,
    seed: int = 0,
) -> tuple[dict[str, Floats], Floats]:
    """Simulate a batch of controlled vehicles.

    Args:
        problem: vehicle and library.
        scene: room and powers.
        flights: references, one row a step.
        values: changes of factors with which the true vehicle flies.
        step: time between rows [s].
        seed: of gusts and noise.

    Returns:
        States by name, shape (T, M, k) each, and commands, shape (T, M, n).
    """
    loop = _Loop(problem, scene, flights, values, step=step, seed=seed)
    rows = max(len(p.yaw) for p in flights)
    for _ in range(round(_SETTLE / step)):
        loop.advance(0)
    states, commands = [], []
    for k in range(rows):
        states.append(loop.state)
        commands.append(loop.advance(k))
    return (
        {n: np.stack([s[i] for s in states]) for i, n in enumerate(_NAMES)},
        np.stack(commands),
    )


class _Loop:
    """State of a batch in closed loop: vehicle, actuators, gusts."""

    def __init__(
        self,
        problem: Problem,
        scene: Scene,
        flights: Sequence[Path],
        values: Mapping[str, float],
        *,
        step: float,
        seed: int,
    ) -> None:
        vehicle, self.step, batch = problem.vehicle, step, len(flights)
        self.rng = np.random.default_rng(seed)
        rows = max(len(p.yaw) for p in flights)
        rates = [p.rates(step) for p in flights]
        self._place = _padded([p.place for p in flights], rows)
        self._velocity = _padded([r[0] for r in rates], rows, still=True)
        self._acceleration = _padded([r[1] for r in rates], rows, still=True)
        self._yaw = _padded([p.yaw for p in flights], rows)
        self._turning = _padded([r[2] for r in rates], rows, still=True)
        self._joints = _padded([p.joints for p in flights], rows)
        self._twin = problem.plant.twin(values, batch, stiff=False)
        self.control = Controller(vehicle, batch, tilt=scene.tilt)
        self._lag = np.maximum(vehicle.lag + problem.plant.timing(values)[1], 1e-3)
        self._gust = np.zeros((batch, 6))
        self._level = np.repeat(vehicle.gust, 3)
        self._keep = float(np.exp(-step / vehicle.gust_time))
        self._weight = np.concatenate([np.full(3, self.control.mass), self.control.inertia])
        full = vehicle.full_voltage
        self._volts = None if full is None else np.full((batch, 1), 0.95 * full)
        self.time = 0.0
        self.state = self._begin(batch)
        self._drive = self.control.idle(batch)

    def _begin(self, batch: int) -> TwinState:
        half = 0.5 * self._yaw[0]
        still = np.zeros_like(half)
        turn = np.stack([still, still, np.sin(half), np.cos(half)], axis=1)
        zero = np.zeros((batch, 3))
        joints = self._joints[0]
        return TwinState(self._place[0], turn, zero, zero, joints, np.zeros_like(joints))

    def _inputs(self, drive: Floats, row: int) -> Inputs:
        joints = self._joints[row] if self._joints.shape[2] else None
        return Inputs(0.0, np.zeros((1, self._joints.shape[2])), drive, self._volts, joints)

    def _rates(self, twin: BatchDynamics, state: TwinState, drive: Floats, row: int) -> Rates:
        return twin.rates(state, np.full((len(state[0]), 1), self.time), self._inputs(drive, row))

    def _command(self, row: int, rates: Rates) -> Floats:
        wanted = Wanted(
            place=self._place[row],
            velocity=self._velocity[row],
            acceleration=self._acceleration[row],
            yaw=self._yaw[row],
            turning=self._turning[row],
        )
        felt = (rates.velocity, rates.angular_velocity)
        return self.control.commands(wanted, self._estimate(), felt, self._drive, self.step)

    def _estimate(self) -> TwinState:
        noise = [s * self.rng.standard_normal((len(self._gust), 3)) for s in _ESTIMATE]
        s = self.state
        return TwinState(
            s.position + noise[0],
            multiply(s.quaternion, exponential(noise[3])),
            s.velocity + noise[1],
            s.angular_velocity + noise[2],
            s.joints,
            s.joint_velocity,
        )

    def advance(self, row: int) -> Floats:
        """Compute the commands, advance by one row, and return the commands."""
        first = self._rates(self._twin, self.state, self._drive, row)
        command = self._command(row, first)
        half: Floats = command + (self._drive - command) * np.exp(-0.5 * self.step / self._lag)
        middle = _moved(self.state, first, 0.5 * self.step)
        second = self._rates(self._twin, middle, half, row)
        state = _moved(self.state, second, self.step)
        fresh = self.rng.standard_normal(self._gust.shape) * self._level
        self._gust = self._keep * self._gust + np.sqrt(1.0 - self._keep**2) * fresh
        kick = self._gust / self._weight * self.step
        self.state = state._replace(
            velocity=state.velocity + kick[:, :3],
            angular_velocity=state.angular_velocity + kick[:, 3:],
        )
        self._drive = command + (self._drive - command) * np.exp(-self.step / self._lag)
        self.time += self.step
        return command


def _moved(state: TwinState, rates: Rates, step: float) -> TwinState:
    parts = [getattr(state, n) + step * getattr(rates, n) for n in _NAMES]
    return TwinState(*parts).normal()


def _padded(parts: Sequence[Floats], rows: int, *, still: bool = False) -> Floats:
    """Stack references of different length, shape (rows, M, ...), padded by the last row or 0."""
    out = []
    for part in parts:
        last = np.zeros_like(part[-1:]) if still else part[-1:]
        out.append(np.concatenate([part, np.repeat(last, rows - len(part), axis=0)]))
    return np.stack(out, axis=1)


def _dropped(
    problem: Problem, scene: Scene, chosen: Sequence[Manoeuvre], values: Mapping[str, float]
) -> Rehearsal:
    step = problem.samples.step
    rows = round(chosen[0].seconds / step)
    jobs = [(m, r) for m in chosen for r in m.releases]
    level = 0.0 if scene.level is None else scene.level
    known = problem.vehicle.initial_state
    sigma: Any = (
        known[0]["sigma"]
        if known
        else dict.fromkeys(("position", "orientation", "velocity", "angular_velocity"), 0.01)
    )
    starts = tuple(_release(level, *release, sigma=sigma) for _, release in jobs)
    vehicle = replace(problem.vehicle, initial_state=starts)
    lengths = [rows] * len(jobs)
    none = np.zeros((rows * len(jobs), 0))
    nobody: dict[str, Any] = {"command": none, "joint_command": none, "voltage": None}
    blank = planned_plant(problem, None, lengths, step, vehicle=vehicle, **nobody)
    trajectory = simulated_trajectory(
        blank.samples, vehicle, parts=problem.plant.parts, plant=blank, values=values
    )
    plant = planned_plant(problem, trajectory, lengths, step, vehicle=vehicle, **nobody)
    runs = [
        Run(manoeuvre=m, load=0.0, path=None, first=k * rows, last=(k + 1) * rows)
        for k, (m, _) in enumerate(jobs)
    ]
    return Rehearsal(plant=plant, trajectory=trajectory, runs=tuple(runs))


def _release(
    level: float, height: float, tilt: float, spin: float, *, sigma: Mapping[str, float]
) -> dict[str, Any]:
    x, y, z, w = quaternion_of_rpy(np.array([[0.5 * tilt, tilt, 2.0 * spin]]))[0]
    return {
        "position": [0.0, 0.0, level + height],
        "orientation": [float(w), float(x), float(y), float(z)],
        "velocity": [0.0, 0.0, 0.0],
        "angular_velocity": [0.3 * spin, 0.0, spin],
        "sigma": sigma,
    }
