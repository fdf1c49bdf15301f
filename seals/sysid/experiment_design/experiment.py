"""File of a planned manoeuvre for the simulator: vehicle, controller, reference."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml

from seals.errors import ConfigError
from seals.logs.atomic import plain, write_text
from seals.schema import Within, read, vars_of
from seals.sysid.experiment_design.motions import Path as Reference
from seals.sysid.experiment_design.plan import Plan
from seals.untrusted_io import read_file

KIND = "planned-manoeuvre"
"""What the file says it is."""
_OWN = ("logs", "recording", "date", "notes")
"""Facts of a log that are none of a flight of the same vehicle."""
_SPACING = 0.02
"""Time between two points of a written reference [s]."""
MOST_ROWS = 10_000_000
"""Steps of all runs of an experiment together: hours of flight."""


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Planned manoeuvre with vehicle, controller and reference.

    Args:
        name: of the manoeuvre.
        meta: description of the vehicle, its sensors and its surroundings, as in ``meta.yaml``.
        step: time between rows of the log [s].
        tilt: largest lean [rad].
        references: one for each run; empty for drops.
        releases: start state of each drop, as in ``initial_state``.
        voltages: of the battery in each run [V].
        without: effects of the robot's folder that do not act.
    """

    name: str
    meta: Mapping[str, Any]
    step: float
    tilt: float
    references: tuple[Reference, ...]
    releases: tuple[Mapping[str, Any], ...]
    voltages: tuple[float, ...]
    without: tuple[str, ...] = ()


_Length = Annotated[float, Within(0.0, 1e9)]
_Three = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class _Flight:
    """Run along a reference: columns at equal times, and the battery."""

    spacing: _Length
    x: Sequence[float]
    y: Sequence[float]
    z: Sequence[float]
    yaw: Sequence[float]
    joints: Sequence[Sequence[float]] = ()
    voltage: float


@dataclass(frozen=True, kw_only=True)
class _Drop:
    """Run from a start state."""

    seconds: _Length
    position: _Three
    orientation: tuple[float, float, float, float]
    velocity: _Three
    angular_velocity: _Three


@dataclass(frozen=True, kw_only=True)
class _Planned:
    """File of a planned manoeuvre; of its runs, those with columns are flights."""

    kind: Literal["planned-manoeuvre"]
    name: str
    words: str
    effects: Sequence[str]
    step: Annotated[float, Within(1e-9, 1e9)]
    tilt: float
    runs: Sequence[Mapping[str, Any]]
    meta: Mapping[str, Any]
    without: Sequence[str] = ()


def write_experiment(
    path: str | Path,
    plan: Plan,
    meta: Mapping[str, Any],
    *,
    without: Sequence[str] = (),
    command: str = "",
) -> None:
    """Write the proposed manoeuvre.

    Args:
        path: the file.
        plan: with the proposal.
        meta: description of the vehicle, as its log has it.
        without: effects of the robot's folder that do not act.
        command: that flies it.
    """
    manoeuvre, scene, vehicle = plan.best.manoeuvre, plan.scene, plan.problem.vehicle
    runs: list[dict[str, Any]] = []
    if manoeuvre.path is None:
        flown, _ = plan.run_of(plan.best)
        states = flown.rehearsal.plant.vehicle.initial_state
        names = [r.manoeuvre.name for r in flown.rehearsal.runs]
        chosen = [s for s, n in zip(states, names, strict=True) if n == manoeuvre.name]
        runs = [{**s, "segment": k, "seconds": manoeuvre.seconds} for k, s in enumerate(chosen)]
    else:
        count = round(manoeuvre.seconds / _SPACING) + 1
        asked = manoeuvre.path(scene, np.arange(count, dtype=float) * _SPACING)
        full = vehicle.full_voltage or 0.0
        runs = [
            {
                "spacing": _SPACING,
                **{a: np.round(asked.place[:, k], 5).tolist() for k, a in enumerate("xyz")},
                "yaw": np.round(asked.yaw, 5).tolist(),
                "joints": np.round(asked.joints, 5).tolist() if asked.joints.shape[1] else [],
                "voltage": full * share,
            }
            for share in manoeuvre.batteries
        ]
    content = {
        "kind": KIND,
        "name": manoeuvre.name,
        "words": manoeuvre.words,
        "effects": list(plan.names),
        "step": plan.problem.samples.step,
        "tilt": scene.tilt,
        "runs": runs,
        "meta": {key: value for key, value in meta.items() if key not in _OWN},
        **({"without": list(without)} if without else {}),
    }
    text = yaml.safe_dump(plain(content), sort_keys=False, default_flow_style=None, width=140)
    command = command or shlex.join(["seals", "run", f"experiment={path}"])
    write_text(path, f"# Fly it: {command} [model=NAME] [out=FOLDER]\n{text}")


def read_experiment(path: str | Path) -> Experiment:
    """Read a planned manoeuvre.

    Raises:
        ConfigError: the file is not one, or lacks something.
    """
    found = read_file(_Planned, path, remedy="Give a file written by seals plan.")
    flights, drops = [], []
    for k, run in enumerate(found.runs):
        where = f"{path}: runs[{k}]"
        if "x" in run:
            flights.append(read(_Flight, run, where=where))
        else:
            drops.append({**run, **vars_of(read(_Drop, run, where=where, extra=True))})
    length = sum(flight.spacing * len(flight.yaw) for flight in flights)
    length += sum(drop["seconds"] for drop in drops)
    if not length <= MOST_ROWS * found.step:
        raise ConfigError(
            f"{path} is damaged: {length:g} s in steps of {found.step:g} s.\n"
            f"Allowed: at most {MOST_ROWS:,} steps. Write it again with seals plan."
        )
    try:
        references = tuple(_reference(flight, found.step) for flight in flights)
    except (IndexError, ValueError) as error:
        raise ConfigError(
            f"{path} is damaged: {error}.\nWrite it again with seals plan."
        ) from error
    return Experiment(
        name=found.name,
        meta=found.meta,
        step=found.step,
        tilt=found.tilt,
        references=references,
        releases=tuple(drops),
        voltages=tuple(flight.voltage for flight in flights),
        without=tuple(found.without),
    )


def _reference(flight: _Flight, step: float) -> Reference:
    """A written reference at the rows of the log."""
    from scipy.interpolate import CubicSpline

    yaw = np.array(flight.yaw)
    joints = np.array(flight.joints).reshape(len(yaw), -1)
    columns = [np.array(axis)[:, None] for axis in (flight.x, flight.y, flight.z, flight.yaw)]
    every = np.concatenate([*columns, joints], axis=1)
    at = np.arange(len(yaw)) * flight.spacing
    time = np.arange(round(at[-1] / step)) * step
    dense = CubicSpline(at, every, axis=0)(time)
    return Reference(place=dense[:, :3], yaw=dense[:, 3], joints=dense[:, 4:])
