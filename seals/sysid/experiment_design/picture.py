"""Pictures of a plan: reference motion, and expected separations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from seals.frames import rotation_vector
from seals.logs.atomic import atomic_path
from seals.report.pictures import figure_class, log_scale
from seals.report.style import AXES, CYCLE, MUTED
from seals.sysid.experiment_design.plan import SEPARATED, Plan, percent

_LEAST = 0.1
"""Left end of the scale of separations."""


def write_pictures(path: str | Path, plan: Plan) -> Path:
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
    _dress(axes, "time [s]", "place [m] (dotted: asked for)")
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
    _dress(axes, "time [s]", "")
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
    label = "chi-square that the best wrong explanation leaves; green: confidence of 90 % or more"
    _dress(axes, label, "")


def _runs(plan: Plan) -> tuple[Any, list[Any]]:
    flown, first = plan.run_of(plan.best)
    name = first.manoeuvre.name
    return flown, [r for r in flown.rehearsal.runs if r.manoeuvre.name == name]


def _dress(axes: Any, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(True, color="#e3e6e8", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
