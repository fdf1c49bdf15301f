"""Search over several runs: forward steps, pairs, and backward elimination."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from seals.sysid.least_squares.batched import Tell
from seals.sysid.predictors.batch import Experiment
from seals.sysid.scores.cross_validation import CrossValidator, Hypothesis, ranked

PAIRED = 5
"""Effects of the first round that are tried two by two."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """Hypotheses tried by a search.

    Args:
        validator: fits and scores.
        nominal: the model as it is.
        best: the chosen model.
        rounds: hypotheses of every round, best first.
    """

    validator: CrossValidator
    nominal: Hypothesis
    best: Hypothesis
    rounds: tuple[tuple[Hypothesis, ...], ...] = field(default=())

    @property
    def tried(self) -> list[Hypothesis]:
        """All hypotheses, each once, best first."""
        every = {frozenset(h.candidates): h for r in self.rounds for h in r}
        return ranked(list(every.values()))


def search(experiment: Experiment, *, tell: Tell | None = None) -> Search:
    """Find the effects that lower the error on held-out runs by more than their price.

    Args:
        experiment: runs and model.
        tell: takes the number of hypotheses that are done.
    """
    iterations = experiment.settings.compare.iterations
    validator = CrossValidator(experiment, iterations=iterations, tell=tell)
    nominal = validator.nominal
    singles = ranked(validator.fitted([((c,), None) for c in experiment.candidate_set.candidates]))
    rounds = [tuple(singles)]
    best = _better(validator, nominal, singles)
    while best.candidates and len(best.candidates) < experiment.settings.naming.most:
        following = _extended(validator, best, singles)
        rounds.append(tuple(following))
        further = _better(validator, best, following)
        if further is best:
            break
        best = further
    pairs = _pairs(validator, best, singles)
    rounds.append(tuple(pairs))
    best = _better(validator, best, pairs)
    if len(best.candidates) > 1:
        fewer = _dropped(validator, best)
        rounds.append(tuple(fewer))
        # a smaller model that is not surely worse is the better one
        spare = [h for h in fewer if not validator.margin(best, h).significant]
        best = ranked(spare)[0] if spare else best
    return Search(
        validator=validator,
        nominal=nominal,
        best=best,
        rounds=tuple(r for r in rounds if r),
    )


def expected(experiment: Experiment) -> int:
    """Return about how many hypotheses a search and its answer will fit."""
    several = len(experiment.candidate_set.candidates)
    pairs = PAIRED * (PAIRED - 1) // 2
    # singles, a second one beside the best, rivals of every claim, pairs, and the nominal model
    return 1 + 4 * several + min(pairs, several * (several - 1) // 2)


def _better(
    validator: CrossValidator, base: Hypothesis, others: Sequence[Hypothesis]
) -> Hypothesis:
    """Return the best of the others that is significantly better than the base, else the base."""
    for other in ranked(others):
        if validator.margin(other, base).significant:
            return other
    return base


def _extended(
    validator: CrossValidator, best: Hypothesis, singles: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Extend the best model by one more effect."""
    sets = []
    for single in singles:
        c = single.candidates[0]
        if not set(c.keys) & {k for b in best.candidates for k in b.keys}:
            sets.append(((*best.candidates, c), best.fit.values))
    return ranked(validator.fitted(sets)) if sets else []


def _pairs(
    validator: CrossValidator, best: Hypothesis, singles: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Try the likeliest effects in pairs: a pair may lower the error where each alone raises it."""
    top = [s.candidates[0] for s in singles[:PAIRED]]
    known = set(best.candidates)
    pairs = [(a, b) for i, a in enumerate(top) for b in top[i + 1 :] if {a, b} != known]
    return ranked(validator.fitted([(pair, None) for pair in pairs])) if pairs else []


def _dropped(validator: CrossValidator, best: Hypothesis) -> list[Hypothesis]:
    """Remove each of the effects from the best model in turn."""
    sets = []
    for i, candidate in enumerate(best.candidates):
        rest = best.candidates[:i] + best.candidates[i + 1 :]
        values = best.fit.values.copy()
        for key in candidate.keys:
            values[validator.index[key]] = validator.experiment.parameter(
                validator.index[key]
            ).nominal
        sets.append((rest, values))
    return validator.fitted(sets)
