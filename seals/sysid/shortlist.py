"""Rough fits first: only those among which the best will be are finished."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from seals.sysid.factors import Candidate
from seals.sysid.fit import Fitter
from seals.sysid.hypothesis import Hypothesis, keys_of, scored
from seals.sysid.linearise import DELAY
from seals.sysid.normal import Fit
from seals.sysid.parallel import spread
from seals.sysid.problem import rewindowed

Job: TypeAlias = tuple[tuple[Candidate, ...], Mapping[str, float]]


def fitted(
    fitter: Fitter,
    jobs: Sequence[Job],
    nominal: Hypothesis,
    best: Hypothesis,
    *,
    processes: int,
) -> list[Hypothesis]:
    """Fit several models from values at hand; those far behind the best one are left rough.

    Windows that follow late sensors would lend their delay to a model without one: such a model is
    fitted in windows that follow none.
    """
    lends = bool(fitter.windows.delay) and any(DELAY not in keys_of(job[0]) for job in jobs)
    plain = rewindowed(fitter, delay=0.0) if lends else fitter

    def seen_by(candidates: Sequence[Candidate]) -> Fitter:
        return fitter if DELAY in keys_of(candidates) else plain

    def work(job: Job) -> Fit:
        keys = keys_of(job[0])
        return seen_by(job[0]).fit(keys, start={k: job[1][k] for k in keys}, rough=True)

    fits = spread(work, jobs, processes)
    tried = [
        scored(job[0], fit, seen_by(job[0]), nominal) for job, fit in zip(jobs, fits, strict=True)
    ]
    return refined(tried, nominal, nominal, top=best.score, processes=processes)


def refined(
    tried: Sequence[Hypothesis],
    nominal: Hypothesis,
    base: Hypothesis,
    *,
    top: float = 0.0,
    always: int = 0,
    processes: int,
) -> list[Hypothesis]:
    """Finish the rough fits among which the best will be.

    Args:
        tried: roughly fitted.
        nominal: model against which they are scored.
        base: best model without them.
        top: best score so far.
        always: how many are finished in any case.
        processes: that share the fits.
    """
    ranked = sorted((h.score for h in tried), reverse=True)
    least = hopeful(max([top, *ranked[:1]]), base)
    least = min([least, *ranked[:always][-1:]])
    near = [i for i, h in enumerate(tried) if h.score >= least]
    fits = spread(lambda i: tried[i].fitter.refined(tried[i].fit), near, processes)
    out = list(tried)
    for i, fit in zip(near, fits, strict=True):
        out[i] = scored(tried[i].candidates, fit, tried[i].fitter, nominal)
    return out


def hopeful(top: float, base: Hypothesis) -> float:
    """Score of a rough fit from which on it may still become the best."""
    policy = base.fitter.library.policy
    return top - policy.behind - policy.behind_share * max(top - base.score, 0.0)
