"""Error of a calibrated model on measurements that the fit did not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from seals.sysid.calibration.fitting import Solution
from seals.sysid.predictors.linearise import dynamics_along, predict
from seals.sysid.predictors.problem import Problem, refined, windows_of
from seals.sysid.predictors.trajectory_cache import TrajectoryCache
from seals.sysid.scores.held_out import held_out_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def unseen_misfit(
    problem: Problem, models: Sequence[Mapping[str, float]], *, at: Mapping[str, float]
) -> list[float]:
    """Return the misfit per degree of freedom of models on another log; noise alone gives 1.

    Nothing is fitted to the log but the start of every window.

    Args:
        problem: the other log made ready.
        models: values of each by parameter key.
        at: values about which the windows are linear, for all models alike.
    """
    plant, trajectory = problem.plant, problem.fitter.trajectory
    if problem.samples.posed:
        trajectory = refined(plant, trajectory, at=at)
    cache = TrajectoryCache(plant, trajectory)
    dynamics = dynamics_along(plant, trajectory, at, cache=cache)
    windows = windows_of(plant, trajectory, dynamics)
    found = []
    for values in models:
        prediction = predict(plant, trajectory, values, cache=cache)
        whitened = windows.whiten(windows.residual(prediction)[:, :, None])
        found.append(float(whitened.product(whitened).sum()) / float(windows.observed))
    return found


def left_out_misfit(solution: Solution, stated: Mapping[str, float]) -> tuple[float, float]:
    """Return the cross-validated misfit per degree of freedom before and after the calibration.

    Returns:
        That of the stated numbers, and that of fits to the other parts, in turn.
    """
    fit, fitter = solution.fit, solution.fitter
    before = fitter.misfit(stated)
    found = EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)
    level = float(before.product(before).sum()) / fitter.windows.observed
    return level, held_out_misfit(found)
