"""Simulation of manoeuvres by batch dynamics, and the logs that they would give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import BatchDynamics, TwinState
from seals.batch.piloted import BatchPilot
from seals.control import RobotState
from seals.effects.binding import bind_effects, has_hook
from seals.frames import exponential, matrix_of, quaternion_of_rpy
from seals.motion import Inputs
from seals.run.hover_trim import carrying_speeds
from seals.sysid.data.samples import Samples
from seals.sysid.data.trajectory import Trajectory, posture_readings
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.experiment_design.control import (
    ALL,
    Course,
    controller_of,
    plant_of,
)
from seals.sysid.experiment_design.manoeuvres import Manoeuvre
from seals.sysid.experiment_design.motions import Path
from seals.sysid.experiment_design.scene import ARM, CROSSING, WATER, Scene
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.problem import Problem, transient_rows
from seals.sysid.predictors.rollout import simulated_trajectory
from seals.world.drivetrain import Response, response_of

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
LOAD = "mass.mass"
"""Factor that stands for a known mass at the middle of the base."""


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

    plant: ExtendedModel
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
    states, command = fly(problem, scene, flights, values, step=step, seed=seed)
    thin = THINNED.get(scene.kind, 1)
    step, command = step * thin, command[::thin]
    flights = [
        Path(place=p.place[::thin], yaw=p.yaw[::thin], joints=p.joints[::thin]) for p in flights
    ]
    lengths = [len(p.yaw) for p in flights]
    voltage = [
        _voltage(problem.vehicle, b, n, step) for (_, b), n in zip(jobs, lengths, strict=True)
    ]
    trajectory = Trajectory.joined(states[::thin], lengths)
    commands = np.concatenate([command[:n, k] for k, n in enumerate(lengths)])
    bends = np.concatenate([p.joints for p in flights])
    plant = _planned_plant(
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
    return full * (share - _DISCHARGE * time)[:, None]


def fly(
    problem: Problem,
    scene: Scene,
    flights: Sequence[Path],
    values: Mapping[str, float],
    *,
    step: float,
    seed: int = 0,
) -> tuple[list[TwinState], Floats]:
    """Simulate a batch of controlled vehicles.

    Args:
        problem: vehicle and library.
        scene: room and powers.
        flights: references, one row a step.
        values: changes of factors with which the true vehicle flies.
        step: time between rows, integrator and controller [s].
        seed: of gusts and noise.

    Returns:
        States of the M vehicles at each of T rows, and commands, shape (T, M, n).

    Raises:
        ConfigError: no controller of the library flies this vehicle.
    """
    vehicle, rng, count = problem.vehicle, np.random.default_rng(seed), len(flights)
    twin = problem.plant.twin(values, count, stiff=False)
    plant, courses = plant_of(vehicle, scene.joints), Course.of(flights, step)
    controller = controller_of(vehicle, scene.tilt, rate=1.0 / step)
    pilot = BatchPilot(controller, plant, twin, plant.effects)
    response, memory = _response(problem, values), pilot.law.start(count)
    full = vehicle.full_voltage
    volts = None if full is None else np.full((count, 1), 0.95 * full)
    drive = np.tile(carrying_speeds(plant, scene.joints), (count, 1))
    state = courses.start()
    still, settling = twin.no_torque(), round(_SETTLE / step)
    kicks = _kicks(vehicle, settling + courses.rows, count, step, rng)
    states, commands = [], []
    for k in range(-settling, courses.rows):
        aim, time = courses.aim(max(k, 0)), np.full((count, 1), (k + settling) * step)
        posture = twin.posture(state, time)
        known = pilot.situation(state, time, posture, step)
        command, memory = pilot.law.command(_blurred(known, rng), aim, memory)
        if k >= 0:
            states.append(state)
            commands.append(command)
        bent = aim.joints.get(ALL)
        goal = response.goal(command, None)
        drives = [response.followed(drive, goal, share * step) for share in (0.0, 0.5, 1.0)]
        # the memory of effects rests, as it does along a log
        first, middle, last = (Inputs(0.0, still, d, volts, bent) for d in drives)
        state, _ = twin.advance(state, time, step, (first, middle, last), posture)
        push, turn = np.split(kicks[k + settling], 2, axis=1)
        state = state._replace(
            velocity=state.velocity + push, angular_velocity=state.angular_velocity + turn
        )
        drive = drives[2]
    return states, np.stack(commands)


def _response(problem: Problem, values: Mapping[str, float]) -> Response:
    """Lag and limits of the drives with which the true vehicle flies."""
    _, change, asymmetry = problem.plant.timing(values)
    nominal = response_of(bind_effects(problem.vehicle.effects, problem.vehicle.robot.links))
    lag = np.maximum(nominal.lag + change - asymmetry, 0.0)
    fall = np.maximum(nominal.fall + change + asymmetry, 0.0)
    changed = nominal._replace(lag=lag, fall=fall, delay=0.0)
    return changed.over_batch(np.zeros(1), problem.plant.commanding(values))


def _blurred(known: RobotState, rng: np.random.Generator) -> RobotState:
    """Add the noise of the estimates that a controller has."""
    place, speed, spin, turn = (s * rng.standard_normal(known.position.shape) for s in _ESTIMATE)
    return known._replace(
        position=known.position + place,
        velocity=known.velocity + speed,
        angular_velocity=known.angular_velocity + spin,
        rotation=known.rotation @ matrix_of(exponential(turn)),
    )


def _kicks(
    vehicle: Vehicle, rows: int, count: int, step: float, rng: np.random.Generator
) -> Floats:
    """Changes of velocity and spin in every step by coloured gusts, shape (rows, M, 6)."""
    from scipy.signal import lfilter  # half a second, which a diagnosis that plans nothing saves

    keep = float(np.exp(-step / vehicle.gust_time))
    white = rng.standard_normal((rows, count, 6)) * np.repeat(vehicle.gust, 3)
    inertia = np.concatenate([np.full(3, vehicle.mass), np.diag(vehicle.robot.inertia[0])])
    gusts = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0)
    return gusts * (step / inertia)


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
    blank = _planned_plant(problem, None, lengths, step, vehicle=vehicle, **nobody)
    trajectory = simulated_trajectory(
        blank.samples, vehicle, parts=problem.plant.parts, plant=blank, values=values
    )
    plant = _planned_plant(problem, trajectory, lengths, step, vehicle=vehicle, **nobody)
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


class _Planned(ExtendedModel):
    """ExtendedModel whose added inertia varies over the batch if one of its parameters does."""

    def twin(
        self, values: Mapping[str, Any], batch: int, *, stiff: bool = True, over_steps: bool = False
    ) -> BatchDynamics:
        """Batch dynamics of the stated model with changes, see `ExtendedModel.twin`."""
        effects = self.candidate_set.effects
        arrays = {k.partition(".")[0] for k, v in values.items() if np.ndim(v)} & set(effects)
        moved = {n for n in arrays if has_hook(effects[n], "inertia")}
        full = {
            key: np.full(batch, np.asarray(values.get(key, 0.0)))
            for key, parameter in self.candidate_set.parameters.items()
            if parameter.instance in moved
        }
        return super().twin({**values, **full}, batch, stiff=stiff, over_steps=over_steps)


def _planned_plant(
    problem: Problem,
    trajectory: Trajectory | None,
    lengths: Sequence[int],
    step: float,
    *,
    command: Floats,
    joint_command: Floats,
    voltage: Floats | None,
    vehicle: Vehicle | None = None,
) -> ExtendedModel:
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
    exact = {
        **posture_readings(trajectory, problem.vehicle.environment.water_level),
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
