"""Typed settings of a comparison of training runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.schema import setting


@dataclass(kw_only=True)
class ArmsSettings:
    """Settings of a comparison: runs, and the analysis plan, declared before the runs.

    Args:
        name: of the comparison, part of the run folder's name.
        title: of the page.
        arms: a pattern of run folders, or a list of patterns, by the arm's name.
        study: a folder with one folder an arm, each with one folder a run.
        value: column that is scored.
        over: column of the budget.
        budget: end of the comparison, in the unit of ``over``; 0 for the end of the shortest run.
        reference: arm against which the others are held; the first one when left out.
        hold: whether a run that stopped early keeps its last value until the budget.
        level: of all intervals.
        resamples: of the bootstrap.
        seed: of the bootstrap.
        out: folder of the results, or None for the run's folder.
    """

    name: str = "comparison"
    title: str = "Arms of a study"
    arms: dict[str, Any] = field(default_factory=dict)
    study: str | None = None
    value: str = "success"
    over: str = "step"
    budget: float = setting(0.0, "1", bounds=(0.0, 1e12), source="chosen")
    reference: str | None = None
    hold: bool = False
    level: float = setting(0.95, "1", bounds=(0.5, 0.999), source="usual")
    resamples: int = 10_000
    seed: int = 0
    out: str | None = None
