"""Damped Gauss-Newton fits of parameters and of the start states of cases."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case
from seals.compare.predict import Job, Predictor, residuals, whitened
from seals.least_squares import (
    Iterate,
    LevenbergMarquardt,
    Proposal,
    Tell,
    bounded_step,
    minimise,
    settle,
)

RULE = LevenbergMarquardt(
    lowered_after_refusal=10.0, most=np.inf, refusals=6, shorter=0.0, settled=1e-5, trials=6
)
BATCH = 1500
"""Most simulations at a time."""
_START_STEP = 1e-4
_STEP_NORM = 0.3
"""Size of a finite difference in units of the noise, root mean square over the rows."""


@dataclass(kw_only=True)
class FitTask(Iterate):
    """Least-squares problem of some free parameters on some runs.

    Args:
        free: indices of the free keys.
        cases: indices of the runs.
        values: of all keys.
        deviations: of the starts, by run.
        predicted: samples of the model, by run.
        normal: curvature of the free keys once the starts are eliminated.
    """

    free: tuple[int, ...]
    cases: tuple[int, ...]
    values: Floats
    deviations: dict[int, Floats] = field(default_factory=dict)
    predicted: dict[int, dict[str, Floats]] = field(default_factory=dict)
    normal: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    damping: float = LevenbergMarquardt.start
    system: tuple[Floats, Floats] | None = None


class Point(NamedTuple):
    """Parameter values and start deviations of a fit, with the predicted channels."""

    cost: float
    values: Floats
    deviations: dict[int, Floats]
    predicted: dict[int, dict[str, Floats]]


Trial = tuple[Floats, dict[int, Floats]]
"""Values of all keys, and deviations of the starts by run."""


class CaseFitter(ABC):
    """Least squares of whitened residuals with priors on parameters and starts, in batches.

    Args:
        predictor: simulates the cases; a job's values follow the keys.
        cases: stretches, by index.
        bounds: of the keys, shape (P, 2).
        centre: prior mean of the keys, shape (P,).
        precision: prior precision of the keys, shape (P,).
        iterations: most steps.
        rule: schedule of steps.
    """

    def __init__(
        self,
        predictor: Predictor,
        cases: Sequence[Case],
        bounds: Floats,
        centre: Floats,
        precision: Floats,
        *,
        iterations: int,
        rule: LevenbergMarquardt,
    ) -> None:
        self.predictor, self.cases = predictor, cases
        self.bounds, self.centre, self.precision = bounds, centre, precision
        self.iterations, self.rule = iterations, rule

    @abstractmethod
    def weighted(self, case: int, predicted: dict[str, Floats]) -> Floats:
        """Whitened residuals of one case as one vector."""

    @abstractmethod
    def nudge(self, key: int) -> float:
        """Size of the finite difference of a key."""

    def step(self, key: int, value: float) -> float:
        """Finite difference of a key, away from its upper bound."""
        step = self.nudge(key)
        return -step if value + step > self.bounds[key, 1] else step

    def reach(self, task: FitTask) -> Floats:
        """Longest step of every unknown."""
        return np.full(self._unknowns(task), np.inf)

    def solve(
        self, tasks: Sequence[FitTask], *, most: int | None = None, tell: Tell | None = None
    ) -> None:
        """Solve all tasks in place, in at most ``most`` steps; ``tell`` receives the progress."""
        self.begin([t for t in tasks if not t.predicted])
        for task in tasks:
            task.done = not self._unknowns(task)
        minimise(self, tasks, self.rule, steps=most or self.iterations, tell=tell)

    def begin(self, tasks: Sequence[FitTask]) -> None:
        """Evaluate tasks at their starting values."""
        for task in tasks:
            for c in task.cases:
                task.deviations.setdefault(c, np.zeros_like(self.cases[c].start.sigma))
        found = self._simulated(tasks, [[(t.values, t.deviations)] for t in tasks])
        settle(self, tasks, found, self.rule)

    def _unknowns(self, task: FitTask) -> int:
        return len(task.free) + sum(len(self.cases[c].start.free) for c in task.cases)

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Simulate jobs in batches."""
        out: list[dict[str, Floats]] = []
        for k in range(0, len(jobs), BATCH):
            out += self.predictor.run(jobs[k : k + BATCH])
        return out

    def evaluate(
        self, tasks: Sequence[FitTask], proposals: Sequence[Sequence[Proposal]]
    ) -> list[list[Point]]:
        """Simulate proposed steps of all tasks."""
        rows = [
            [self._moved(task, p) for p in row] for task, row in zip(tasks, proposals, strict=True)
        ]
        return self._simulated(tasks, rows)

    def keep(self, task: FitTask, outcome: Point) -> None:
        """Move a task to the point that a trial reached."""
        task.values, task.deviations = outcome.values, outcome.deviations
        task.predicted = outcome.predicted

    def _simulated(
        self, tasks: Sequence[FitTask], trials: Sequence[Sequence[Trial]]
    ) -> list[list[Point]]:
        jobs = [
            Job(c, deviations[c], values)
            for t, row in zip(tasks, trials, strict=True)
            for values, deviations in row
            for c in t.cases
        ]
        found = iter(self.run(jobs))
        out: list[list[Point]] = []
        for task, row in zip(tasks, trials, strict=True):
            points = []
            for values, deviations in row:
                predicted = {c: next(found) for c in task.cases}
                cost = self._cost(task, values, deviations, predicted)
                points.append(Point(cost, values, deviations, predicted))
            out.append(points)
        return out

    def _cost(
        self,
        task: FitTask,
        values: Floats,
        deviations: dict[int, Floats],
        predicted: dict[int, dict[str, Floats]],
    ) -> float:
        free = list(task.free)
        total = float(np.sum(self.precision[free] * (values[free] - self.centre[free]) ** 2))
        for c in task.cases:
            r = self.weighted(c, predicted[c])
            start = self.cases[c].start
            own = deviations[c][start.free] / start.sigma[start.free]
            total += float(r @ r) + float(own @ own)
        return total if np.isfinite(total) else 1e300

    def linearise(self, tasks: Sequence[FitTask]) -> None:
        """Linearise all tasks by finite differences in one batch."""
        jobs: list[Job] = []
        for t in tasks:
            for c in t.cases:
                for k in t.free:
                    values = t.values.copy()
                    values[k] += self.step(k, values[k])
                    jobs.append(Job(c, t.deviations[c], values))
                for s in self.cases[c].start.free:
                    deviation = t.deviations[c].copy()
                    deviation[s] += _START_STEP
                    jobs.append(Job(c, deviation, t.values))
        found = iter(self.run(jobs))
        for t in tasks:
            count = sum(len(t.free) + len(self.cases[c].start.free) for c in t.cases)
            t.system = self._system(t, [next(found) for _ in range(count)])
            t.linear = True

    def _system(self, task: FitTask, moved: list[dict[str, Floats]]) -> tuple[Floats, Floats]:
        """Normal matrix and gradient of all unknowns: the free keys, then the starts run by run."""
        p, total = len(task.free), self._unknowns(task)
        normal, right = np.zeros((total, total)), np.zeros(total)
        free = list(task.free)
        normal[range(p), range(p)] += self.precision[free]
        right[:p] -= self.precision[free] * (task.values[free] - self.centre[free])
        at, used = p, 0
        for c in task.cases:
            start = self.cases[c].start
            base = self.weighted(c, task.predicted[c])
            steps = [self.step(k, task.values[k]) for k in free]
            steps += [_START_STEP] * len(start.free)
            rows = moved[used : used + len(steps)]
            used += len(steps)
            columns = (
                np.stack(
                    [(base - self.weighted(c, m)) / h for m, h in zip(rows, steps, strict=True)],
                    axis=1,
                )
                if steps
                else np.zeros((base.size, 0))
            )
            place = [*range(p), *range(at, at + len(start.free))]
            normal[np.ix_(place, place)] += columns.T @ columns
            right[place] += columns.T @ base
            own = np.arange(at, at + len(start.free))
            prior = 1.0 / start.sigma[start.free] ** 2
            normal[own, own] += prior
            right[own] -= prior * task.deviations[c][start.free]
            at += len(start.free)
        task.normal = _reduced(normal, p)
        return np.nan_to_num(normal), np.nan_to_num(right)

    def _moved(self, task: FitTask, proposal: Proposal) -> Trial:
        """Take one step within the bounds."""
        assert task.system is not None
        normal, right = task.system
        held = [
            k
            for k, key in enumerate(task.free)
            if (task.values[key] <= self.bounds[key, 0] and right[k] < 0.0)
            or (task.values[key] >= self.bounds[key, 1] and right[k] > 0.0)
        ]
        reach = self.reach(task)
        change = proposal.share * bounded_step(
            normal, right, -reach, reach, damping=proposal.damping, held=held
        )
        values = task.values.copy()
        free = list(task.free)
        values[free] = np.clip(
            values[free] + change[: len(free)], self.bounds[free, 0], self.bounds[free, 1]
        )
        deviations, at = {}, len(free)
        for c in task.cases:
            places = self.cases[c].start.free
            new = task.deviations[c].copy()
            new[places] += change[at : at + len(places)]
            deviations[c] = new
            at += len(places)
        return values, deviations


class Solver(CaseFitter):
    """Fit of a comparison: no prior on the parameters, finite differences tuned to the noise.

    Args:
        predictor: simulates the cases.
        iterations: most steps.
    """

    def __init__(self, predictor: Predictor, *, iterations: int) -> None:
        bounds = np.array([k.parameter.bounds for k in predictor.keys]).reshape(-1, 2)
        zero = np.zeros(len(bounds))
        super().__init__(
            predictor, predictor.cases, bounds, zero, zero, iterations=iterations, rule=RULE
        )
        self._steps: dict[int, float] = {}

    def weighted(self, case: int, predicted: dict[str, Floats]) -> Floats:
        """Whitened residuals of one case as one vector."""
        return whitened(self.cases[case], residuals(self.cases[case], predicted))

    def fit(self, values: Floats, *, free: Sequence[int]) -> FitTask:
        """Return the task that estimates the parameters ``free`` (indices) and all starts, solved.

        Args:
            values: parameters at the outset, shape (P,).
            free: parameters to estimate; the others are held.
        """
        for p in free:
            self._steps[p] = self._tuned(values, p)
        task = FitTask(free=tuple(free), cases=tuple(range(len(self.cases))), values=values.copy())
        self.begin([task])
        task.damping = RULE.start
        self.solve([task])
        return task

    def nudge(self, key: int) -> float:
        """Size of the finite difference of a key."""
        return self._steps[key]

    def _tuned(self, values: Floats, p: int) -> float:
        """Step that changes the samples little against the noise, yet far above rounding."""
        trial = 1e-4 * max(abs(float(values[p])), min(1.0, float(self.bounds[p, 1])))
        moved = values.copy()
        moved[p] += trial
        zero = [np.zeros_like(c.start.sigma) for c in self.cases]
        out = self.run([Job(i, d, v) for v in (values, moved) for i, d in enumerate(zero)])
        half = len(self.cases)
        change = [self.weighted(i, out[i]) - self.weighted(i, out[half + i]) for i in range(half)]
        size = float(np.sqrt(np.mean(np.concatenate(change) ** 2)))
        if not np.isfinite(size) or size == 0.0:
            return trial
        return float(np.clip(trial * _STEP_NORM / size, 1e-3 * trial, 1e3 * trial))

    def spreads(self, task: FitTask) -> tuple[Floats, list[Floats]]:
        """Return 1-sigma of the parameters, shape (P,), and of each case's start; 0 where held."""
        spread, at = self._spread(task), len(task.free)
        sigma, starts = np.zeros(len(task.values)), []
        sigma[list(task.free)] = spread[:at]
        for case in self.cases:
            own = np.zeros_like(case.start.sigma)
            own[case.start.free] = spread[at : at + len(case.start.free)]
            at += len(case.start.free)
            starts.append(own)
        return sigma, starts

    def _spread(self, task: FitTask) -> Floats:
        """Standard deviations of all unknowns from the curvature, scaled by the misfit."""
        if not task.linear:
            self.linearise([task])
        assert task.system is not None
        normal = task.system[0]
        samples = sum(int(np.isfinite(m).sum()) for c in self.cases for m in c.measured.values())
        covariance = np.linalg.pinv(normal) * task.cost / max(samples - normal.shape[0], 1)
        return np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def _reduced(normal: Floats, count: int) -> Floats:
    """Eliminate unknowns by the Schur complement, keeping the first ``count``.

    Example:
        >>> _reduced(np.array([[2.0, 1.0], [1.0, 1.0]]), 1)
        array([[1.]])
    """
    if normal.shape[0] == count:
        return normal
    rest = normal[count:, count:]
    cross = normal[count:, :count]
    return np.asarray(normal[:count, :count] - cross.T @ np.linalg.solve(rest, cross))
