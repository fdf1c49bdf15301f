"""Search for the effects missing in the model of one log; predictor and stages by its kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from seals.sysid.predictors.problem import Problem
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.own_trajectories import search_own_trajectories
from seals.sysid.selection.search import Refinement, Search, SearchStages, search
from seals.sysid.selection.whole_run_models import whole_run_models
from seals.sysid.selection.window_models import WindowModels


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
    own = search_own_trajectories(problem, found, asked=unposed, processes=processes)
    if own is None:
        return found
    # models along another trajectory cannot be compared with these
    same = own.nominal is found.nominal
    kept = [h for h in found.rounds[0] if same and h.names != own.best.names]
    return replace(own, rounds=((*own.rounds[0], *kept),))
