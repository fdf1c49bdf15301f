"""Search for the effects missing in the model of one log; predictor and stages by its kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from seals.arrays import Floats
from seals.sysid.parallel import spread
from seals.sysid.predictors.problem import WINDOW, Problem
from seals.sysid.predictors.substep_integrator import SubstepIntegrator
from seals.sysid.predictors.surface_model_error import surface_model_error
from seals.sysid.predictors.whole_run import (
    LinearisedModel,
    UnmodelledDisturbance,
    converged,
    linearise_about,
)
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, is_significant
from seals.sysid.selection.search import Refinement, Search, SearchStages, search
from seals.sysid.selection.whole_run_models import WholeRunModels, whole_run_models
from seals.sysid.selection.window_models import WindowModels

_ROUNDS = 14
"""Steps of a fit at most."""
_OUTSET = 0.02
"""Delay from which a fit starts [s]."""


def search_log(
    problem: Problem, *, processes: int = 1, tell: Callable[[int], None] = lambda rounds: None
) -> Search[EvidenceHypothesis]:
    """Search with windows of a log, or with whole runs where a falling body's pose is unmeasured.

    Args:
        problem: of the log.
        processes: that share the fits.
        tell: called with the number of stages done.
    """
    policy = problem.policy
    unposed = policy.evidence + policy.evidence_unposed
    if problem.impact and not problem.samples.posed:
        models = whole_run_models(problem, asked=unposed, processes=processes)
        tell(1)
        # readings of an impact alone do not hold two effects apart
        return search(models, SearchStages(effects=1), tell=lambda done: tell(1 + done))
    stages = SearchStages(
        effects=problem.budget.effects,
        alone=Refinement.pairs,
        second=Refinement.pairs,
        further=Refinement.exchange,
        last=(Refinement.backward,),
    )
    found = search(WindowModels(problem, processes=processes), stages, tell=tell)
    own = _search_own_trajectories(problem, found, asked=unposed, processes=processes)
    if own is None:
        return found
    # models along another trajectory cannot be compared with these
    same = own.nominal is found.nominal
    kept = [h for h in found.rounds[0] if same and h.names != own.best.names]
    return replace(own, rounds=((*own.rounds[0], *kept),))


def _search_own_trajectories(
    problem: Problem, known: Search[EvidenceHypothesis], *, asked: float, processes: int = 1
) -> Search[EvidenceHypothesis] | None:
    """Repeat a search with a trajectory fitted for every model; None where that gains nothing.

    A trajectory smoothed with late readings is bent at the impact, straight lines between the rows
    miss the impact's peak, and a hull that strikes fast is under water within a row. So model and
    trajectory are fitted together: first with and without late sensors, and where these are not
    missing, with all other effects.

    Args:
        problem: the log made ready.
        known: result of the search along the measured trajectory.
        asked: score that an effect must reach.
        processes: that share the fits.
    """
    nominal, best = known.nominal, known.best
    late = problem.plant.candidate_set.sensor_delay
    named = [c for c in problem.plant.candidate_set.candidates if late in c.keys]
    if not named or not problem.impact or not _doubtful(best):
        return None
    trajectory = problem.fitter.trajectory
    surface_error = surface_model_error(problem.plant, trajectory)
    if surface_error is not None:
        later = [
            np.roll(surface_error.blur, k)
            for k in range(1 + int(2.0 * _OUTSET / problem.samples.step))
        ]
        widened: Floats = np.max(later, axis=0)
        surface_error = replace(surface_error, blur=widened)
    disturbance = UnmodelledDisturbance(
        gusts=problem.fitter.windows.gusts, surface_error=surface_error, length=WINDOW
    )
    integrator = SubstepIntegrator(problem.plant)
    outsets = [
        linearise_about(integrator, trajectory, free, {late: start}, disturbance)
        for free, start in (((), 0.0), ((late,), _OUTSET))
    ]
    found: list[LinearisedModel] = spread(_converged, outsets, processes)
    for one in found:
        one.fitter.attach(integrator)
    plain, delayed = found
    models = WholeRunModels(plain, outsets[0], asked=asked, processes=processes)
    timed = models.hypothesis(named[:1], delayed)
    if timed.score > asked and is_significant(named[0], timed.fit, models.candidate_set):
        timed = replace(timed, score=timed.score + nominal.fit.cost - plain.fit.cost)
        if timed.score > best.score + asked:
            return Search(nominal=nominal, best=timed, rounds=((timed,),))
    if plain.fit.cost > best.fit.cost - problem.policy.late_gain:
        return None
    return search(models, SearchStages(effects=1))


def _doubtful(best: EvidenceHypothesis) -> bool:
    """Return true if a model leaves a large misfit, or needs a very flexible effect."""
    much = (
        best.fit.cost > best.fitter.candidate_set.policy.late_misfit * best.fitter.windows.observed
    )
    return much or any(c.identification.guessed for c in best.candidates)


def _converged(now: LinearisedModel) -> LinearisedModel:
    return converged(now, rounds=_ROUNDS)
