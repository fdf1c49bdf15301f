"""One scenario with both water models: coefficients and particles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import folder_of, markdown, parser_of, show_table
from seals.experiments.drop_test import held
from seals.logs import Log
from seals.report.figures import Mark, lines
from seals.report.pictures import write_picture
from seals.run.application import run_into
from seals.run.build import run_settings
from seals.run.simulation import Record

SCENARIO = (
    "robot=ball",
    "environment.tank_bottom=-0.5",
    "initial.position=[0,0,0.4]",
    "time.duration=2",
    "time.step=0.002",
)
"""A ball falls into a tank; any other scenario is given as overrides."""

WATERS = {
    "fossen": ("water=fossen",),
    "particles": (
        "water=particles",
        "fluid.spacing=0.02",
        "fluid.size=[0.6,0.6,0.5]",
        "fluid.freeboard=0.5",
    ),
}
"""What makes each run's water."""


class _Both(NamedTuple):
    """The two runs on one clock.

    Args:
        time: [s], shape (rows,).
        fossen: water by coefficients.
        particles: water as particles.
        pushed: force of the particles in the vertical, link axes [N], shape (rows,).
    """

    time: Floats
    fossen: Log
    particles: Log
    pushed: Floats

    def differences(self) -> dict[str, tuple[float, float]]:
        """Return quantities of both runs by name, unit in the name: fossen, particles."""
        out: dict[str, tuple[float, float]] = {}
        rows = len(self.time)

        def note(name: str, measure: object) -> None:
            pair = [float(measure(log)) for log in (self.fossen, self.particles)]  # type: ignore[operator]
            out[name] = (pair[0], pair[1])

        z = "position_z"
        note("lowest point [m]", lambda log: log.columns[z][:rows].min())
        note(
            "time of the lowest point [s]", lambda log: self.time[np.argmin(log.columns[z][:rows])]
        )
        note("height at the end [m]", lambda log: log.columns[z][:rows][-50:].mean())
        note("largest felt force [m/s^2]", lambda log: _felt(log)[:rows].max())
        note("speed one tenth of a second after the peak [m/s]", lambda log: _after(log, rows))
        apart = self.fossen.columns[z][:rows] - self.particles.columns[z][:rows]
        out["difference in height, rms and largest [m]"] = (
            float(np.sqrt(np.mean(apart**2))),
            float(np.abs(apart).max()),
        )
        return out


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line."""
    overrides = "of the scenario; fluid.* for the particles"
    given = parser_of("water_compare", overrides).parse_args(arguments)
    out = folder_of(given, "water_compare")
    records = {name: _run(out / name, name, given.overrides) for name in WATERS}
    # both runs, cut to the shorter one
    rows = min(len(record.log.time) for record in records.values())
    push = np.zeros(rows)
    wrench = records["particles"].ledger.of("particles")[: rows - 1, :, 2].sum(axis=1)
    push[: len(wrench)] = wrench
    fossen, particles = records["fossen"].log, records["particles"].log
    both = _Both(fossen.time[:rows], fossen, particles, push)
    lines = [(name, f"{a:.4g}", f"{b:.4g}") for name, (a, b) in both.differences().items()]
    show_table(out, markdown(("figure", "fossen", "particles"), lines))
    _draw(out / "figure.png", both)
    return 0


def _run(folder: Path, water: str, overrides: Sequence[str]) -> Record:
    own = [w for w in overrides if water == "particles" or not w.lstrip("+").startswith("fluid.")]
    words = [*SCENARIO, *WATERS[water], f"name=water_{water}", *own]
    return run_into(folder, run_settings(words), overrides=words)


def _felt(log: Log) -> Floats:
    """Size of the felt force at every row; between two readings the last one stands."""
    return held(np.linalg.norm([log.columns[f"specific_force_{axis}"] for axis in "xyz"], axis=0))


def _after(log: Log, rows: int) -> float:
    peak = int(np.argmax(_felt(log)[:rows]))
    step = float(log.time[1] - log.time[0])
    at = min(peak + round(0.1 / step), rows - 2)
    z = log.columns["position_z"]
    return float((z[at + 1] - z[at - 1]) / (2.0 * step))


def _draw(path: Path, both: _Both) -> None:
    """Draw heights, specific forces, and their difference."""
    rows = len(both.time)
    runs = {"fossen": both.fossen, "particles": both.particles}
    height = {name: log.columns["position_z"][:rows] for name, log in runs.items()}
    felt = {name: _felt(log)[:rows] for name, log in runs.items()}
    apart = {"particles - fossen": height["particles"] - height["fossen"]}
    level = (Mark(at=0.0, label="water", level=True),)
    write_picture(
        path,
        [
            lines("Height", "z [m]", both.time, height, marks=level),
            lines("What the inertial sensor felt", "[m/s²]", both.time, felt),
            lines("Difference in height", "[m]", both.time, apart),
        ],
    )
