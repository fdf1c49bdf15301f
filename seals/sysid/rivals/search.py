"""The search over what may be missing: singles, further ones, pairs, and what can be dropped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from seals.sysid.rivals.fit import Tell
from seals.sysid.rivals.problem import Experiment
from seals.sysid.rivals.score import Hypothesis, Judge, ordered

PAIRED = 5
"""Effects of the first round that are tried two by two."""


@dataclass(frozen=True, kw_only=True)
class Search:
    """What was tried.

    Args:
        judge: fits and scores.
        nominal: the model as it is.
        best: the chosen model.
        rounds: hypotheses of every round, best first.
    """

    judge: Judge
    nominal: Hypothesis
    best: Hypothesis
    rounds: tuple[tuple[Hypothesis, ...], ...] = field(default=())

    @property
    def tried(self) -> list[Hypothesis]:
        """All hypotheses, each once, best first."""
        every = {frozenset(h.candidates): h for r in self.rounds for h in r}
        return ordered(list(every.values()))


def search(experiment: Experiment, *, tell: Tell | None = None) -> Search:
    """Find the effects that lower the error on held-out runs by more than their price.

    Args:
        experiment: runs and model.
        tell: takes the number of hypotheses that are done.
    """
    iterations = experiment.settings.compare.iterations
    judge = Judge(experiment, iterations=iterations, tell=tell)
    nominal = judge.nominal
    singles = ordered(judge.fitted([((c,), None) for c in experiment.library.candidates]))
    rounds = [tuple(singles)]
    best = _better(judge, nominal, singles)
    while best.candidates and len(best.candidates) < experiment.settings.naming.most:
        following = _extended(judge, best, singles)
        rounds.append(tuple(following))
        further = _better(judge, best, following)
        if further is best:
            break
        best = further
    pairs = _pairs(judge, best, singles)
    rounds.append(tuple(pairs))
    best = _better(judge, best, pairs)
    if len(best.candidates) > 1:
        fewer = _dropped(judge, best)
        rounds.append(tuple(fewer))
        # a smaller model that is not surely worse is the better one
        spare = [h for h in fewer if not judge.margin(best, h).sure]
        best = ordered(spare)[0] if spare else best
    return Search(
        judge=judge,
        nominal=nominal,
        best=best,
        rounds=tuple(r for r in rounds if r),
    )


def expected(experiment: Experiment) -> int:
    """Return about how many hypotheses a search and its answer will fit."""
    several = len(experiment.library.candidates)
    pairs = PAIRED * (PAIRED - 1) // 2
    # singles, a second one beside the best, rivals of every claim, pairs, and the nominal model
    return 1 + 4 * several + min(pairs, several * (several - 1) // 2)


def _better(judge: Judge, base: Hypothesis, others: Sequence[Hypothesis]) -> Hypothesis:
    """The best of the others where it surely beats the base, else the base."""
    for other in ordered(others):
        if judge.margin(other, base).sure:
            return other
    return base


def _extended(judge: Judge, best: Hypothesis, singles: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The best model with one more effect."""
    sets = []
    for single in singles:
        c = single.candidates[0]
        if not set(c.keys) & {k for b in best.candidates for k in b.keys}:
            sets.append(((*best.candidates, c), best.fit.values))
    return ordered(judge.fitted(sets)) if sets else []


def _pairs(judge: Judge, best: Hypothesis, singles: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The likeliest effects two by two: a pair may lower the error where each alone raises it."""
    top = [s.candidates[0] for s in singles[:PAIRED]]
    known = set(best.candidates)
    pairs = [(a, b) for i, a in enumerate(top) for b in top[i + 1 :] if {a, b} != known]
    return ordered(judge.fitted([(pair, None) for pair in pairs])) if pairs else []


def _dropped(judge: Judge, best: Hypothesis) -> list[Hypothesis]:
    """The best model without one of its effects."""
    sets = []
    for k in range(len(best.candidates)):
        rest = best.candidates[:k] + best.candidates[k + 1 :]
        values = best.fit.values.copy()
        for key in best.candidates[k].keys:
            values[judge.index[key]] = judge.experiment.key(judge.index[key]).off
        sets.append((rest, values))
    return judge.fitted(sets)
