"""Results of all seeds: a table and the learning curves."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals.learn.comparison.words import text_table
from seals.learn.evaluation.result import QUANTILES, SHARE
from seals.learn.statistics.interval import wilson
from seals.logs.atomic import write_json, write_table
from seals.report import Chart, Series, write_picture

MEDIANS = {"reached_after": "time to target [s]", "cost_of_transport": "cost of transport"}
"""Facts of which the median is told, where a task tells them, over the episodes that succeeded."""


class Outcome(NamedTuple):
    """Figures of the seeds.

    Args:
        rows: one for each policy that was judged: name, shares, and the wall time of its training.
        curves: steps and shares of successes of every training, on its validation starts.
    """

    rows: list[dict[str, Any]]
    curves: list[tuple[str, np.ndarray, np.ndarray]]


def outcome(folders: Sequence[Path]) -> Outcome:
    """Read the results of trainings and evaluations.

    Args:
        folders: of the trainings.
    """
    rows: list[dict[str, Any]] = []
    curves = []
    for folder in folders:
        with (folder / "evaluation.csv").open(encoding="utf-8", newline="") as file:
            looks = list(csv.DictReader(file))
        steps = np.array([float(look["step"]) for look in looks])
        success = np.array([float(look["success"]) for look in looks])
        curves.append((f"seed {folder.name}", steps, success))
        judged = json.loads((folder / "held_out" / "evaluation.json").read_text())["judgements"]
        for number, each in enumerate(judged):
            trained = number == 0
            rows.append(
                {
                    "policy": f"seed {folder.name}" if trained else each["policy"],
                    "episodes": each["episodes"],
                    **{name: share[0] for name, share in each["shares"].items()},
                    **{name: _median(each, name) for name in MEDIANS},
                    "steps": int(steps[-1]) if trained else 0,
                    "seconds": float(looks[-1]["seconds"]) if trained else 0.0,
                }
            )
    return Outcome(rows, curves)


def tell(found: Outcome, out: Path, *, enough: float) -> None:
    """Print the table, and write it with the curves into the folder of the study.

    Args:
        found: figures of the seeds.
        out: the folder.
        enough: share of its held-out starts that a seed is asked for [1].
    """
    shares = [name for name in found.rows[0] if name.startswith(SHARE)]
    medians = [name for name in MEDIANS if np.isfinite([r[name] for r in found.rows]).any()]
    head = ["policy", *shares, *(MEDIANS[name] for name in medians), "training [s]"]
    table = []
    for row in found.rows:
        cells = [wilson(round(row[name] * row["episodes"]), row["episodes"]) for name in shares]
        told = [f"{row[name]:.2f}" if np.isfinite(row[name]) else "" for name in medians]
        time = f"{row['seconds']:.0f}" if row["steps"] else ""
        table.append([row["policy"], *(cell.text() for cell in cells), *told, time])
    print(text_table(head, table))
    seeds = [row for row in found.rows if row["policy"].startswith("seed ")]
    good = sum(row["success"] >= enough for row in seeds)
    print(f"{good} of {len(seeds)} seeds reach {enough:.0%} of their held-out starts.")
    columns = {name: [row[name] for row in found.rows] for name in found.rows[0]}
    write_table(out / "seeds.csv", columns)
    rows = [{name: _plain(value) for name, value in row.items()} for row in found.rows]
    write_json(out / "seeds.json", {"rows": rows, "enough": enough, "good": good})
    chart = Chart(
        title="Success on validation starts",
        x_label="control steps",
        y_label="share of episodes",
        series=tuple(Series(name=name, x=steps, y=share) for name, steps, share in found.curves),
    )
    print(write_picture(out / "seeds.png", chart))


def _median(judged: dict[str, Any], name: str) -> float:
    """Return the median of a fact, NaN where no episode told it."""
    found = judged["quantiles"].get(name, [None] * len(QUANTILES))[QUANTILES.index(0.5)]
    return math.nan if found is None else float(found)


def _plain(value: Any) -> Any:
    """Return a value as JSON has it: what is unknown is None."""
    return None if isinstance(value, float) and math.isnan(value) else value
