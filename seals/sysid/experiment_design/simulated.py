"""Simulation of a planned manoeuvre, written as a log."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.config.overlay import find_overlay, load_overlay, overlay_names, read_overlay
from seals.config.overrides import typed
from seals.errors import ConfigError, suggestion
from seals.file_names import file_name
from seals.frames import exponential, multiply
from seals.logs.channels import column_names
from seals.logs.log import Log
from seals.logs.native import write_native
from seals.registry import get
from seals.run.hover_trim import carrying_speeds
from seals.run.progress import progress
from seals.sysid.data.robot_description import describe_robot
from seals.sysid.data.trajectory import posture_readings
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.experiment_design.control import Course, controller_of, plant_of
from seals.sysid.experiment_design.experiment import Experiment, read_experiment
from seals.sysid.experiment_design.motions import Path as Reference
from seals.sysid.predictors.rollout import start_states
from seals.sysid.validation.model import Model, nominal
from seals.sysid.validation.replay import felt_at, placed, reported, stacked
from seals.sysid.validation.scene import VEHICLE, build_scene
from seals.world import World
from seals.world.pilot import Pilot

_OPTIONS = ("experiment", "model", "out", "robot", "seed")
_SETTLE = 3.0
"""Time at the start of the reference before the log begins [s]."""
_PARTS = 2
"""Steps of the simulator between rows; five times as many with joints."""


def run(arguments: list[str]) -> int:
    """``seals run experiment=FILE``: simulate a planned manoeuvre and write its log.

    Raises:
        ConfigError: an option is unknown, or the file is not a planned manoeuvre.
    """
    options = _options(arguments)
    experiment = read_experiment(options["experiment"])
    robot = describe_robot(options["robot"]) if options.get("robot") else None
    if robot is not None:
        kept = {k: e for k, e in robot.effects.items() if k not in experiment.without}
        robot = replace(robot, effects=kept)
    model = nominal(read_vehicle(experiment.meta, robot))
    if options.get("model"):
        name = options["model"]
        path = find_overlay(name)
        if path is None:
            raise ConfigError(f"there is no model '{name}'.\n{suggestion(name, overlay_names())}")
        overlay = read_overlay(load_overlay(path))
        overlay.refuse_withdrawn(force=False)
        model = model.with_overlay(name, overlay)
    seed = options.get("seed", "0")
    if not seed.isdigit():
        raise ConfigError(f"seed={seed} is not allowed.\nAllowed: an integer of 0 or more.")
    now = datetime.datetime.now()
    usual = Path("runs") / f"{now:%Y-%m-%d}" / f"{now:%H-%M-%S}_{file_name(experiment.name)}"
    out = Path(options.get("out") or usual)
    log = simulate(experiment, model, seed=int(seed))
    write_native(log, out)
    words = [typed("log", str(out))]
    words += [typed("robot", options["robot"])] if robot else []
    words += [typed("without", experiment.without)] if experiment.without else []
    print(f"'{experiment.name}' flown: {log.rows} rows\n{out}")
    print(f"Next: seals diagnose {' '.join(words)}")
    return 0


def _options(arguments: list[str]) -> dict[str, str]:
    out = {}
    for word in arguments:
        key, equals, value = word.partition("=")
        key = key.lstrip("+")
        if key not in _OPTIONS or not equals:
            raise ConfigError(
                f"{word}: a planned manoeuvre takes no such option.\n{suggestion(key, _OPTIONS)}"
            )
        out[key] = value
    return out


def simulate(experiment: Experiment, model: Model, *, seed: int = 0) -> Log:
    """Simulate all runs of a planned manoeuvre, without gusts.

    Args:
        experiment: the manoeuvre.
        model: what acts, the stated vehicle or one with more effects.
        seed: of the sensors' noise.

    Returns:
        A log in the native format.
    """
    vehicle, rng = model.vehicle, np.random.default_rng(seed)
    jobs: list[Any] = [*experiment.references, *experiment.releases]
    columns: dict[str, list[Floats]] = {}
    segment: list[Floats] = []
    start = 0.0
    with progress("flying", len(jobs)) as tell:
        for k, job in enumerate(jobs):
            volts = experiment.voltages[k] if experiment.voltages else None
            rows = _run(experiment, model, job, volts, rng)
            count = len(rows["t"])
            rows["t"] = rows["t"] + start
            start = float(rows["t"][-1]) + 5.0
            for name, values in rows.items():
                columns.setdefault(name, []).append(values)
            segment.append(np.full(count, k))
            tell(k + 1)
    meta = {k: v for k, v in experiment.meta.items() if k != "initial_state"}
    if experiment.releases:
        meta["initial_state"] = [dict(r) for r in experiment.releases]
    return Log(
        name=f"{vehicle.name}: {experiment.name}",
        columns={n: np.concatenate(v) for n, v in columns.items()},
        segment=np.concatenate(segment).astype(np.int64),
        meta=meta,
        source="simulated",
    )


def _run(
    experiment: Experiment,
    model: Model,
    job: Reference | Mapping[str, Any],
    volts: float | None,
    rng: np.random.Generator,
) -> dict[str, Floats]:
    """Return one simulated run as columns of a log."""
    arm = model.vehicle.robot.tree.joints > 0
    parts = _PARTS * (5 if arm else 1)
    step = experiment.step
    seconds = float(job["seconds"]) if isinstance(job, Mapping) else len(job.yaw) * step
    rows = round(seconds / step)
    world = build_scene(model, step=step / parts, rows=(rows + round(_SETTLE / step) + 2) * parts)
    try:
        track = _fly(world, model, experiment, job, rows=rows, parts=parts, volts=volts)
    finally:
        world.close()
    return _measured(experiment, model, track, parts=parts, volts=volts, rng=rng)


def _fly(
    world: World,
    model: Model,
    experiment: Experiment,
    job: Reference | Mapping[str, Any],
    *,
    rows: int,
    parts: int,
    volts: float | None,
) -> _Track:
    """Let the transients of a vehicle decay, then record rows in which it follows commands or none.

    Args:
        world: with the vehicle.
        model: what acts.
        experiment: the manoeuvre.
        job: reference to follow, or start state to be released from.
        rows: of the log.
        parts: steps of the simulator between rows.
        volts: of the battery.
    """
    actor, step, settling, guide = world.actors[VEHICLE], experiment.step, 0, None
    if isinstance(job, Mapping):
        world.reset({VEHICLE: placed(start_states([job]), 0)})
    else:
        settling, vehicle = round(_SETTLE / step), model.vehicle
        course, guide = Course.of([job], step), get("guide", "commanded").load()(rate=1.0 / step)
        actor.pilot = Pilot(
            plant_of(vehicle, job.joints[0]),
            controller_of(vehicle, experiment.tilt, rate=1.0 / step),
            guide,
            volume=actor.evaluator.surroundings.volume,
            step=world.step_size,
        )
        actor.drive_at_start = carrying_speeds(actor.pilot.plant, job.joints[0])
        world.reset({VEHICLE: Configuration(*(part[0] for part in course.start()))})
    seen, orders = [], []
    for k in range(-settling * parts, rows * parts):
        if k >= 0:
            seen.append(actor.body.read())
        if guide is not None and k % parts == 0:
            guide.tell(course.only(max(k // parts, 0)))
        if volts:
            actor.voltage = np.array([[volts]])
        world.step()
        if k >= 0 and k % parts == 0:
            given = actor.command, actor.joint_command
            orders.append([np.zeros(0) if x is None else x[0] for x in given])
    seen.append(actor.body.read())
    commands, joints = (np.array(x) for x in zip(*orders, strict=True))
    return _Track(stacked(seen), commands, joints)


class _Track(NamedTuple):
    """One simulated run.

    Args:
        seen: base and joints at the start and after every step of the simulator.
        commands: of the drives at every row of the log, shape (T, n).
        joints: of the joints, shape (T, J).
    """

    seen: Configuration
    commands: Floats
    joints: Floats


def _measured(
    experiment: Experiment,
    model: Model,
    track: _Track,
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
        sigma = vehicle.sigma[name]
        if name == "orientation":
            turned = multiply(values, exponential(sigma * rng.standard_normal((len(values), 3))))
            noisy = np.asarray(turned, dtype=np.float64)[:, [3, 0, 1, 2]]
        else:
            noisy = values + sigma * rng.standard_normal(values.shape)
        read = np.where(seen, noisy, np.nan)
        out |= zip(column_names(name, read.shape[1], name), read.T, strict=True)
    if "battery_voltage" in channels and volts:
        noise = vehicle.sigma["battery_voltage"] * rng.standard_normal(rows)
        out["battery_voltage"] = volts + noise
    return out


def _exact(experiment: Experiment, model: Model, track: _Track, parts: int) -> dict[str, Floats]:
    """Return the readings without noise, one row for each row of the log."""
    vehicle, step = model.vehicle, experiment.step
    at, joints = np.arange(len(track.commands)) * parts, track.joints.shape[1]
    gravity = vehicle.environment.gravity
    now, felt = felt_at(track.seen, at, step / parts, gravity, straddle=not joints)
    spin, force, turn = np.split(
        reported(model, felt[None], 0, model.sensor_delay / step)[0], (3, 6), 1
    )
    if turn.size:
        now = now._replace(quaternion=multiply(now.quaternion, exponential(turn)))
    placed_at = posture_readings(now, vehicle.environment.water_level)
    return {"angular_velocity": spin, "specific_force": force, **placed_at}
