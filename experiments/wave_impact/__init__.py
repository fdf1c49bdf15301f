"""Solitary wave that hits the manipulator just after its fall into the water."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.config.compose import compose
from seals.experiments.command import figure_table, folder_of, parser_of, show_table
from seals.experiments.drop_test import held
from seals.logs import Log
from seals.report.figures import Mark, lines
from seals.report.pictures import write_picture
from seals.run.application import run_into
from seals.run.build import build_run

OVERRIDES = (
    "robot=aam",
    "water=particles",
    "name=wave_impact",
    "environment.tank_bottom=-0.45",
    "environment.friction=0.5",
    "initial.position=[0,0,0.3]",
    "initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]",
    "fluid.spacing=0.03",
    "fluid.size=[2.4,0.84,0.45]",
    "fluid.centre=[0.3,0]",
    "fluid.freeboard=0.8",
    "fluid.maker.kind=piston",
    "fluid.maker.sea=solitary",
    "fluid.maker.height=0.2",
    "fluid.maker.start=0.1",
    "fluid.beach.length=0.6",
    "+fluid.gauges.before=[-0.45,0.3]",
    "+fluid.gauges.beside=[0.0,0.36]",
    "time.duration=2.4",
    "time.step=0.004",
)
"""A flume of 2.4 m whose paddle makes one crest of 0.2 m on 0.45 m of water."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    given = parser_of("wave_impact").parse_args(arguments)
    out = folder_of(given, "wave_impact")
    words = [*OVERRIDES, *given.overrides]
    settings = build_run(compose(words))
    record = run_into(out, settings, overrides=words)
    found = measures(record.log, record.fluid)
    show_table(out, figure_table(found, 3))
    draw(out / "figure.png", record.log, record.fluid, found)
    return 0


def measures(log: Log, figures: Mapping[str, Floats]) -> dict[str, float]:
    """Return arrival of the crest, peak forces on three axes, and drift of the robot.

    Args:
        log: of the run.
        figures: what the fluid said of itself, by name.
    """
    time, crest = log.time, figures["gauge beside [m]"]
    # after the splashes of the fall, before the far wall sends water back
    late = (time > 0.9) & (time < 2.2)
    passes = float(time[late][int(np.argmax(crest[late]))])
    hit = (time > passes - 0.4) & (time < passes + 0.4)
    out = {
        "crest beside the robot [s]": passes,
        "height of the crest beside the robot [m]": float(crest[late].max()),
    }
    for axis in "xyz":
        force = held(log.columns[f"specific_force_{axis}"])[hit]
        out[f"felt along body {axis}, lowest [m/s^2]"] = float(force.min())
        out[f"felt along body {axis}, highest [m/s^2]"] = float(force.max())
    x = log.columns["position_x"]
    before = int(np.argmax(hit))
    out["carried along [m]"] = float(x[hit][-1] - x[before])
    out["lifted [m]"] = float(np.ptp(log.columns["position_z"][hit]))
    return out


def draw(path: Path, log: Log, figures: Mapping[str, Floats], found: Mapping[str, float]) -> None:
    """Draw force and speed on three axes, and the surface elevation."""
    passes = (Mark(at=found["crest beside the robot [s]"], label="crest"),)
    force = {a: held(log.columns[f"specific_force_{a}"]) for a in "xyz"}
    speed = {a: log.columns[f"velocity_{a}"] for a in "xyz"}
    surface = {name: figures[f"gauge {name} [m]"] for name in ("before", "beside")}
    surface["robot"] = log.columns["position_z"]
    write_picture(
        path,
        [
            lines("Surface and robot", "height [m]", log.time, surface, marks=passes),
            lines("What the inertial sensor felt", "[m/s²]", log.time, force, marks=passes),
            lines("Velocity in body axes", "[m/s]", log.time, speed, marks=passes),
        ],
    )
