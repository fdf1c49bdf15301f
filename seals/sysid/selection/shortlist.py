"""Two-stage fits: coarse fits of all models, full fits of those that may be best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.parallel import spread
from seals.sysid.predictors.linear_screen import candidate_keys
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import rewindowed
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, scored

Job: TypeAlias = tuple[tuple[Candidate, ...], Mapping[str, float]]


def fitted(
    fitter: Fitter,
    jobs: Sequence[Job],
    nominal: EvidenceHypothesis,
    best: EvidenceHypothesis,
    *,
    processes: int,
) -> list[EvidenceHypothesis]:
    """Fit several models from given values; only those near the best are fitted fully.

    Windows that follow late sensors would lend their delay to a model without one: such a model is
    fitted in windows that follow none.
    """
    late = fitter.candidate_set.sensor_delay
    lends = bool(fitter.windows.delay) and any(late not in candidate_keys(job[0]) for job in jobs)
    plain = rewindowed(fitter, delay=0.0) if lends else fitter

    def windowed(candidates: Sequence[Candidate]) -> Fitter:
        return fitter if late in candidate_keys(candidates) else plain

    def seen_by(candidates: Sequence[Candidate]) -> Fitter:
        return windowed(candidates).acting(candidates)

    def work(job: Job) -> Fit:
        keys = candidate_keys(job[0])
        return seen_by(job[0]).fit(keys, start={k: job[1][k] for k in keys}, coarse=True)

    for job in jobs:
        windowed(job[0]).prepare()
    fits = spread(work, jobs, processes)
    tried = [
        scored(job[0], fit, seen_by(job[0]), nominal) for job, fit in zip(jobs, fits, strict=True)
    ]
    return refined(tried, nominal, nominal, top=best.score, processes=processes)


def refined(
    tried: Sequence[EvidenceHypothesis],
    nominal: EvidenceHypothesis,
    base: EvidenceHypothesis,
    *,
    top: float = 0.0,
    always: int = 0,
    processes: int,
) -> list[EvidenceHypothesis]:
    """Complete the coarse fits that may be best.

    Args:
        tried: coarsely fitted.
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


def better_known(
    found: EvidenceHypothesis, known: Sequence[EvidenceHypothesis]
) -> EvidenceHypothesis:
    """Return a fit, or a better known one of the same effects.

    Linear about a larger model, a fit may be worse than it was about its own values.

    Args:
        found: fit.
        known: fits of any effects.
    """
    same = (h for h in known if h.candidates == found.candidates)
    return max((found, *same), key=lambda h: h.score)


def hopeful(top: float, base: EvidenceHypothesis) -> float:
    """Return the lowest score of a coarse fit that may still become the best."""
    policy = base.fitter.candidate_set.policy
    return top - policy.behind - policy.behind_share * max(top - base.score, 0.0)
