"""Models of whole runs of one log, for the search: each fitted along its own trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.parallel import spread
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.linear_screen import candidate_keys, linear_gain, screen
from seals.sysid.predictors.problem import GUSTS, Problem
from seals.sysid.predictors.substep_integrator import SubstepIntegrator
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.predictors.trials import nearest_trajectories
from seals.sysid.predictors.whole_run import (
    LinearisedModel,
    UnmodelledDisturbance,
    converged,
    linearise_about,
)
from seals.sysid.scores.disturbance_level import disturbance_level
from seals.sysid.scores.laplace_evidence import (
    EvidenceHypothesis,
    is_significant,
    occam_factor,
)
from seals.sysid.selection.search import Refinement

_COARSE = 2
"""Parts of a row in which plausible runs are simulated."""
_ROUNDS, _FIRST = 10, 2
"""Steps of a fit at most, and before those that fall behind are left."""
_SPARED, _RIVALS = 4, 3
"""Effects that are fitted whatever their linear gain, and rivals that are fitted once more."""
_RANKS = (0, 1, 2, 3, 5, 8)
"""Ranks, by distance from the readings, of the trajectories from which the stated model starts."""


Pair: TypeAlias = tuple[Candidate, LinearisedModel]


class WholeRunModels:
    """Models of whole runs, each fitted along a trajectory of its own.

    Args:
        base: the stated model, fitted.
        outset: the same before the fit; other models start there when the fit came to nothing.
        asked: evidence that an effect must reach.
        processes: that share the fits.
    """

    def __init__(
        self, base: LinearisedModel, outset: LinearisedModel, *, asked: float, processes: int = 1
    ) -> None:
        self.base, self.disturbance, self.processes = base, base.disturbance, processes
        self.integrator: SubstepIntegrator = base.fitter.integrator
        self.candidate_set = base.fitter.candidate_set
        self.policy = self.candidate_set.policy
        good = base.fit.cost < self.policy.good_fit * base.fitter.windows.observed
        self._from = base if good else outset

        self._asked = asked
        self.nominal = self._nominal()

    def _nominal(self) -> EvidenceHypothesis:
        fit, fitter = self.base.fit, self.base.fitter
        return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)

    def settled(self, base: EvidenceHypothesis) -> bool:
        """Return false: every model is extended."""
        return False

    def accepted(
        self, base: EvidenceHypothesis, tried: Sequence[EvidenceHypothesis]
    ) -> tuple[EvidenceHypothesis | None, Sequence[EvidenceHypothesis]]:
        """Return the best model where its evidence is strong enough."""
        real = [h for h in tried if is_significant(h.candidates[-1], h.fit, self.candidate_set)]
        if not real or real[0].score < self._asked:
            return None, tried
        # stronger gusts, as far as they are admitted, may do as well as the effect
        calm = disturbance_level(base).allowance - disturbance_level(real[0]).allowance
        return real[0] if real[0].score - calm > self._asked else None, tried

    def refined(
        self, best: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis], step: Refinement
    ) -> tuple[EvidenceHypothesis, Sequence[EvidenceHypothesis]]:
        """Return the best model unchanged: an impact alone does not distinguish two effects."""
        return best, ()

    def hypothesis(
        self, candidates: Sequence[Candidate], found: LinearisedModel
    ) -> EvidenceHypothesis:
        """Score a model against the nominal one."""
        paid = occam_factor(found.fit, self.candidate_set) - occam_factor(
            self.base.fit, self.candidate_set
        )
        return EvidenceHypothesis(
            candidates=tuple(candidates),
            fit=found.fit,
            fitter=found.fitter,
            score=self.base.level - found.level - paid,
        )

    def extended(
        self, base: EvidenceHypothesis, singles: Sequence[EvidenceHypothesis]
    ) -> tuple[EvidenceHypothesis, ...]:
        """Fit models with one effect, best first; fits that fall behind are stopped early."""
        chosen = self._promising()
        first = zip(chosen, self._spread([self._outset(c) for c in chosen], _FIRST), strict=True)
        tried = sorted(first, key=lambda pair: -self._score(*pair))
        least = self._score(*tried[0]) - self.policy.behind_unposed if tried else 0.0
        near = sum(self._score(*pair) > least for pair in tried)
        more = self._spread([s for _, s in tried[:near]], _ROUNDS)
        found = [*((c, s) for (c, _), s in zip(tried, more, strict=False)), *tried[near:]]
        found.sort(key=lambda pair: -self._score(*pair))
        if found and self._score(*found[0]) > self.policy.recheck_unposed:
            found = self._again(found)
        out = [self.hypothesis((c,), s) for c, s in found]
        return tuple(sorted(out, key=lambda h: -h.score))

    def _again(self, found: Sequence[Pair]) -> list[Pair]:
        """Refit the stated model and the nearest rivals from the best one's trajectory too.

        Where an effect only led to a better trajectory, it must not take the credit for it.
        """
        best, rivals = found[0][1], found[1 : 1 + _RIVALS]
        given = {k: best.fit.values[k] for k in self.candidate_set.tolerances}
        trajectory, jobs = best.fitter.trajectory, []
        for candidate, own in (((), self.base), *(((c,), s) for c, s in rivals)):
            keys = candidate_keys(candidate)
            at = given | {k: own.fit.values[k] for k in keys}
            jobs.append(linearise_about(self.integrator, trajectory, keys, at, self.disturbance))
        more = self._spread(jobs, _ROUNDS)
        self.base = min(self.base, more[0], key=lambda s: s.fit.cost)
        self.nominal = self._nominal()
        better = [
            (c, min(s, other, key=lambda s: s.fit.cost))
            for (c, s), other in zip(rivals, more[1:], strict=True)
        ]
        return [found[0], *better, *found[1 + _RIVALS :]]

    def _score(self, candidate: Candidate, found: LinearisedModel) -> float:
        return self.hypothesis((candidate,), found).score

    def _promising(self) -> list[Candidate]:
        """Return the candidates that pass a linear screen about the nominal trajectory."""
        fit, fitter = self._from.fit, self._from.fitter
        # readings without pose do not hold effects of unknown place or period
        candidates = [c for c in self.candidate_set.candidates if not c.identification.guessed]
        table = screen(fitter, fit, candidate_keys(candidates))
        common, _ = linear_gain(fitter, table, ())
        gains = {c.label: linear_gain(fitter, table, c.all_keys)[0] - common for c in candidates}
        ranked = sorted(candidates, key=lambda c: -gains[c.label])
        least = self.policy.screen_unposed
        return [c for k, c in enumerate(ranked) if k < _SPARED or gains[c.label] > least]

    def _outset(self, candidate: Candidate) -> LinearisedModel:
        """Nominal model with the candidate's keys free; None if its trajectory diverges."""
        base = self._from
        fit = base.fitter.start(candidate_keys((candidate,)))
        return LinearisedModel(fitter=base.fitter, fit=fit, disturbance=base.disturbance)

    def _spread(self, jobs: Sequence[LinearisedModel], rounds: int) -> list[LinearisedModel]:
        found: list[LinearisedModel] = spread(
            (lambda job: converged(job, rounds=rounds)), jobs, self.processes
        )
        for one in found:
            one.fitter.attach(self.integrator)
        return found


def whole_run_models(problem: Problem, *, asked: float, processes: int) -> WholeRunModels:
    """Return the models of whole runs of a log without a measured pose.

    Args:
        problem: of the log.
        asked: evidence that an effect must reach.
        processes: that share the fits.
    """
    plant = problem.plant
    coarse = plant.of(plant.candidate_set, parts=_COARSE)
    guessed = {c.name for c in plant.candidate_set.candidates if c.identification.guessed}
    trajectories = nearest_trajectories(
        coarse, leave=sorted(guessed), ranks=_RANKS, processes=processes
    )
    outset, base = fit_nominal(plant, trajectories, processes=processes)
    return WholeRunModels(base, outset, asked=asked, processes=processes)


def fit_nominal(
    plant: ExtendedModel, trajectories: Sequence[Trajectory], *, processes: int
) -> tuple[LinearisedModel, LinearisedModel]:
    """Fit the stated model, starting from the trajectory nearest to the readings.

    A hull that comes up a little early or late turns another way, and no small step leads from the
    one trajectory to the other.
    """
    integrator = SubstepIntegrator(plant)
    disturbance = UnmodelledDisturbance(
        gusts=GUSTS, surface_error=surface_model_error(plant, trajectories[0])
    )
    outset = linearise_about(integrator, trajectories[0], (), {}, disturbance)
    base = converged(outset, rounds=_ROUNDS)
    if base.fit.cost < base.fitter.windows.observed:
        return outset, base
    others = [
        linearise_about(integrator, trajectory, (), {}, disturbance)
        for trajectory in trajectories[1:]
    ]
    found = spread(lambda job: converged(job, rounds=_ROUNDS), others, processes)
    for one in found:
        one.fitter.attach(integrator)
    pairs = [(outset, base), *zip(others, found, strict=True)]
    return min(pairs, key=lambda pair: pair[1].fit.cost)
