"""Models of several runs of an experiment, for the search: batch simulation, cross-validated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from seals.least_squares import Tell
from seals.sysid.predictors.batch import Experiment
from seals.sysid.scores.cross_validation import CrossValidator, ValidatedHypothesis, ranked
from seals.sysid.selection.search import Refinement, Search, SearchStages, search


@dataclass(frozen=True, kw_only=True)
class RunsSearch(Search[ValidatedHypothesis]):
    """Result of a search over runs.

    Args:
        validator: that fitted and scored the models.
    """

    validator: CrossValidator

    @property
    def tried(self) -> list[ValidatedHypothesis]:
        """All hypotheses, each once, best first."""
        rounds = (*self.rounds, *self.refinements)
        return ranked(list({frozenset(h.candidates): h for r in rounds for h in r}.values()))


class _RunModels:
    """Models of several runs, fitted by batch simulation and cross-validated.

    Args:
        validator: fits and scores.
    """

    def __init__(self, validator: CrossValidator) -> None:
        self.validator, self.nominal = validator, validator.nominal
        self.candidates = validator.experiment.candidate_set.candidates

    def extended(
        self, base: ValidatedHypothesis, singles: Sequence[ValidatedHypothesis]
    ) -> list[ValidatedHypothesis]:
        """Fit models with one more effect that shares no parameter with the base."""
        if not base.candidates:
            return ranked(self.validator.fitted([((c,), None) for c in self.candidates]))
        taken = {k for c in base.candidates for k in c.keys}
        others = [s.candidates[0] for s in singles if not set(s.candidates[0].keys) & taken]
        sets = [((*base.candidates, c), base.fit.values) for c in others]
        return ranked(self.validator.fitted(sets))

    def settled(self, base: ValidatedHypothesis) -> bool:
        """Return false: every model is extended."""
        return False

    def accepted(
        self, base: ValidatedHypothesis, tried: Sequence[ValidatedHypothesis]
    ) -> tuple[ValidatedHypothesis | None, Sequence[ValidatedHypothesis]]:
        """Return the best model that is significantly better than the base on held-out runs."""
        better = (h for h in ranked(tried) if self.validator.margin(h, base).significant)
        return next(better, None), tried

    def refined(
        self, best: ValidatedHypothesis, singles: Sequence[ValidatedHypothesis], step: Refinement
    ) -> tuple[ValidatedHypothesis, Sequence[ValidatedHypothesis]]:
        """Try pairs, or drop effects where the smaller model is not significantly worse."""
        if step is not Refinement.backward:
            # a pair may lower the error where neither effect does
            budget = self.validator.experiment.candidate_set.budget
            top = [s.candidates[0] for s in singles[: budget.paired]]
            known = set(best.candidates)
            couples = [(a, b) for i, a in enumerate(top) for b in top[i + 1 :] if {a, b} != known]
            pairs = ranked(self.validator.fitted([(pair, None) for pair in couples]))
            return self.accepted(best, pairs)[0] or best, pairs
        if len(best.candidates) < 2:
            return best, ()
        sets = []
        for i, candidate in enumerate(best.candidates):
            rest = best.candidates[:i] + best.candidates[i + 1 :]
            sets.append((rest, self.validator.without(best, candidate)))
        fewer = self.validator.fitted(sets)
        spare = [h for h in fewer if not self.validator.margin(best, h).significant]
        return ranked(spare)[0] if spare else best, fewer


def search_runs(experiment: Experiment, *, tell: Tell | None = None) -> RunsSearch:
    """Search for the effects that lower the held-out error by more than their penalty.

    Args:
        experiment: runs and model.
        tell: takes the number of hypotheses that are done.
    """
    iterations = experiment.settings.compare.iterations
    validator = CrossValidator(experiment, iterations=iterations, tell=tell)
    stages = SearchStages(
        effects=experiment.settings.naming.most, last=(Refinement.pairs, Refinement.backward)
    )
    found = search(_RunModels(validator), stages)
    return RunsSearch(
        nominal=found.nominal,
        best=found.best,
        rounds=found.rounds,
        refinements=found.refinements,
        validator=validator,
    )


def expected_fits(experiment: Experiment) -> int:
    """Estimate the number of hypotheses that a search and its decision fit."""
    several, paired = (
        len(experiment.candidate_set.candidates),
        experiment.candidate_set.budget.paired,
    )
    pairs = min(paired * (paired - 1), several * (several - 1)) // 2
    # singles, a second one beside the best, rivals of every claim, pairs, and the stated model
    return 1 + 4 * several + pairs
