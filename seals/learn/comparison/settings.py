"""Typed settings of a comparison of training runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.field_roles import roles
from seals.learn.statistics.interval import LEVEL, RESAMPLES
from seals.schema import setting


@roles(data="value over reference hold")
@dataclass(kw_only=True)
class AnalysisPlan:
    """Analysis plan of a comparison, declared before the runs are made.

    Args:
        value: column that is scored.
        over: column of the budget.
        budget: end of the comparison, in the unit of ``over``; 0 for the end of the shortest run.
        reference: arm against which the others are held; the first one when left out.
        hold: whether a run that stopped early keeps its last value until the budget.
        level: of all intervals.
        resamples: of the bootstrap.
        seed: of the bootstrap.
    """

    value: str = "success"
    over: str = "step"
    budget: float = setting(0.0, "1", bounds=(0.0, 1e12), source="chosen")
    reference: str | None = None
    hold: bool = False
    level: float = setting(LEVEL, "1", bounds=(0.5, 0.999), source="usual")
    resamples: int = RESAMPLES
    seed: int = 0


@roles(data="name title", read="arms study", write="out")
@dataclass(kw_only=True)
class ArmsSettings(AnalysisPlan):
    """Settings of a comparison: an analysis plan, and the runs.

    Args:
        name: of the comparison, part of the run folder's name.
        title: of the page.
        arms: a pattern of run folders, or a list of patterns, by the arm's name.
        study: a folder with one folder an arm, each with one folder a run.
        out: folder of the results, or None for the run's folder.
    """

    name: str = "comparison"
    title: str = "Arms of a study"
    arms: dict[str, Any] = field(default_factory=dict)
    study: str | None = None
    out: str | None = None
