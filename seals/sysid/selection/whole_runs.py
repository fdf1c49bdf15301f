"""Search in logs without pose: whole runs are fitted, each model along its own trajectory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from seals.sysid.candidates.parameters import Candidate
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.parallel import spread
from seals.sysid.predictors.plant import Plant
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
from seals.sysid.scores.laplace_evidence import Hypothesis, is_significant, keys_of, occam_factor
from seals.sysid.selection.linear_screen import candidate_keys, linear_gain, screen

_COARSE = 2
"""Parts of a row in which plausible runs are simulated."""
_ROUNDS, _FIRST = 10, 2
"""Steps of a fit at most, and before those that fall behind are left."""
_SPARED, _RIVALS = 4, 3
"""Effects that are fitted whatever their linear gain, and rivals that are fitted once more."""
_RANKS = (0, 1, 2, 3, 5, 8)
"""Ranks, by distance from the readings, of the trajectories from which the nominal model starts."""


Pair: TypeAlias = tuple[Candidate, LinearisedModel]


class WholeRunFits:
    """Models of whole runs, each fitted along a trajectory of its own.

    Args:
        base: the nominal model, fitted.
        outset: the same before the fit; other models set out there when the fit came to nothing.
        processes: that share the fits.
    """

    def __init__(
        self, base: LinearisedModel, outset: LinearisedModel, *, processes: int = 1
    ) -> None:
        """Choose where fits start."""
        self.base, self.disturbance, self.processes = base, base.disturbance, processes
        self.integrator: SubstepIntegrator = base.fitter.integrator
        self.candidate_set = base.fitter.candidate_set
        self.policy = self.candidate_set.policy
        good = base.fit.cost < self.policy.good_fit * base.fitter.windows.observed
        self._from = base if good else outset

    @property
    def nominal(self) -> Hypothesis:
        """Model without any effect."""
        fit, fitter = self.base.fit, self.base.fitter
        return Hypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)

    def _shared(
        self, work: Callable[[Any], LinearisedModel], items: Sequence[Any]
    ) -> list[LinearisedModel]:
        """Share work among the processes."""
        found: list[LinearisedModel] = spread(work, items, self.processes)
        for one in found:
            one.fitter.attach(self.integrator)
        return found

    def hypothesis(self, candidates: Sequence[Candidate], found: LinearisedModel) -> Hypothesis:
        """Score a model against the nominal one."""
        paid = occam_factor(found.fit, self.candidate_set) - occam_factor(
            self.base.fit, self.candidate_set
        )
        return Hypothesis(
            candidates=tuple(candidates),
            fit=found.fit,
            fitter=found.fitter,
            score=self.base.level - found.level - paid,
        )

    def singles(self) -> tuple[Hypothesis, ...]:
        """Fit models with one effect, best first; those that fall behind are left unfinished."""
        choose = self._promising()
        first = zip(choose, self._spread([self._outset(c) for c in choose], _FIRST), strict=True)
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
        """Fit the nominal model and the nearest rivals from the trajectory of the best one too.

        Where an effect only led to a better trajectory, it must not take the credit for it.
        """
        best, rivals = found[0][1], found[1 : 1 + _RIVALS]
        given = {k: best.fit.values[k] for k in self.candidate_set.tolerances}
        trajectory, jobs = best.fitter.trajectory, []
        for candidate, own in (((), self.base), *(((c,), s) for c, s in rivals)):
            keys = keys_of(candidate)
            at = given | {k: own.fit.values[k] for k in keys}
            jobs.append(linearise_about(self.integrator, trajectory, keys, at, self.disturbance))
        more = self._spread(jobs, _ROUNDS)
        self.base = min(self.base, more[0], key=lambda s: s.fit.cost)
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
        """The nominal model with the candidate's keys free, where its trajectory is sensible."""
        base = self._from
        fit = base.fitter.start(keys_of((candidate,)))
        return LinearisedModel(fitter=base.fitter, fit=fit, disturbance=base.disturbance)

    def _spread(self, jobs: Sequence[LinearisedModel], rounds: int) -> list[LinearisedModel]:
        return self._shared(lambda job: converged(job, rounds=rounds), jobs)


SearchOutcome: TypeAlias = tuple[Hypothesis, Hypothesis, tuple[Hypothesis, ...]]
"""Nominal model, chosen one and all that were tried."""


def search_whole_runs(
    problem: Problem, asked: float, *, processes: int, tell: Callable[[int], None]
) -> SearchOutcome:
    """Search a log of drops without pose.

    One effect at most: readings of an impact alone do not hold two apart.

    Args:
        problem: the log made ready.
        asked: score that an effect must reach.
        processes: that share the fits.
        tell: called with the number of stages done.
    """
    plant = problem.plant
    coarse = Plant(problem.vehicle, plant.candidate_set, problem.samples, parts=_COARSE)
    guessed = {c.name for c in plant.candidate_set.candidates if c.identification.guessed}
    trajectories = nearest_trajectories(
        coarse, leave=sorted(guessed), ranks=_RANKS, processes=processes
    )
    outset, base = fit_nominal(plant, trajectories, processes=processes)
    tell(1)
    found = choose(WholeRunFits(base, outset, processes=processes), asked)
    tell(2)
    return found


def fit_nominal(
    plant: Plant, trajectories: Sequence[Trajectory], *, processes: int
) -> tuple[LinearisedModel, LinearisedModel]:
    """Fit the nominal model from the nearest trajectory, else from the other ones.

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


def choose(fits: WholeRunFits, asked: float) -> SearchOutcome:
    """Try all effects one by one; accept the best if it is significant."""
    tried = fits.singles()
    nominal = fits.nominal
    real = [h for h in tried if is_significant(h.candidates[-1], h.fit, fits.candidate_set)]
    if not real or real[0].score < asked:
        return nominal, nominal, tried
    # stronger gusts, as far as they are admitted, may do as well as the effect
    calm = disturbance_level(nominal).allowance - disturbance_level(real[0]).allowance
    return nominal, real[0] if real[0].score - calm > asked else nominal, tried
