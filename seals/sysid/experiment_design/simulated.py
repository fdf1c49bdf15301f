"""Simulation of a planned manoeuvre, written as a log."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.batch import TwinState
from seals.config.overlay import find_overlay, load_overlay, overlay_names, read_overlay
from seals.config.overrides import typed
from seals.errors import ConfigError, suggestion
from seals.file_names import file_name
from seals.frames import exponential, matrix_of, multiply
from seals.logs.log import Log
from seals.logs.native import write_native
from seals.run.progress import progress
from seals.sysid.data.robot_description import RobotDescription, describe_robot
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.experiment_design.control import Controller, Wanted
from seals.sysid.experiment_design.experiment import Experiment, read_experiment
from seals.sysid.experiment_design.motions import Path as Reference
from seals.sysid.experiment_design.sensed import Track, measured
from seals.sysid.validation.model import Model, nominal
from seals.sysid.validation.scene import VEHICLE, build_scene
from seals.world import World
from seals.world.felt import accelerations

_OPTIONS = ("experiment", "model", "out", "robot", "seed")
_SETTLE = 3.0
"""Time at the start of the reference before the log begins [s]."""
_PARTS = 2
"""Steps of the simulator between rows; five times as many with joints."""
_ESTIMATE = (0.002, 0.004, 0.004, 0.001)
"""Noise of the controller's estimates: place, velocity, body rates, attitude."""


def run(arguments: list[str]) -> int:
    """``seals run experiment=FILE``: simulate a planned manoeuvre and write its log.

    Raises:
        ConfigError: an option is unknown, or the file is not a planned manoeuvre.
    """
    options = _options(arguments)
    experiment = read_experiment(options["experiment"])
    robot = _robot(options.get("robot"), experiment.without)
    model = nominal(read_vehicle(experiment.meta, robot))
    if options.get("model"):
        model = _with_overlay(model, options["model"])
    seed = options.get("seed", "0")
    if not seed.isdigit():
        raise ConfigError(f"seed={seed} is not allowed.\nAllowed: a whole number from 0 on.")
    now = datetime.datetime.now()
    name = file_name(experiment.name)
    usual = Path("runs") / f"{now:%Y-%m-%d}" / f"{now:%H-%M-%S}_{name}"
    out = Path(options.get("out") or usual)
    log = simulate(experiment, model, seed=int(seed))
    write_native(log, out)
    words = [typed("log", str(out))]
    words += [typed("robot", options["robot"])] if robot else []
    words += [typed("without", experiment.without)] if experiment.without else []
    print(f"'{experiment.name}' flown: {log.rows} rows\n{out}")
    print(f"Next: seals diagnose {' '.join(words)}")
    return 0


def _robot(name: str | None, without: Sequence[str]) -> RobotDescription | None:
    """Return a robot without some of its effects; None for the vehicle of the file."""
    if not name:
        return None
    robot = describe_robot(name)
    return replace(robot, effects={k: e for k, e in robot.effects.items() if k not in without})


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


def _with_overlay(model: Model, name: str) -> Model:
    path = find_overlay(name)
    if path is None:
        raise ConfigError(f"there is no model '{name}'.\n{suggestion(name, overlay_names())}")
    overlay = read_overlay(load_overlay(path))
    overlay.refuse_withdrawn(force=False)
    return model.with_overlay(name, overlay)


def simulate(experiment: Experiment, model: Model, *, seed: int = 0) -> Log:
    """Simulate all runs of a planned manoeuvre, without gusts.

    Args:
        experiment: the manoeuvre.
        model: what acts, the nominal vehicle or one with more effects.
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
        flight = _Flight(world, model, experiment, job, parts=parts, volts=volts, rng=rng)
        track = flight.fly(rows)
    finally:
        world.close()
    return measured(experiment, model, track, parts=parts, volts=volts, rng=rng)


class _Flight:
    """Run in a world whose vehicle follows commands row by row, or none."""

    def __init__(
        self,
        world: World,
        model: Model,
        experiment: Experiment,
        job: Reference | Mapping[str, Any],
        *,
        parts: int,
        volts: float | None,
        rng: np.random.Generator,
    ) -> None:
        self.world, self.parts, self.step, self.rng = world, parts, experiment.step, rng
        self.actor, vehicle = world.actors[VEHICLE], model.vehicle
        self.control: Controller | None = None
        if isinstance(job, Mapping):
            world.reset({VEHICLE: _released(job)})
        else:
            self.reference, self.rates = job, job.rates(experiment.step)
            self.control = Controller(vehicle, 1, tilt=experiment.tilt, gains=experiment.gains)
            world.reset({VEHICLE: _placed(job)})
            self.actor.drive = self.control.idle(1)
        self.volts = None if not volts else np.array([[volts]])
        self.last: list[Configuration] = []

    def fly(self, rows: int) -> Track:
        """Let the transients decay, then record the rows."""
        if self.control is not None:
            for _ in range(round(_SETTLE / self.step)):
                self._advance(0, None)
        track = Track(states=[], before=[], after=[], commands=[], joints=[])
        for k in range(rows):
            self._advance(k, track)
        return track

    def _advance(self, row: int, track: Track | None) -> None:
        now = _copied(self.actor.body.read())
        command = np.zeros(0)
        if self.control is not None:
            command = self._command(row, now)
            self.actor.command = command[None]
            if self.reference.joints.shape[1]:
                self.actor.joint_command = self.reference.joints[row][None]
        before = self.last[-1] if self.last else None
        for part in range(self.parts):
            if self.volts is not None:
                self.actor.voltage = self.volts
            self.last = [*self.last[-1:], _copied(self.actor.body.read())]
            self.world.step()
            if part == 0 and track is not None:
                track.after.append(_copied(self.actor.body.read()))
        if track is not None:
            track.states.append(now)
            track.before.append(before)
            track.commands.append(command)
            joints = np.zeros(0) if self.control is None else self.reference.joints[row]
            track.joints.append(joints)

    def _command(self, row: int, now: Configuration) -> Floats:
        assert self.control is not None
        state, drive = self._estimate(now), self.actor.drive
        turn = matrix_of(now.quaternion[None])[0]
        step = self.world.step_size
        linear, angular = np.zeros(3), np.zeros(3)
        if self.last:
            seen = zip(*self.last, now, strict=True)
            rates = accelerations(Configuration(*(np.array(x) for x in seen)), step)
            linear, angular = (rate[-1] for rate in rates)
        spin = turn.T @ now.angular_velocity
        felt = turn.T @ linear - np.cross(spin, turn.T @ now.velocity)
        velocity, acceleration, turning = (r[row : row + 1] for r in self.rates)
        wanted = Wanted(
            place=self.reference.place[row : row + 1],
            velocity=velocity,
            acceleration=acceleration,
            yaw=self.reference.yaw[row : row + 1],
            turning=turning,
        )
        assert drive is not None
        both = (felt[None], (turn.T @ angular)[None])
        command: Floats = self.control.commands(wanted, state, both, drive, self.step)[0]
        return command

    def _estimate(self, now: Configuration) -> TwinState:
        turn = matrix_of(now.quaternion[None])[0]
        noise = [s * self.rng.standard_normal((1, 3)) for s in _ESTIMATE]
        return TwinState(
            now.position[None] + noise[0],
            multiply(now.quaternion[None], exponential(noise[3])),
            (turn.T @ now.velocity)[None] + noise[1],
            (turn.T @ now.angular_velocity)[None] + noise[2],
            now.joints[None],
            now.joint_velocity[None],
        )


def _copied(seen: Configuration) -> Configuration:
    return Configuration(*(np.array(x, dtype=float) for x in seen))


def _placed(reference: Reference) -> Configuration:
    half = 0.5 * float(reference.yaw[0])
    joints = reference.joints[0]
    return Configuration(
        position=reference.place[0],
        quaternion=np.array([0.0, 0.0, np.sin(half), np.cos(half)]),
        velocity=np.zeros(3),
        angular_velocity=np.zeros(3),
        joints=joints,
        joint_velocity=np.zeros_like(joints),
    )


def _released(job: Mapping[str, Any]) -> Configuration:
    w, x, y, z = (float(c) for c in job["orientation"])
    quaternion = np.array([x, y, z, w])
    turn = matrix_of(quaternion[None])[0]
    return Configuration(
        position=np.array(job["position"], dtype=float),
        quaternion=quaternion,
        velocity=turn @ np.array(job["velocity"], dtype=float),
        angular_velocity=turn @ np.array(job["angular_velocity"], dtype=float),
        joints=np.zeros(0),
        joint_velocity=np.zeros(0),
    )
