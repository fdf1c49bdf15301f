"""``seals plan``: proposes the manoeuvre that tells effects apart, as text, picture and file."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np

from seals.config.compose import output_folder
from seals.errors import ConfigError, refuse_absent
from seals.frames import rotation_vector
from seals.logs.atomic import atomic_path, write_json
from seals.report.pictures import dress, figure_class, log_scale
from seals.report.style import AXES, CYCLE, MUTED
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.experiment_design.plan import SEPARATED, Plan, percent, proposal, table
from seals.sysid.experiment_design.ranking import STAGES, propose
from seals.sysid.experiment_design.supposed import variants_of
from seals.sysid.predictors.problem import prepare
from seals.sysid.report.given_logs import given_logs, make_folder, robot_name
from seals.sysid.validation.answer import Answer, load_answer, noted_logs

ANSWER, PICTURE, EXPERIMENT = "plan.json", "plan.png", "experiment.yaml"
_LEAST = 0.1
"""Left end of the scale of separations."""


def execute(config: Any) -> int:
    """Run one composed plan and return its exit code.

    Raises:
        ConfigError: no log or no effects are given, or they do not go together.
        LogError: the log cannot be used.
    """
    from seals.run.progress import progress

    answer = Answer() if config.diagnosis is None else load_answer(str(config.diagnosis))[1]
    names = [str(n) for n in config.between] or _open_question(answer, str(config.diagnosis))
    places = config.log if config.log is not None else noted_logs(answer.tables)
    if not places:
        raise ConfigError(
            "log is not given.\nName the log of the vehicle: seals plan effects=[NAME,NAME] "
            "log=FOLDER"
        )
    given = given_logs(config, places, noted=answer.without)
    out = output_folder(config.out)
    with progress("planning", STAGES + 2) as tell, trials():
        log, robot = given.read()
        problem = prepare(log, robot=robot)
        tell(1)
        known = _known(problem.plant.candidate_set, answer, names)
        found = propose(
            problem,
            names,
            known=known,
            quick=False,
            seed=config.seed,
            tell=lambda done: tell(1 + done),
        )
    refuse_undefined("plan", [found.best.separation])
    words = [f"robot={robot_name(config)}"] if config.robot.folder else []
    command = shlex.join(["seals", "run", f"experiment={out / EXPERIMENT}", *words])
    from seals.sysid.experiment_design.experiment import write_experiment

    make_folder(out)
    logs = [str(place) for place in given.places]
    write_json(out / ANSWER, {**found.to_dict(), "log": logs[0] if len(logs) == 1 else logs})
    write_experiment(
        out / EXPERIMENT,
        found,
        log.meta,
        without=given.without if given.robot else (),
        command=command,
    )
    _write_pictures(out / PICTURE, found)
    print(f"{proposal(found)}\n\n{table(found)}\n\n{out / ANSWER}")
    print(f"Next, to fly it in the simulator:\n  {command} out=ANOTHER_LOG")
    return 0


def _open_question(given: Answer, place: str) -> list[str]:
    """Return the effects that a diagnosis could not tell apart."""
    command = "seals plan effects=[payload,thrust_coefficient] log=FOLDER, or diagnosis=FOLDER"
    refuse_absent(given.verdict or None, "effects", command)
    if not given.ambiguous_with:
        raise ConfigError(
            f"diagnosis={place}: the verdict is '{given.verdict}', which leaves no effects to "
            "distinguish.\n"
            "Name the effects yourself: effects=[payload,thrust_coefficient]"
        )
    return list(dict.fromkeys(given.ambiguous_with[0]))


def _known(
    candidate_set: CandidateSet, given: Answer, names: list[str]
) -> dict[str, dict[str, float]]:
    """Fitted values of the effects of a diagnosis, by parameter key."""
    out: dict[str, dict[str, float]] = {}
    for effect in given.effects:
        name, told = effect.name, {key: one.value for key, one in effect.parameters.items()}
        if name not in names:
            continue
        for candidate in variants_of(candidate_set, name):
            if candidate.identification.guessed:
                continue
            variant = {k: v for k, v in candidate.variant.items() if k in ("rotor", "joint")}
            if any(told.get(k) != v for k, v in variant.items()):
                continue
            pairs = zip(candidate.keys, candidate.reported, strict=True)
            shown = {k: told.get(r) for k, r in pairs}
            found = {k: v for k, v in shown.items() if isinstance(v, float)}
            if len(found) == len(candidate.keys) and any(found.values()):
                out[name] = found
                break
    return out


def _write_pictures(path: str | Path, plan: Plan) -> Path:
    """Draw the planned trajectory, its speeds, and the expected separations as one PNG file.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    height = 4.6 + 0.26 * len(plan.ranked)
    figure = figure_class()(figsize=(9.0, height), dpi=140, layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(3.4, 1.0 + 0.26 * len(plan.ranked)))
    top, bottom = parts
    both: Any = top.subplots(1, 2)
    _places(both[0], plan)
    _heading(both[1], plan)
    _bars(bottom.subplots(), plan)
    with atomic_path(path) as beside:
        figure.savefig(beside, metadata={"Software": "SEALS"})
    return Path(path)


def _places(axes: Any, plan: Plan) -> None:
    """Position over time, as flown in the rehearsal and as asked for."""
    flown, runs = _runs(plan)
    step = flown.rehearsal.plant.samples.step
    for number, run in enumerate(runs):
        rows = flown.rehearsal.rows(run)
        time = np.arange(run.last - run.first) * step
        place = flown.rehearsal.trajectory.position[rows] - plan.scene.home * [1.0, 1.0, 0.0]
        for k, name in enumerate("xyz"):
            label = name if number == 0 else None
            axes.plot(
                time, place[:, k], color=AXES[name], lw=1.6, label=label, alpha=1 - 0.2 * number
            )
            if run.path is not None:
                asked = run.path.place[:, k] - (plan.scene.home[k] if k < 2 else 0.0)
                axes.plot(time, asked, color=AXES[name], lw=0.8, ls=":")
    if plan.scene.level is not None:
        axes.axhline(plan.scene.level, color=MUTED, lw=0.8, ls="--")
    axes.set_title(f"'{plan.best.manoeuvre.name}': where to be", loc="left", fontsize=10)
    dress(axes, "time [s]", "position [m] (dotted: reference)")
    axes.legend(fontsize=8, frameon=False, ncols=3)


def _heading(axes: Any, plan: Plan) -> None:
    """Speed and heading over time."""
    flown, runs = _runs(plan)
    step, trajectory = flown.rehearsal.plant.samples.step, flown.rehearsal.trajectory
    for number, run in enumerate(runs):
        rows = flown.rehearsal.rows(run)
        time = np.arange(run.last - run.first) * step
        first = number == 0
        speed = np.linalg.norm(trajectory.velocity[rows], axis=1)
        lean = np.degrees(
            np.linalg.norm(rotation_vector(trajectory.quaternion[rows])[:, :2], axis=1)
        )
        axes.plot(time, speed, color=CYCLE[0], lw=1.4, label="speed [m/s]" if first else None)
        axes.plot(
            time, lean / 10.0, color=CYCLE[1], lw=1.0, label="lean [10 deg]" if first else None
        )
        if run.path is not None and np.ptp(run.path.yaw) > 0.0:
            label = "heading [rad]" if first else None
            axes.plot(time, run.path.yaw, color=CYCLE[2], lw=1.0, label=label)
        if run.path is not None and run.path.joints.size and np.ptp(run.path.joints, axis=0).any():
            label = "first joint [rad]" if first else None
            axes.plot(time, run.path.joints[:, 0], color=CYCLE[3], lw=1.0, label=label)
    axes.set_title("how fast", loc="left", fontsize=10)
    dress(axes, "time [s]", "")
    axes.legend(fontsize=8, frameon=False)


def _bars(axes: Any, plan: Plan) -> None:
    """Expected separations, best on top."""
    rows = plan.ranked[::-1]
    values = [max(r.separation, _LEAST) for r in rows]
    colours = [
        MUTED if r.unsafe else CYCLE[2] if r.confidence >= SEPARATED else CYCLE[1] for r in rows
    ]
    axes.barh(range(len(rows)), values, color=colours, height=0.7, left=0.0)
    log_scale(axes, "x")
    axes.set_xlim(_LEAST, max(*values, 10.0) * 6.0)
    names = [r.manoeuvre.name + (" (two logs)" if r.manoeuvre.logs > 1 else "") for r in rows]
    axes.set_yticks(
        range(len(rows)),
        [f"> {n}" if r is plan.best else n for n, r in zip(names, rows, strict=True)],
    )
    for k, r in enumerate(rows):
        note = "unsafe here" if r.unsafe else percent(r.confidence)
        axes.text(values[k] * 1.1, k, note, va="center", fontsize=8)
    what = " / ".join(plan.names) + (" / nothing" if len(plan.names) == 1 else "")
    axes.set_title(f"expected separation of {what}", loc="left", fontsize=10)
    label = "chi-square of the best wrong explanation; green: confidence of 90 % or more"
    dress(axes, label, "")


def _runs(plan: Plan) -> tuple[Any, list[Any]]:
    flown, first = plan.run_of(plan.best)
    name = first.manoeuvre.name
    return flown, [r for r in flown.rehearsal.runs if r.manoeuvre.name == name]
