"""Repeated runs of one experiment under different seeds: resumable, in one table."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.logs.atomic import atomic_path

COLUMNS = ("seed", "success", "reason", "tries", "seconds", "code")
"""Columns every table has; measures of the experiment stand behind them."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How one run ended.

    Args:
        success: whether the task was done.
        reason: why not, a few words; empty for a success.
        tries: attempts the robot made.
        seconds: simulated time [s].
        measures: further numbers by name, unit in the name.
    """

    success: bool
    reason: str = ""
    tries: int = 1
    seconds: float = 0.0
    measures: Mapping[str, float] | None = None


def run_trials(
    path: Path,
    seeds: Sequence[int],
    overrides: Callable[[int], list[str]],
    one: Callable[..., Outcome],
) -> list[dict[str, str]]:
    """Run the seeds that the table does not hold yet, and return its rows.

    A row counts when its overrides are those of today: ``code`` is their checksum.

    Args:
        path: the table, a CSV file; written anew after every run.
        seeds: to be run.
        overrides: of a seed.
        one: runs one seed, given its overrides.
    """
    rows = {row["seed"]: row for row in read_rows(path)}
    for seed in seeds:
        words = overrides(seed)
        code = hashlib.sha256("\n".join(words).encode()).hexdigest()[:12]
        kept = rows.get(str(seed))
        if kept is not None and kept["code"] == code:
            continue
        outcome = one(words)
        row: dict[str, Any] = {
            "seed": seed,
            "success": int(outcome.success),
            "reason": outcome.reason,
            "tries": outcome.tries,
            "seconds": f"{outcome.seconds:.2f}",
            "code": code,
        }
        row |= {key: f"{value:.5g}" for key, value in (outcome.measures or {}).items()}
        rows[str(seed)] = {key: str(value) for key, value in row.items()}
        write_rows(path, [rows[key] for key in sorted(rows, key=int)])
        print(_line_of(rows[str(seed)]), flush=True)
    return [rows[str(seed)] for seed in seeds]


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table; none when it does not exist."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [dict(row) for row in csv.DictReader(file)]


def write_rows(path: Path, rows: Sequence[Mapping[str, str]]) -> None:
    """Write a table whole or not at all."""
    names = list(dict.fromkeys([*COLUMNS, *(key for row in rows for key in row)]))
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as beside, Path(beside).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names, restval="")
        writer.writeheader()
        writer.writerows(rows)


def _line_of(row: Mapping[str, str]) -> str:
    """Return one row as a line for the terminal."""
    word = "done" if row["success"] == "1" else f"failed: {row['reason']}"
    return f"seed {row['seed']:>3}: {word} ({row['seconds']} s, tries {row['tries']})"


def summary(rows: Sequence[Mapping[str, str]]) -> str:
    """Return how many of the runs succeeded.

    Example:
        >>> summary([{"success": "1"}, {"success": "0"}])
        '1 of 2 succeeded'
    """
    good = sum(1 for row in rows if row["success"] == "1")
    return f"{good} of {len(rows)} succeeded"
