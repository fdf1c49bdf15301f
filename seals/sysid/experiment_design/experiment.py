"""File of a planned manoeuvre for the simulator: vehicle, controller, reference."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from seals.errors import ConfigError, suggestion
from seals.logs.atomic import plain, write_text
from seals.sysid.experiment_design.motions import Path as Reference
from seals.sysid.experiment_design.plan import Plan
from seals.sysid.validation.answer_form import check_form
from seals.untrusted_io import read_plain_yaml

KIND = "planned-manoeuvre"
"""What the file says it is."""
_OWN = ("logs", "recording", "date", "notes")
"""Facts of a log that are none of a flight of the same vehicle."""
_KEYS = ("kind", "name", "words", "effects", "step", "tilt", "runs", "meta")
_MAY = ("without",)
_STARTS = (("position", 3), ("orientation", 4), ("velocity", 3), ("angular_velocity", 3))
"""What a drop starts from, and how many numbers each has."""
"""Keys that may be left out."""
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
        runs = [{**_columns(asked), "voltage": full * share} for share in manoeuvre.batteries]
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


def _columns(asked: Reference) -> dict[str, Any]:
    """A reference as rounded columns."""
    return {
        "spacing": _SPACING,
        **{a: np.round(asked.place[:, k], 5).tolist() for k, a in enumerate("xyz")},
        "yaw": np.round(asked.yaw, 5).tolist(),
        "joints": np.round(asked.joints, 5).tolist() if asked.joints.shape[1] else [],
    }


def read_experiment(path: str | Path) -> Experiment:
    """Read a planned manoeuvre.

    Raises:
        ConfigError: the file is not one, or lacks something.
    """
    try:
        content = read_plain_yaml(Path(path))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        first = str(error).partition("\n")[0]
        raise ConfigError(
            f"experiment={path} cannot be read: {first}.\nGive a file that seals plan wrote."
        ) from error
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise ConfigError(f"experiment={path} is not a planned manoeuvre.\nAllowed: kind: {KIND}")
    for key in content:
        if key not in (*_KEYS, *_MAY):
            near = suggestion(str(key), (*_KEYS, *_MAY))
            raise ConfigError(f"experiment={path}: '{key}' is unknown.\n{near}")
    lacking = [key for key in _KEYS if key not in content]
    if lacking:
        raise ConfigError(
            f"experiment={path} lacks {', '.join(lacking)}.\nLet seals plan write it again."
        )
    try:
        check_form(content, {"meta?": {}, "runs?": [{}]}, "")
        return _experiment(content)
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(
            f"experiment={path} is damaged: {error}.\nLet seals plan write it again."
        ) from error


def _experiment(content: Mapping[str, Any]) -> Experiment:
    runs: Sequence[Mapping[str, Any]] = content["runs"]
    step = float(content["step"])
    flying = [r for r in runs if "x" in r]
    falling = [r for r in runs if "x" not in r]
    length = sum(float(r["spacing"]) * len(r["yaw"]) for r in flying)
    length += sum(float(r["seconds"]) for r in falling)
    if not 0.0 < step < math.inf or not 0.0 <= length <= MOST_ROWS * step:
        raise ValueError(f"{length:g} s in steps of {step:g} s; at most {MOST_ROWS:,} steps")
    for k, run in enumerate(runs):
        for name, count in () if "x" in run else _STARTS:
            given = run.get(name)
            numbers: list[Any] = given if isinstance(given, list) else []
            sound = all(type(v) in (int, float) and math.isfinite(v) for v in numbers)
            if len(numbers) != count or not sound:
                raise ValueError(f"runs[{k}].{name} needs {count} finite numbers")
    return Experiment(
        name=str(content["name"]),
        meta=content["meta"],
        step=step,
        tilt=float(content["tilt"]),
        references=tuple(_reference(r, step) for r in flying),
        releases=tuple(falling),
        voltages=tuple(float(r["voltage"]) for r in flying),
        without=tuple(str(name) for name in content.get("without") or ()),
    )


def _reference(run: Mapping[str, Any], step: float) -> Reference:
    """A written reference at the rows of the log."""
    from scipy.interpolate import CubicSpline

    place = np.array([run[a] for a in "xyz"], dtype=float).T
    yaw = np.array(run["yaw"], dtype=float)
    joints = np.array(run["joints"], dtype=float).reshape(len(yaw), -1)
    every = np.concatenate([place, yaw[:, None], joints], axis=1)
    at = np.arange(len(yaw)) * float(run["spacing"])
    time = np.arange(round(at[-1] / step)) * step
    dense = CubicSpline(at, every, axis=0)(time)
    return Reference(place=dense[:, :3], yaw=dense[:, 3], joints=dense[:, 4:])
