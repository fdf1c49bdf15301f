"""Least-squares problem of a window fit for the damped Gauss-Newton solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.least_squares import Iterate, Proposal
from seals.sysid.predictors.normal_equations import Fit, newton_step, reserve
from seals.sysid.predictors.trajectory_cache import ExpansionPoint
from seals.sysid.predictors.whitened import Whitened

if TYPE_CHECKING:
    from seals.sysid.predictors.windows_fit import Fitter


@dataclass(kw_only=True)
class WindowTask(Iterate):
    """Iterate of a window fit with its next step."""

    fit: Fit
    step: Floats = field(default_factory=lambda: np.zeros(0))


class TrialPoint(NamedTuple):
    """Fit at trial values, minimised over the nuisance parameters."""

    cost: float
    fit: Fit
    misfit: Whitened


class Descent:
    """Least-squares problem of some parameters of a fitter.

    Args:
        fitter: of the linearisation.
        keys: of the fit.
        moving: keys that move; the others are eliminated to first order.
        tolerance: predicted fall of the cost below which no step is taken.
        expansion_point: about which steps are exact to first order.
    """

    def __init__(
        self,
        fitter: Fitter,
        keys: Sequence[str],
        moving: Sequence[str],
        tolerance: float,
        expansion_point: ExpansionPoint | None,
    ) -> None:
        self.fitter, self.tolerance, self.expansion_point = fitter, tolerance, expansion_point
        self.bounds = fitter.bounds(keys)
        self.fixed = [i for i, k in enumerate(keys) if k not in set(moving)]

    def task(self, fit: Fit) -> WindowTask:
        """Start an iteration at a fit."""
        observed = float(self.fitter.windows.observed)
        return WindowTask(fit=fit, cost=fit.cost - reserve(fit, self.fixed), floor=observed)

    def linearise(self, tasks: Sequence[WindowTask]) -> None:
        """Compute the steps of all tasks."""
        for task in tasks:
            task.step, predicted = newton_step(task.fit, self.bounds)
            task.done = predicted - reserve(task.fit, self.fixed) < self.tolerance
            task.step[self.fixed], task.linear = 0.0, True

    def evaluate(
        self, tasks: Sequence[WindowTask], proposals: Sequence[Sequence[Proposal]]
    ) -> list[list[TrialPoint]]:
        """Evaluate fractions of the steps."""
        return [
            [self._point(task, p.share) for p in row]
            for task, row in zip(tasks, proposals, strict=True)
        ]

    def _point(self, task: WindowTask, share: float) -> TrialPoint:
        fitter, now = self.fitter, task.fit
        values = fitter.moved(now, task.step, share)
        misfit = fitter.misfit(values, self.expansion_point)
        trial, misfit = fitter.equations(now.keys, now.free, values, now.precision, misfit)
        return TrialPoint(trial.cost - reserve(trial, self.fixed), trial, misfit)

    def keep(self, task: WindowTask, outcome: TrialPoint) -> None:
        """Accept a point and compute its equations."""
        task.fit = self.fitter.with_free(outcome.fit, outcome.misfit)
