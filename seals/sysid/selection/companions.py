"""Small effects that come along with a found one: fitted beside it, not named.

A drag that acts spread along a body brakes its rotation, too: a law of the force alone leaves that
over. It is too small to be an effect of its own, and large enough to look like an unknown force.
"""

from __future__ import annotations

from collections.abc import Callable

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.scores.disturbance_level import disturbance_level
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant
from seals.sysid.selection.shortlist import Job, fitted


def comes_with(candidate: Candidate, others: tuple[Candidate, ...]) -> bool:
    """Return true if one of the others declares an effect as its companion, in the same medium."""
    return any(
        candidate.name in c.identification.companions and c.variant == candidate.variant
        for c in others
    )


def unnamed_companions(best: EvidenceHypothesis) -> list[int]:
    """Return the places among a model's candidates of companions too small to be named."""
    candidate_set = best.fitter.candidate_set
    return [
        i
        for i, c in enumerate(best.candidates)
        if comes_with(c, best.candidates) and not is_significant(c, best.fit, candidate_set)
    ]


def counts(candidate: Candidate, model: EvidenceHypothesis) -> bool:
    """Return true if one of a model's effects is large enough for it, as a companion always is."""
    significant = is_significant(candidate, model.fit, model.fitter.candidate_set)
    return significant or comes_with(candidate, model.candidates)


def with_companion(
    nominal: EvidenceHypothesis,
    best: EvidenceHypothesis,
    required: Callable[[EvidenceHypothesis, Candidate], float],
    *,
    processes: int = 1,
) -> EvidenceHypothesis:
    """Add the companion of a found effect where, without it, the model would be refused.

    Args:
        nominal: model without any candidate.
        best: model with the found effects.
        required: evidence that an effect must bring to be added to a model.
        processes: that share the fits.

    Returns:
        The model with the companion where that pays; else ``best``.
    """
    there, candidate_set = {c.label for c in best.candidates}, best.fitter.candidate_set
    found = [c for c in candidate_set.candidates if c.label not in there]
    found = [c for c in found if comes_with(c, best.candidates)]
    if not found or disturbance_level(best).between <= candidate_set.policy.disturbance_refused:
        return best
    given = {k: best.fit.values[k] for k in best.fit.free}
    jobs: list[Job] = [
        ((*best.candidates, c), given | dict.fromkeys(c.all_keys, 0.0)) for c in found
    ]
    tried = fitted(best.fitter, jobs, nominal, best, processes=processes)
    more = max(tried, key=lambda h: h.score)
    pays = more.score - best.score >= required(best, more.candidates[-1])
    return more if pays else best
