"""Fit of parameters to the windows of a log, relinearised until it converges."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import (
    Problem,
    follow_measurements,
    linearise_model,
    refined,
)
from seals.sysid.predictors.windows_fit import Fitter

ROUNDS = 8
"""Linearisations at most; numbers that are 50 % off take three or four."""
_SETTLED = 0.1
"""Move of every number, in units of its 1-sigma, below which a calibration has settled."""


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Fit of a calibration.

    Args:
        fitter: linearised at the fitted values.
        fit: of the numbers and of all tolerances.
        rounds: linearisations that it took.
        settled: whether the last one moved no number by a part of its uncertainty.
    """

    fitter: Fitter
    fit: Fit
    rounds: int
    settled: bool


def solve(
    problem: Problem, keys: Sequence[str], *, tell: Callable[[int], None] = lambda done: None
) -> Solution:
    """Fit the asked parameters and all tolerances, relinearising until the fit converges.

    Args:
        problem: the log made ready, with the parameters free.
        keys: of the parameters.
        tell: takes the number of linearisations done.
    """
    fitter = problem.fitter
    fit = fitter.fit(tuple(keys))
    done, settled = 1, False
    tell(done)
    while done < ROUNDS and not settled:
        before = fit
        if problem.samples.posed:
            trajectory = refined(problem.plant, fitter.trajectory, at=fit.values)
            fitter = linearise_model(problem.plant, trajectory, fit.values)
        else:
            fitter = follow_measurements(fitter, fit.free, at=fit.values, rounds=1)
        fit = fitter.fit(tuple(keys), start=fit.values)
        done += 1
        settled = moved(before, fit, keys) < _SETTLED
        tell(done)
    return Solution(fitter=fitter, fit=fit, rounds=done, settled=settled)


def moved(before: Fit, after: Fit, keys: Sequence[str]) -> float:
    """Return the largest change of some parameters in units of their 1-sigma."""
    steps = [abs(after.values[k] - before.values[k]) / after.spread(k) for k in keys]
    return float(np.max(steps))
