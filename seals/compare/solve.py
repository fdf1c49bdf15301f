"""Damped Gauss-Newton fit of parameters and of the start states of all cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.compare.predict import Job, Predictor, residuals, whitened
from seals.least_squares import Iterate, LevenbergMarquardt, Proposal, minimise

RULE = LevenbergMarquardt(
    lowered_after_refusal=10.0, most=np.inf, refusals=6, shorter=0.0, settled=1e-5, trials=6
)
_STEP_NORM = 0.3
"""Size of a finite difference in units of the noise, root mean square over the rows."""


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Estimated parameters and starts.

    Args:
        values: of the fitted parameters, shape (P,).
        sigma: their standard deviations from the curvature, scaled by the misfit, shape (P,).
        deviations: of the starts, one (12 + 2 J,) per case.
        start_sigma: standard deviations of the starts, like ``deviations``; 0 where held.
        predicted: samples of the model, one dict per case.
        chi2: sum of squared whitened residuals, priors of the starts included.
        at_bound: whether a parameter stands on a bound, shape (P,).
    """

    values: Floats
    sigma: Floats
    deviations: list[Floats]
    start_sigma: list[Floats]
    predicted: list[dict[str, Floats]]
    chi2: float
    at_bound: list[bool]


@dataclass(frozen=True)
class _Unknown:
    """Parameters and deviations of the starts."""

    values: Floats
    deviations: list[Floats]


class _Point(NamedTuple):
    """Unknowns with the samples of the model, by case, and the cost."""

    at: _Unknown
    predicted: list[dict[str, Floats]]
    cost: float


@dataclass(kw_only=True)
class _Task(Iterate):
    """Least-squares problem of some free parameters and all starts."""

    point: _Point
    free: tuple[int, ...]
    damping: float = RULE.start
    system: tuple[Floats, Floats] = (np.zeros((0, 0)), np.zeros(0))


class Solver:
    """Least squares of whitened residuals with priors on the starts.

    Args:
        predictor: simulates the cases.
        iterations: most steps.
    """

    def __init__(self, predictor: Predictor, *, iterations: int) -> None:
        self.predictor, self.cases = predictor, predictor.cases
        self.iterations = iterations
        self.bounds = np.array([k.parameter.bounds for k in predictor.keys]).reshape(-1, 2)
        self._steps: dict[int, Floats] = {}

    def solve(self, values: Floats, *, free: Sequence[int]) -> Solution:
        """Estimate the parameters ``free`` (indices) and all starts.

        Args:
            values: parameters at the outset, shape (P,).
            free: parameters to estimate; the others are held.
        """
        x = _Unknown(values.copy(), [np.zeros_like(c.start.sigma) for c in self.cases])
        task = _Task(point=self._point(x), free=tuple(free))
        task.cost = task.point.cost
        task.done = not free and not any(c.start.free for c in self.cases)
        minimise(self, [task], RULE, steps=self.iterations)
        return self._solution(*task.point, list(free))

    def linearise(self, tasks: Sequence[_Task]) -> None:
        """Linearise the task by finite differences."""
        for task in tasks:
            task.system = self._normal(task.point.at, task.point.predicted, list(task.free))
            task.linear = True

    def evaluate(
        self, tasks: Sequence[_Task], proposals: Sequence[Sequence[Proposal]]
    ) -> list[list[_Point]]:
        """Simulate damped steps."""
        return [
            [self._point(self._moved(t.point.at, *t.system, list(t.free), p.damping)) for p in row]
            for t, row in zip(tasks, proposals, strict=True)
        ]

    def keep(self, task: _Task, outcome: _Point) -> None:
        """Move the task to the point that a trial reached."""
        task.point = outcome

    def _point(self, x: _Unknown) -> _Point:
        jobs = [Job(i, d, x.values) for i, d in enumerate(x.deviations)]
        predicted = self.predictor.run(jobs)
        cost = 0.0
        for case, deviation, samples in zip(self.cases, x.deviations, predicted, strict=True):
            r = whitened(case, residuals(case, samples))
            cost += float(r @ r) + float(
                np.sum((deviation[case.start.free] / case.start.sigma[case.start.free]) ** 2)
            )
        return _Point(x, predicted, cost if np.isfinite(cost) else np.inf)

    def _normal(
        self, x: _Unknown, predicted: list[dict[str, Floats]], free: list[int]
    ) -> tuple[Floats, Floats]:
        """Normal matrix and gradient.

        The unknowns are the free parameters, then the starts case by case.
        """
        sizes = [len(c.start.free) for c in self.cases]
        offset = np.concatenate([[len(free)], len(free) + np.cumsum(sizes)])
        n = int(offset[-1])
        normal, gradient = np.zeros((n, n)), np.zeros(n)
        columns = self._columns(x, predicted, free)
        for i, case in enumerate(self.cases):
            place = [*range(len(free)), *range(int(offset[i]), int(offset[i + 1]))]
            r = whitened(case, residuals(case, predicted[i]))
            normal[np.ix_(place, place)] += columns[i].T @ columns[i]
            gradient[place] += columns[i].T @ r
            prior = 1.0 / case.start.sigma[case.start.free] ** 2
            own = np.arange(int(offset[i]), int(offset[i + 1]))
            normal[own, own] += prior
            gradient[own] -= prior * x.deviations[i][case.start.free]
        return normal, gradient

    def _columns(
        self, x: _Unknown, predicted: list[dict[str, Floats]], free: list[int]
    ) -> list[Floats]:
        """Whitened sensitivities of every case, shape (samples, unknowns of the case)."""
        jobs, sizes = [], []
        for i in range(len(self.cases)):
            for k, step in self._differences(i, x, free):
                values, deviation = x.values.copy(), x.deviations[i].copy()
                (values if k < 0 else deviation)[-k - 1 if k < 0 else k] += step
                jobs.append(Job(i, deviation, values))
                sizes.append(step)
        moved = self.predictor.run(jobs) if jobs else []
        out, at = [], 0
        for i, case in enumerate(self.cases):
            base = whitened(case, residuals(case, predicted[i]))
            count = len(free) + len(case.start.free)
            rows = [
                (base - whitened(case, residuals(case, moved[at + c]))) / sizes[at + c]
                for c in range(count)
            ]
            at += count
            out.append(np.stack(rows, axis=1) if rows else np.zeros((base.size, 0)))
        return out

    def _differences(self, i: int, x: _Unknown, free: list[int]) -> list[tuple[int, float]]:
        """Steps of one case: parameter p as -p - 1, component k of the start as k."""
        steps = self._parameter_steps(x.values)
        pairs = [(-p - 1, steps[p]) for p in free]
        return pairs + [(k, 1e-4) for k in self.cases[i].start.free]

    def _parameter_steps(self, values: Floats) -> Floats:
        """Steps that change the samples by a fraction of the noise, found once by trial."""
        if 0 not in self._steps:
            trial = 1e-4 * np.maximum(
                np.abs(values), np.minimum(1.0, self.bounds[:, 1] if len(values) else 1.0)
            )
            self._steps[0] = np.array(
                [self._tuned(values, p, float(trial[p])) for p in range(len(values))]
            )
        steps = self._steps[0]
        # step inward at the upper bound
        return np.where(values + steps > self.bounds[:, 1], -steps, steps) if len(values) else steps

    def _tuned(self, values: Floats, p: int, trial: float) -> float:
        """Scale a trial step: the change is small against the noise, yet far above rounding."""
        moved = values.copy()
        moved[p] += trial
        zero = [np.zeros_like(c.start.sigma) for c in self.cases]
        jobs = [Job(i, d, v) for v in (values, moved) for i, d in enumerate(zero)]
        out = self.predictor.run(jobs)
        half = len(self.cases)
        change = [
            whitened(c, residuals(c, out[i])) - whitened(c, residuals(c, out[half + i]))
            for i, c in enumerate(self.cases)
        ]
        size = float(np.sqrt(np.mean(np.concatenate(change) ** 2)))
        if not np.isfinite(size) or size == 0.0:
            return trial
        return float(np.clip(trial * _STEP_NORM / size, 1e-3 * trial, 1e3 * trial))

    def _moved(
        self, x: _Unknown, normal: Floats, gradient: Floats, free: list[int], damping: float
    ) -> _Unknown:
        """Take one damped step; parameters stay inside their bounds."""
        held = self._stuck(x.values, gradient, free)
        keep = [k for k in range(len(gradient)) if k not in held]
        matrix = normal[np.ix_(keep, keep)].copy()
        diagonal = np.diag(matrix).copy()
        matrix[np.diag_indices_from(matrix)] += damping * diagonal + 1e-12 * max(
            float(diagonal.max(initial=0.0)), 1e-30
        )
        change = np.zeros(len(gradient))
        change[keep] = np.linalg.solve(matrix, gradient[keep])
        values = x.values.copy()
        values[free] = np.clip(
            values[free] + change[: len(free)], self.bounds[free, 0], self.bounds[free, 1]
        )
        deviations, at = [], len(free)
        for case, deviation in zip(self.cases, x.deviations, strict=True):
            new = deviation.copy()
            new[case.start.free] += change[at : at + len(case.start.free)]
            at += len(case.start.free)
            deviations.append(new)
        return _Unknown(values, deviations)

    def _stuck(self, values: Floats, gradient: Floats, free: list[int]) -> set[int]:
        """Free parameters on a bound whose step would leave it."""
        out = set()
        for place, p in enumerate(free):
            low, high = self.bounds[p]
            if (values[p] <= low and gradient[place] < 0.0) or (
                values[p] >= high and gradient[place] > 0.0
            ):
                out.add(place)
        return out

    def _solution(
        self, x: _Unknown, predicted: list[dict[str, Floats]], cost: float, free: list[int]
    ) -> Solution:
        sigma = np.zeros(len(x.values))
        spread = self._spread(x, predicted, cost, free)
        sigma[free] = spread[: len(free)]
        starts, at = [], len(free)
        for case in self.cases:
            own = np.zeros_like(case.start.sigma)
            own[case.start.free] = spread[at : at + len(case.start.free)]
            at += len(case.start.free)
            starts.append(own)
        on = [
            bool(p in free and (v <= b[0] or v >= b[1]))
            for p, (v, b) in enumerate(zip(x.values, self.bounds, strict=True))
        ]
        return Solution(
            values=x.values,
            sigma=sigma,
            deviations=x.deviations,
            start_sigma=starts,
            predicted=predicted,
            chi2=cost,
            at_bound=on,
        )

    def _spread(
        self, x: _Unknown, predicted: list[dict[str, Floats]], cost: float, free: list[int]
    ) -> Floats:
        """Standard deviations of all unknowns from the curvature, scaled by the misfit."""
        normal, _ = self._normal(x, predicted, free)
        if not normal.size:
            return np.zeros(0)
        samples = sum(int(np.isfinite(m).sum()) for c in self.cases for m in c.measured.values())
        covariance = np.linalg.pinv(normal) * cost / max(samples - normal.shape[0], 1)
        return np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)))
