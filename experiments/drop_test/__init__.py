"""Drop the manipulator, motors off, from 1 m into water, and watch it sink to the bottom."""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seals.config.compose import compose
from seals.config.run import build_run
from seals.experiments.fetching import vertical
from seals.experiments.frames import View, draw_frames, write_sheet
from seals.logs import Log
from seals.report.figures import Mark, lines
from seals.report.pictures import write_picture
from seals.run.application import run_into

OVERRIDES = (
    "experiment=drop_test",
    "robot=aam",
    "name=drop_test_aam",
    "environment.tank_bottom=-1.5",
    "environment.friction=0.8",
    "initial.joint_position=[0,0,0,-0.6,-0.6,-0.6]",
    "time.duration=8",
    # the entry is resolved, see conf/experiment/drop_test.yaml
    "time.step=0.002",
)
"""The drop test of the ball, with the manipulator over deeper water."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    parser = argparse.ArgumentParser(prog="python -m seals.experiments.drop_test")
    parser.add_argument("--out", type=Path, help="folder; runs/DATE/TIME_NAME when left out")
    parser.add_argument("overrides", nargs="*", help="as for seals run")
    given = parser.parse_args(arguments)
    stamp = datetime.datetime.now().astimezone()
    out = given.out or Path("runs") / f"{stamp:%Y-%m-%d}" / f"{stamp:%H-%M-%S}_drop_test_aam"
    words = [*OVERRIDES, *given.overrides]
    settings = build_run(compose(words))
    record = run_into(out, settings, overrides=words)
    found = measures(record.log)
    (out / "table.md").write_text(table(found), encoding="utf-8")
    marks = (Mark(at=0.0, label="water", level=True), Mark(at=-1.5, label="bottom", level=True))
    log = record.log
    named = {"x": "specific_force_x", "y": "specific_force_y", "z": "specific_force_z"}
    force = {key: np.nan_to_num(log.columns[name]) for key, name in named.items()}
    write_picture(
        out / "figure.png",
        [
            lines("Height", "z [m]", log.time, {"body": log.columns["position_z"]}, marks=marks),
            lines("What the inertial sensor felt", "specific force [m/s²]", log.time, force),
        ],
    )
    write_picture(out / "ledger.png", vertical(record.ledger, 0, "body of the manipulator"))
    times = {f"{t:g} s": t for t in (0.0, 0.3, 0.5, 0.8, 1.5, 3.0, 5.0, float(log.time[-1]))}
    pictures = draw_frames(log, settings, list(times.values()), View(pitch=-6.0))
    write_sheet(out / "stages.png", dict(zip(times, pictures, strict=True)))
    print((out / "table.md").read_text(encoding="utf-8"))
    return 0


def measures(log: Log) -> dict[str, float]:
    """Return the figures of a drop by name, unit in the name."""
    z = log.columns["position_z"]
    speed = np.gradient(z, log.time)
    wet = int(np.argmax(z < 0.0))
    under = (z < -0.3) & (z > -1.0)
    force = np.nan_to_num(log.columns["specific_force_z"])
    return {
        "time until the body's origin is under water [s]": float(log.time[wet]),
        "largest speed [m/s]": float(-speed.min()),
        "largest specific force along body z [m/s^2]": float(force.max()),
        "mean speed between 0.3 and 1 m under water [m/s]": float(-speed[under].mean())
        if under.any()
        else 0.0,
        "height at the end [m]": float(z[-1]),
        "speed at the end [m/s]": float(abs(speed[-1])),
    }


def table(found: dict[str, float]) -> str:
    """Return the figures as a table in Markdown."""
    rows = [f"| {name} | {value:.4g} |" for name, value in found.items()]
    return "\n".join(["| figure | value |", "|---|---|", *rows]) + "\n"
