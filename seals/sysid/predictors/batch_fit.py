"""Parameter fits to several runs; all fits are simulated in one batch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seals.arrays import Floats
from seals.compare.solve import CaseFitter, FitTask
from seals.least_squares import LevenbergMarquardt
from seals.sysid.predictors.batch import Experiment

_SHARE = 1e-3
"""Finite difference of a key, as a share of its plausible size."""
_TICK = 2e-3
"""The same of a delay, over a few rows of the commands, which are held in between [s]."""
_LOOSE = 30.0
"""Prior of a candidate's key, in plausible sizes: wide, so that the data decide."""
_REACH = 0.7
"""Longest step of a key that sets out away from its nominal value, as a share of its change."""


class RunFitter(CaseFitter):
    """Solver of many fits over the runs of an experiment.

    Args:
        experiment: runs and model.
        iterations: most steps.
        rule: schedule of steps.
    """

    def __init__(
        self,
        experiment: Experiment,
        *,
        iterations: int = 10,
        rule: LevenbergMarquardt | None = None,
    ) -> None:
        self.experiment = experiment
        keys = [experiment.parameter(k) for k in range(len(experiment.names))]
        wide = np.array([k.tolerance or _LOOSE * k.scale for k in keys])
        self.scale = np.array([k.scale for k in keys])
        self.kicked = np.array([k.start != k.nominal for k in keys])
        super().__init__(
            experiment.predictor,
            experiment.cases,
            np.array([k.bounds for k in keys]).reshape(-1, 2),
            np.array([k.nominal for k in keys]),
            1.0 / np.maximum(wide, 1e-30) ** 2,
            iterations=iterations,
            rule=rule or LevenbergMarquardt(),
        )

    def nearest(self, tasks: Sequence[FitTask]) -> FitTask:
        """Return the task whose start is closest to the measurements."""
        self.begin(tasks)
        for task in tasks:
            task.steps, task.refused, task.damping = 0, 0, self.rule.start
        return min(tasks, key=lambda t: t.cost)

    def weighted(self, case: int, predicted: dict[str, Floats]) -> Floats:
        """Residuals of the fitted channels of one run; correlated samples are weighted down."""
        return self.experiment.weighted(case, predicted)

    def step(self, key: int, value: float) -> float:
        """Finite difference of a key, away from its upper bound."""
        step = _SHARE * self.scale[key]
        if self.experiment.names[key].endswith(".delay"):
            step = max(step, _TICK)
        return float(-step if value + step > self.bounds[key, 1] else step)

    def reach(self, task: FitTask) -> Floats:
        """Longest step of every unknown.

        Keys that set out away from zero bend strongly: their step is a share of what they are.
        """
        out = np.full(self._unknowns(task), np.inf)
        for place, k in enumerate(task.free):
            if self.kicked[k]:
                size = abs(task.values[k] - self.centre[k])
                out[place] = max(_REACH * size, 0.5 * self.scale[k])
        return out


def spread_of(task: FitTask, experiment: Experiment) -> Floats:
    """Standard deviations of the free keys, scaled by the misfit."""
    if not task.free:
        return np.zeros(0)
    samples = sum(len(experiment.weighted(c, task.predicted[c])) for c in task.cases)
    count = min(samples, 40 * len(task.cases)) - len(task.free)
    grow = max(task.cost / max(count, 1), 1.0)
    return np.sqrt(np.maximum(np.diag(np.linalg.pinv(task.normal)) * grow, 0.0))
