"""Export of the best policy of a recipe: weights and metadata."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.learn.evaluation.page import QUANTILES
from seals.learn.metadata import CARD, refuse_other
from seals.learn.policy import FORM, WEIGHTS, read_policy_metadata
from seals.logs.atomic import atomic_folder, write_json

LOOKED = ("step", "seconds", "success", "return")
"""Columns of the curve that the metadata keeps."""


def ship(folders: Sequence[Path], target: Path, *, command: str) -> Path:
    """Copy the best policy of some trainings into a folder, replacing an earlier one.

    The best is the one of the best last look at its validation starts; held-out starts judge it
    and do not choose.

    Args:
        folders: of trainings that are done and judged.
        target: folder to be made, ``policies/NAME`` of a robot.
        command: that made the trainings.

    Raises:
        ConfigError: one of them has no curve, judgement or policy, or the target holds none.
    """
    refuse_other(target, form=FORM, key="policy")
    best = max(folders, key=lambda folder: _last(_curve_of(folder)))
    metadata = read_policy_metadata(best / "policy")
    with atomic_folder(target, replace=True) as beside:
        (beside / WEIGHTS).write_bytes((best / "policy" / WEIGHTS).read_bytes())
        told = {"command": command, "chosen_of": len(folders), "curve": _curve_of(best)}
        write_json(beside / CARD, {**metadata, **told, "held_out": _judged_of(best)})
    return target


def _present(path: Path) -> Path:
    if not path.is_file():
        raise ConfigError(f"{path} is missing.\nRun the complete recipe first.")
    return path


def _curve_of(folder: Path) -> list[dict[str, float]]:
    """Return the scores of a training at its validation starts, over its steps.

    Raises:
        ConfigError: there are none.
    """
    with _present(folder / "evaluation.csv").open(encoding="utf-8", newline="") as file:
        return [{name: float(row[name]) for name in LOOKED} for row in csv.DictReader(file)]


def _judged_of(folder: Path) -> dict[str, Any]:
    """Return the scores of the policy of a training from its held-out starts.

    Raises:
        ConfigError: it was not judged.
    """
    path = _present(folder / "held_out" / "evaluation.json")
    own = json.loads(path.read_text(encoding="utf-8"))["judgements"][0]
    share, low, high = own["shares"]["success"][:3]
    middle = QUANTILES.index(0.5)
    medians = {name: values[middle] for name, values in own["quantiles"].items()}
    return {
        "episodes": own["episodes"],
        "success": share,
        "interval": [low, high],
        "medians": {name: medians[name] for name in ("reached_after", "cost_of_transport")
                    if name in medians},
    }  # fmt: skip


def _last(curve: Sequence[dict[str, float]]) -> tuple[float, float]:
    return curve[-1]["success"], curve[-1]["return"]
