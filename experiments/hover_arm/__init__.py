"""Hover with a swinging arm: allocation with and without the live centre of gravity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import markdown, show_table
from seals.experiments.flights import deviations, flown, forces, options
from seals.frames import AXES
from seals.logs import Log
from seals.report.figures import Chart, Series
from seals.report.pictures import write_picture

SETTLED = 4.0
"""From here on the hover counts: the rotors have spun up, the arm begins to move [s]."""
WITHIN = (0.010, 0.003, 0.020)
"""Deviations in x, y and z that the flights with compensation shall keep [m]."""
PAPER = (0.015, 0.003, 0.2)
"""Deviations that the paper reports [m]."""
UNAWARE = "controller.cog_compensation=false"
CASES = {
    "sweep": ("guide.arm=sweep",),
    "random": ("guide.arm=random",),
    "sweep_without": ("guide.arm=sweep", UNAWARE),
    "random_without": ("guide.arm=random", UNAWARE),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line; 0 when all bounds are kept."""
    out, overrides = options("hover_arm", arguments)
    records = flown(out, "hover_arm", {n: [*words, *overrides] for n, words in CASES.items()})
    logs = {name: record.log for name, record in records.items()}
    found = {name: largest(log) for name, log in logs.items()}
    # the deviations as a table in Markdown
    rows = [[name, *(f"{1e3 * x:.2f}" for x in values)] for name, values in found.items()]
    rows += [
        [word, *(f"{1e3 * x:g}" for x in b)] for word, b in (("bound", WITHIN), ("paper", PAPER))
    ]
    show_table(out, markdown(["case", *(f"largest deviation {axis} [mm]" for axis in AXES)], rows))
    place = _start_of(logs["sweep"])
    charts = [deviations(_later(log), place, _titled(name)) for name, log in logs.items()]
    # the motion of the arm
    shown = _later(logs["sweep"])
    angle = shown.channel("joint_position")
    names = ("shoulder", "elbow", "wrist")
    series = tuple(Series(name=n, x=shown.time, y=angle[:, k]) for k, n in enumerate(names))
    write_picture(
        out / "figure.png",
        [*charts, Chart(title="Arm, sweep", y_label="angle [rad]", series=series)],
    )
    ledger = records["sweep"].ledger
    picture = [forces(ledger, 2, "Forces along z of the body"), forces(ledger, 4, "Pitch torques")]
    write_picture(out / "ledger.png", picture)
    return 0 if _kept(found) else 1


def _titled(case: str) -> str:
    """Return a case in words.

    Example:
        >>> _titled("sweep_without")
        'sweep, fixed centre of gravity'
    """
    return case.replace("_without", ", fixed centre of gravity")


def _start_of(log: Log) -> Floats:
    """Return the wanted position of the hover, that of its start [m], shape (3,)."""
    place: Floats = log.channel("position")[0]
    return place


def _later(log: Log) -> Log:
    """Return the log after settling."""
    rows = log.time >= SETTLED
    columns = {name: values[rows] for name, values in log.columns.items()}
    return Log(name=log.name, columns=columns, meta=log.meta, source=log.source)


def largest(log: Log) -> Floats:
    """Return the largest deviation along x, y and z after settling [m], shape (3,)."""
    away = _later(log).channel("position") - _start_of(log)
    found: Floats = np.abs(away).max(axis=0)
    return found


def _kept(found: dict[str, Any]) -> bool:
    """Return whether the bounds are kept and the live centre of gravity improves threefold."""
    for motion in ("sweep", "random"):
        aware, unaware = found[motion], found[f"{motion}_without"]
        if np.any(aware > WITHIN) or np.linalg.norm(unaware) < 3.0 * np.linalg.norm(aware):
            return False
    return True
