"""Base of predictors of independent samples, without a simulated trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.batch import TwinState
from seals.compare.case import Case, Regime, Start
from seals.compare.cases import matching
from seals.compare.predict import Job, Predictor
from seals.compare.settings import CompareSettings


def bare_case(
    name: str,
    time: Floats,
    measured: Mapping[str, Floats],
    sigma: Mapping[str, Floats],
    **more: Any,
) -> Case:
    """Return a case that needs no start state."""
    start = Start(
        state=TwinState.at_rest(1, 0, np.zeros(1)),
        sigma=np.zeros(12),
        source="none needed: every sample is independent",
    )
    return Case(
        name=name,
        held_out=bool(more.pop("held_out", False)),
        time=time - time[0],
        clock=float(time[0]),
        measured=measured,
        sigma=sigma,
        regime=np.full(time.shape, int(more.pop("regime", Regime.water)), dtype=np.int64),
        start=start,
        **more,
    )


def divided(cases: Sequence[Case], settings: CompareSettings) -> list[Case]:
    """Mark cases named by ``held_out``, and drop those that ``train`` does not name.

    Raises:
        ConfigError: a pattern matches no stretch, or there is no stretch.
    """
    names = [c.name for c in cases]
    train, held_out = (
        matching(k, getattr(settings, k), names, what="stretch") for k in ("train", "held_out")
    )
    marked = [replace(c, held_out=c.name in held_out) for c in cases]
    return [c for c in marked if c.held_out or not settings.train or c.name in train]


class SampledPredictor(Predictor):
    """Predictor of independent samples, one batch row per sample."""

    def rows_of(self, jobs: Sequence[Job]) -> list[slice]:
        """Rows of every job in the batch."""
        ends = np.cumsum([0, *(len(self.cases[j.case].time) for j in jobs)])
        return [slice(int(a), int(b)) for a, b in pairwise(ends)]

    def value(self, key: str, job: Job, default: float) -> float:
        """Return a job's value of one parameter, or the default where it is not fitted."""
        for p, known in enumerate(self.keys):
            if key in known.targets:
                return float(job.values[p])
        return default
