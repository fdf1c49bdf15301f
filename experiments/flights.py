"""Base of the flight experiments: runs below one folder, tracking errors, tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.experiments.command import folder_of, parser_of
from seals.frames import AXES
from seals.logs import Log
from seals.report.figures import Chart, Series
from seals.run.application import run_into
from seals.run.build import run_settings
from seals.run.simulation import Record
from seals.world import Ledger


def options(name: str, arguments: Sequence[str] | None) -> tuple[Path, list[str]]:
    """Return the folder to write to and the overrides that were given on the command line."""
    given = parser_of(name).parse_args(arguments)
    return folder_of(given, name), list(given.overrides)


def flown(out: Path, experiment: str, cases: Mapping[str, Sequence[str]]) -> dict[str, Record]:
    """Run every case of an experiment into a folder of its own.

    Args:
        out: folder of all cases.
        experiment: whose recipe they share.
        cases: overrides by name.

    Raises:
        SealsError: a case cannot start, or failed on the way.
    """
    records = {}
    for name, overrides in cases.items():
        words = [f"experiment={experiment}", f"name={experiment}_{name}", *overrides]
        records[name] = run_into(out / name, run_settings(words), overrides=words).checked()
    return records


def deviations(log: Log, place: Floats, name: str) -> Chart:
    """Return the deviation from a place, or from a course, axis by axis over time.

    Args:
        log: of the flight.
        place: wanted, shape (3,) or (rows, 3) [m].
        name: of the case.
    """
    away = 1e3 * (log.channel("position") - place)
    series = tuple(Series(name=axis, x=log.time, y=away[:, k]) for k, axis in enumerate(AXES))
    return Chart(
        title=f"Deviation, {name.replace('_', ' ')}", y_label="deviation [mm]", series=series
    )


def forces(ledger: Ledger, component: int, title: str) -> Chart:
    """Return the force of every effect along one axis of the base, one curve per effect.

    Args:
        ledger: of the flight.
        component: 0 to 5, force x, y, z, torque x, y, z; link axes.
        title: of the chart.
    """
    table = ledger.wrenches[:, :, 0, component]
    shown = tuple(
        Series(name=effect, x=ledger.time, y=table[:, k])
        for k, effect in enumerate(ledger.effects)
        if np.any(table[:, k] != 0.0)
    )
    unit = "force [N]" if component < 3 else "torque [N m]"
    return Chart(title=title, y_label=unit, series=shown)
