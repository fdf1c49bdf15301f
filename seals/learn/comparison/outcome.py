"""Results of a comparison of arms of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seals.arrays import Floats
from seals.learn.comparison.runs import Run
from seals.learn.comparison.settings import AnalysisPlan
from seals.learn.statistics.interval import Interval


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Interquartile mean of an arm's learning curves, with interval.

    Args:
        x: shape (points,).
        line: interquartile mean of the runs, shape (points,).
        low: lower limit at each point.
        high: upper limit at each point.
        runs: each run's curve, shape (runs, points).
    """

    x: Floats
    line: Floats
    low: Floats
    high: Floats
    runs: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Arm:
    """Results of one arm: runs, scores with intervals, learning curves.

    Args:
        name: of the arm.
        runs: that belong to it.
        scores: of each run by metric, each of shape (runs,).
        middle: interquartile mean of the scores by metric.
        band: its curves over the budget.
        clock: its curves over seconds, or None where the runs did not say.
    """

    name: str
    runs: Sequence[Run]
    scores: Mapping[str, Floats]
    middle: Mapping[str, Interval]
    band: Band
    clock: Band | None

    def to_dict(self) -> dict[str, Any]:
        """Return runs with their scores, interval of the mean, and curves, as plain data."""
        bands = {"over_budget": self.band, "over_seconds": self.clock}
        return {
            "runs": [
                {
                    "folder": run.folder,
                    "seed": run.seed,
                    "state": run.state,
                    **{key: float(values[k]) for key, values in self.scores.items()},
                }
                for k, run in enumerate(self.runs)
            ],
            "iqm": {key: list(value) for key, value in self.middle.items()},
            "curves": {
                key: {n: getattr(band, n) for n in ("x", "line", "low", "high")}
                for key, band in bands.items()
                if band is not None
            },
        }


@dataclass(frozen=True, kw_only=True)
class ArmComparison:
    """Comparison of two arms in one metric.

    Args:
        arm: in question.
        against: the reference.
        metric: by name.
        improvement: probability that a run of the arm scores higher; claims go by this.
        bootstrap: the same with the interval that published tables use.
        p: exact two-sided p of the rank-sum test.
        pairs: share of paired seeds in which the arm is above, or None without pairs.
    """

    arm: str
    against: str
    metric: str
    improvement: Interval
    bootstrap: Interval
    p: float
    pairs: Interval | None

    @property
    def verdict(self) -> str:
        """Return ``better``, ``worse`` or ``open``, as the interval allows."""
        if self.improvement.low > 0.5:
            return "better"
        return "worse" if self.improvement.high < 0.5 else "open"


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """Arms, their comparisons, and the analysis plan.

    Args:
        terms: with budget and reference filled in.
        arms: in the order given.
        duels: of every arm with the reference, in every metric.
        remarks: what a reader must know before believing the table.
    """

    terms: AnalysisPlan
    arms: Sequence[Arm]
    duels: Sequence[ArmComparison]
    remarks: Sequence[str]

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {
            "terms": vars(self.terms),
            "remarks": list(self.remarks),
            "arms": {a.name: a.to_dict() for a in self.arms},
            "duels": [
                {
                    **{
                        key: getattr(d, key) for key in ("arm", "against", "metric", "p", "verdict")
                    },
                    "improvement": list(d.improvement),
                    "bootstrap": list(d.bootstrap),
                    "pairs": None if d.pairs is None else list(d.pairs),
                }
                for d in self.duels
            ],
        }
