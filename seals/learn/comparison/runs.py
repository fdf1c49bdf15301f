"""Reading of the training runs of a study, sorted into arms."""

from __future__ import annotations

import csv
import glob
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, LogError, refuse_unlisted
from seals.learn.statistics.curve import Curve, curve
from seals.untrusted_io import read_bytes, read_json

EVALUATION = "evaluation.csv"
FACTS = "run.json"
_MOST_BYTES = 100_000_000
"""Of one table."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """One training run of an arm.

    Args:
        arm: that it belongs to.
        folder: that it wrote.
        seed: of the run; None where it did not say.
        columns: of its evaluations by name, each of shape (evaluations,).
        state: how it ended, as it said; empty where it did not.
    """

    arm: str
    folder: Path
    seed: int | None
    columns: Mapping[str, Floats]
    state: str = ""

    @property
    def name(self) -> str:
        """Arm and seed, or folder."""
        return f"{self.arm}, seed {self.seed}" if self.seed is not None else str(self.folder)

    def curve(self, value: str, *, over: str) -> Curve:
        """Return one column of the table as a curve over another.

        Raises:
            LogError: a column is missing.
            SealsError: they make no curve.
        """
        for name in (over, value):
            refuse_unlisted(
                name,
                self.columns,
                f"{self.folder / EVALUATION} has no column '{name}'",
                error=LogError,
            )
        return curve(self.columns[over], self.columns[value])


def find_arms(arms: Mapping[str, Any], study: str | None) -> dict[str, list[Path]]:
    """Return the run folders of every arm.

    Args:
        arms: a pattern of folders, or a list of patterns, by the arm's name.
        study: a folder with one folder an arm, each with one folder a run; None for none.

    Raises:
        ConfigError: nothing is given, or an arm has no run.
    """
    found: dict[str, list[Path]] = {}
    if study is not None:
        found |= _study(Path(study))
    for name, given in arms.items():
        patterns = [given] if isinstance(given, str) else list(given)
        found[str(name)] = _matching(str(name), [str(p) for p in patterns])
    if not found:
        raise ConfigError(
            "there is nothing to compare.\n"
            "Write: seals evaluate --compare sac='runs/study/sac/*' sacfd='runs/study/sacfd/*'"
        )
    return found


def _study(place: Path) -> dict[str, list[Path]]:
    if not place.is_dir():
        raise ConfigError(f"study={place}: there is no such folder.\nGive the folder of a study.")
    inside = sorted(path.parent for path in place.glob(f"*/*/{EVALUATION}"))
    if not inside:
        raise ConfigError(f"study={place} holds no run.\nAllowed: {place}/ARM/SEED/{EVALUATION}")
    arms: dict[str, list[Path]] = {}
    for run in inside:
        arms.setdefault(run.parent.name, []).append(run)
    return {name: sorted(runs, key=_natural) for name, runs in arms.items()}


def _matching(name: str, patterns: Sequence[str]) -> list[Path]:
    places = {Path(hit) for pattern in patterns for hit in glob.glob(pattern)}
    runs = [p.parent if p.name == EVALUATION else p for p in places]
    kept = sorted({p for p in runs if (p / EVALUATION).is_file()}, key=_natural)
    if not kept:
        raise ConfigError(
            f"arm '{name}': no folder of {', '.join(patterns)} holds {EVALUATION}.\n"
            f"Give run folders of seals train, for instance {name}='runs/study/{name}/*'"
        )
    return kept


def _natural(path: Path) -> list[Any]:
    """Sorts run 2 before run 10."""
    return [(0, int(p), "") if p.isdigit() else (1, 0, p) for p in re.split(r"(\d+)", str(path))]


def read_run(folder: Path, *, arm: str) -> Run:
    """Read the table and the metadata of a run.

    Args:
        folder: of the run.
        arm: that it belongs to.

    Raises:
        LogError: the table is missing, broken, or empty.
    """
    path = folder / FACTS
    if not os.path.lexists(path):
        facts = {}
    else:
        found = read_json(path)
        facts = found if isinstance(found, dict) else {}
    seed = facts.get("seed")
    return Run(
        arm=arm,
        folder=folder,
        seed=seed if isinstance(seed, int) and not isinstance(seed, bool) else None,
        columns=read_table(folder / EVALUATION),
        state=str(facts.get("state", "")),
    )


def read_table(path: Path) -> dict[str, Floats]:
    """Read a table of numbers with a header; an incomplete last line is left out.

    Args:
        path: of a CSV file.

    Raises:
        LogError: it is missing, too large, empty, or contains values that are not numbers.
    """
    if not path.is_file():
        raise LogError(f"{path} is missing.\nGive the folder of a run.")
    text = read_bytes(path, most=_MOST_BYTES).decode("utf-8", "replace")
    try:
        rows = list(csv.reader(text.splitlines()))
    except csv.Error as cause:
        raise LogError(f"{path} is not a table: {cause}.\nGive the folder of a run.") from cause
    # a run that was killed may have left half a line
    if rows and not text.endswith("\n"):
        rows.pop()
    if len(rows) < 2 or len(set(rows[0])) != len(rows[0]):
        raise LogError(
            f"{path} holds {max(len(rows) - 1, 0)} rows.\n"
            "Allowed: a header with different names, and at least one row"
        )
    head, body = rows[0], rows[1:]
    for number, row in enumerate(body, start=2):
        if len(row) != len(head):
            raise LogError(f"{path}, line {number} has {len(row)} cells.\nAllowed: {len(head)}")
    columns = zip(head, zip(*body, strict=True), strict=True)
    return {name.strip(): _numbers(path, name, cells) for name, cells in columns}


def _numbers(path: Path, name: str, cells: Sequence[str]) -> Floats:
    try:
        return np.array([float(cell) if cell.strip() else np.nan for cell in cells])
    except ValueError as cause:
        raise LogError(f"{path}, column '{name}': {cause}.\nAllowed: numbers") from cause
