"""Base of predictors of independent samples, without a simulated trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from seals.arrays import Array, Floats
from seals.batch import BatchDynamics
from seals.compare.case import Case, Start
from seals.compare.predict import Job, Predictor
from seals.compare.regimes import Regime
from seals.compare.settings import CompareSettings
from seals.errors import ConfigError, suggestion


def bare_case(
    name: str,
    time: Floats,
    measured: Mapping[str, Floats],
    sigma: Mapping[str, Floats],
    **more: Any,
) -> Case:
    """Return a case that needs no start state."""
    still = np.zeros(3)
    start = Start(
        position=still,
        quaternion=np.array([0.0, 0.0, 0.0, 1.0]),
        velocity=still,
        angular_velocity=still,
        joints=np.zeros(0),
        joint_velocity=np.zeros(0),
        sigma=np.zeros(12),
        source="none needed: every sample stands for itself",
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
    import fnmatch
    from dataclasses import replace

    names = [c.name for c in cases]
    for key in ("train", "held_out"):
        for pattern in map(str, getattr(settings, key)):
            if not fnmatch.filter(names, pattern):
                raise ConfigError(
                    f"{key}: no stretch is called '{pattern}'.\n"
                    f"{suggestion(pattern, names, label='Present')}"
                )

    def named(case: Case, key: str) -> bool:
        return any(fnmatch.fnmatch(case.name, str(p)) for p in getattr(settings, key))

    marked = [replace(c, held_out=named(c, "held_out")) for c in cases]
    return [c for c in marked if c.held_out or not settings.train or named(c, "train")]


class SampledPredictor(Predictor):
    """Predictor of independent samples, one batch row per sample."""

    def rows_of(self, jobs: Sequence[Job]) -> list[slice]:
        """Rows of every job in the batch."""
        ends = np.cumsum([0, *(len(self.cases[j.case].time) for j in jobs)])
        return [slice(int(a), int(b)) for a, b in pairwise(ends)]

    def twin_of(
        self, jobs: Sequence[Job], counts: Sequence[int], *, more: Mapping[str, Any], waves: Any
    ) -> BatchDynamics:
        """Return batch dynamics with ``counts`` rows per job; ``more`` adds to the keys' values."""
        values: dict[str, Array] = {}
        for p, key in enumerate(self.keys):
            column = np.repeat([j.values[p] for j in jobs], counts)
            values.update(dict.fromkeys(key.targets, column))
        for name, extra in more.items():
            values[name] = values.get(name, 0.0) + extra
        return BatchDynamics(
            self.robot,
            self.effects,
            self.settings.environment,
            waves,
            batch=int(np.sum(counts)),
            values=values,
        )

    def value(self, key: str, job: Job, default: float) -> float:
        """Return a job's value of one parameter, or the default where it is not fitted."""
        for p, known in enumerate(self.keys):
            if key in known.targets:
                return float(job.values[p])
        return default


__all__ = ["SampledPredictor", "bare_case", "divided"]
