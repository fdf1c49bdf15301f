"""Solitary wave that strikes the manipulator in its free fall, at three phases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import figure_table, folder_of, parser_of, show_table
from seals.experiments.drop_test import held
from seals.logs import Log
from seals.report.figures import Chart, Mark, lines
from seals.report.pictures import write_picture
from seals.run.application import run_into
from seals.run.build import run_settings

OVERRIDES = (
    "robot=aam",
    "water=particles",
    "name=wave_impact",
    "environment.tank_bottom=-0.45",
    "environment.friction=0.5",
    "initial.position=[0,0,0.45]",
    "initial.joint_position=[1.55,0,0,-0.6,-0.6,-0.6]",
    "fluid.spacing=0.03",
    "fluid.size=[2.4,0.84,0.45]",
    "fluid.centre=[0.3,0]",
    "fluid.freeboard=0.8",
    "fluid.settle=2.0",
    "fluid.maker.kind=piston",
    "fluid.maker.sea=solitary",
    "fluid.maker.height=0.25",
    "fluid.beach.length=0.6",
    "+fluid.gauges.before=[-0.45,0.3]",
    "+fluid.gauges.beside=[0.0,0.36]",
    "time.duration=0.8",
    "time.step=0.004",
)
"""A flume of 2.4 m whose paddle makes one crest of 0.25 m on 0.45 m of water."""
PHASES = {"front": -1.05, "crest": -1.2, "back": -1.35}
"""Start of the maker by what of the wave strikes the falling robot [s]."""
G = 9.81


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    given = parser_of("wave_impact").parse_args(arguments)
    out = folder_of(given, "wave_impact")
    table: dict[str, float] = {}
    charts: list[Chart] = []
    for phase, start in PHASES.items():
        words = [*OVERRIDES, f"fluid.maker.start={start}", *given.overrides]
        record = run_into(out / phase, run_settings(words), overrides=words)
        found = _measures(record.log, record.fluid)
        table |= {f"{phase}: {name}": value for name, value in found.items()}
        # charts of what the inertial sensor felt, and of surface and robot
        strike = (Mark(at=found["free fall until [s]"], label="strike"),)
        force = {a: held(record.log.columns[f"specific_force_{a}"]) for a in "xyz"}
        surface = {name: record.fluid[f"gauge {name} [m]"] for name in ("before", "beside")}
        surface["robot"] = record.log.columns["position_z"]
        charts += [
            lines(
                f"{phase}: felt by the inertial sensor",
                "[m/s²]",
                record.log.time,
                force,
                marks=strike,
            ),
            lines(
                f"{phase}: surface and robot", "height [m]", record.log.time, surface, marks=strike
            ),
        ]
    show_table(out, figure_table(table, 3))
    write_picture(out / "figure.png", charts)
    return 0


def _measures(log: Log, figures: Mapping[str, Floats]) -> dict[str, float]:
    """Return instants of strike and crest, and the largest sudden shifts on three axes.

    Args:
        log: of the run.
        figures: what the fluid said of itself, by name.
    """
    time, crest = log.time, figures["gauge beside [m]"]
    felt = {a: held(log.columns[f"specific_force_{a}"]) for a in "xyz"}
    size = np.sqrt(sum(f**2 for f in felt.values()))
    strike = int(np.argmax(size > 0.3 * G))
    out = {
        "free fall until [s]": float(time[strike]),
        "felt before it, largest [m/s^2]": float(size[:strike].max(initial=0.0)),
        "level beside the robot then [m]": float(crest[strike]),
        "crest beside the robot [s]": float(time[int(np.argmax(crest))]),
        "height of the crest there [m]": float(crest.max()),
    }
    hit = (time >= time[strike]) & (time < time[strike] + 0.3)
    for axis, force in felt.items():
        out[f"felt along body {axis} in 0.3 s, lowest [m/s^2]"] = float(force[hit].min())
        out[f"felt along body {axis} in 0.3 s, highest [m/s^2]"] = float(force[hit].max())
    x, z = log.columns["position_x"], log.columns["position_z"]
    out["carried along [m]"] = float(x[-1] - x[strike])
    out["lowest point [m]"] = float(z.min())
    return out
