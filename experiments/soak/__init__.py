"""Endurance run: a million steps in waves, with checks of memory, energy and errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.errors import ConfigError
from seals.experiments.command import folder_of, markdown, parser_of, show_table
from seals.experiments.soak.flight import OVERRIDES
from seals.experiments.soak.running import soaked
from seals.report.figures import Chart, Mark, Series
from seals.report.pictures import write_picture
from seals.run.build import run_settings

MILLION = 1_000_000
GROWTH = 0.02
"""Largest growth of memory after the start [1]."""
GAP = 0.01
"""Largest gap of the energy balance over the energy that was moved [1]."""
WARM = 20_000
"""Steps after which the memory of a process should be constant."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiment from the command line; 0 when all bounds are kept."""
    parser = parser_of("soak", out="folder, also of a soak to resume; runs/DATE/TIME_soak")
    parser.add_argument("--steps", type=int, default=MILLION, help="of the engine")
    given = parser.parse_args(arguments)
    if given.steps < 1:
        raise ConfigError(f"--steps {given.steps} is not allowed.\nAllowed: one step or more.")
    out = folder_of(given, "soak")
    settings = run_settings([*OVERRIDES, *given.overrides])
    rows = soaked(out, settings, given.steps, given.overrides)
    found = figures(rows)
    bounds = {
        "rows that are not finite": "0",
        "growth of memory after the start [%]": f"{100.0 * GROWTH:g}",
        "gap of the energy balance, by the energy moved [%]": f"{100.0 * GAP:g}",
    }
    lines = [(name, f"{value:.6g}", bounds.get(name, "")) for name, value in found.items()]
    show_table(out, markdown(("figure", "value", "bound"), lines))
    # energy balance and memory over the steps; a height at every 1,000th step would be a scribble
    steps = np.array([row["step"] / 1000.0 for row in rows])
    gap = np.array([100.0 * row["gap_J"] / row["moved_J"] for row in rows])
    grown = np.array([100.0 * (row["rss_MB"] / rows[0]["rss_MB"] - 1.0) for row in rows])
    shown = (
        ("Gap of the energy balance, relative to the energy moved", "gap [%]", gap, (GAP, -GAP)),
        ("Memory of the process, relative to its first row", "growth [%]", grown, (GROWTH,)),
    )
    charts = [
        Chart(
            title=title,
            y_label=label,
            x_label="thousands of steps",
            series=(Series(name="", x=steps, y=values),),
            marks=tuple(
                Mark(at=100.0 * at, label=f"bound {100.0 * at:g} %", level=True) for at in bounds
            ),
        )
        for title, label, values, bounds in shown
    ]
    write_picture(out / "figure.png", charts)
    return 0 if kept(found) else 1


def figures(rows: Sequence[dict[str, float]]) -> dict[str, float]:
    """Return the figures of the run by name, unit in the name."""
    last = rows[-1]
    # the largest growth of memory in one process, from its warm state to its end [1]. A process
    # that ended before it was warm counts from its first row
    shares = [0.0]
    for process in sorted({row["process"] for row in rows}):
        own = [row for row in rows if row["process"] == process]
        warm = [row for row in own if row["step"] - own[0]["step"] >= WARM] or own
        shares.append(warm[-1]["rss_MB"] / warm[0]["rss_MB"] - 1.0)
    return {
        "steps": last["step"],
        "time [s]": last["time_s"],
        "crossings of the surface": last["crossings"],
        "rows that are not finite": sum(1.0 - row["finite"] for row in rows),
        "growth of memory after the start [%]": 100.0 * max(shares),
        "energy moved [kJ]": 1e-3 * last["moved_J"],
        "gap of the energy balance [J]": last["gap_J"],
        "gap of the energy balance, by the energy moved [%]": 100.0
        * last["gap_J"]
        / last["moved_J"],
        "wall time of the last process [s]": last["wall_s"],
    }


def kept(found: dict[str, float]) -> bool:
    """Return whether all bounds are kept."""
    return (
        found["rows that are not finite"] == 0.0
        and found["growth of memory after the start [%]"] <= 100.0 * GROWTH
        and abs(found["gap of the energy balance, by the energy moved [%]"]) <= 100.0 * GAP
    )
