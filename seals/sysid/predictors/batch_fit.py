"""Parameter fits to several runs; all fits are simulated in one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Start
from seals.compare.predict import Job
from seals.least_squares import Iterate, LevenbergMarquardt, Proposal, Tell, minimise, settle
from seals.sysid.predictors.batch import Experiment
from seals.sysid.predictors.normal_equations import bounded_step

_START_STEP = 1e-4
_SHARE = 1e-3
"""Finite difference of a key, as a share of its plausible size."""
_TICK = 2e-3
"""The same of a delay, over a few rows of the commands, which are held in between [s]."""
_LOOSE = 30.0
"""Prior of a candidate's key, in plausible sizes: wide, so that the data decide."""
_REACH = 0.7
"""Longest step of a key that sets out away from its nominal value, as a share of its change."""
BATCH = 1500
"""Most simulations at a time."""


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

    def spread(self, experiment: Experiment) -> Floats:
        """Standard deviations of the free keys, scaled by the misfit."""
        if not self.free:
            return np.zeros(0)
        samples = sum(len(experiment.weighted(c, self.predicted[c])) for c in self.cases)
        count = min(samples, 40 * len(self.cases)) - len(self.free)
        grow = max(self.cost / max(count, 1), 1.0)
        return np.sqrt(np.maximum(np.diag(np.linalg.pinv(self.normal)) * grow, 0.0))


class Point(NamedTuple):
    """Parameter values and start deviations of a fit, with the predicted channels."""

    cost: float
    values: Floats
    deviations: dict[int, Floats]
    predicted: dict[int, dict[str, Floats]]


Trial = tuple[Floats, dict[int, Floats]]
"""Values of all keys, and deviations of the starts by run."""


class RunFitter:
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
        self.experiment, self.iterations = experiment, iterations
        self.rule = rule or LevenbergMarquardt()
        keys = [experiment.parameter(k) for k in range(len(experiment.names))]
        self.centre = np.array([k.nominal for k in keys])
        wide = np.array([k.tolerance or _LOOSE * k.scale for k in keys])
        self.precision = 1.0 / np.maximum(wide, 1e-30) ** 2
        self.scale = np.array([k.scale for k in keys])
        self.kicked = np.array([k.start != k.nominal for k in keys])
        self.bounds = np.array([k.bounds for k in keys]).reshape(-1, 2)

    def solve(
        self, tasks: Sequence[FitTask], *, most: int | None = None, tell: Tell | None = None
    ) -> None:
        """Solve all tasks in place, in at most ``most`` steps; ``tell`` receives the progress."""
        self._begin([t for t in tasks if not t.predicted])
        for task in tasks:
            task.done = not self._unknowns(task)
        minimise(self, tasks, self.rule, steps=most or self.iterations, tell=tell)

    def nearest(self, tasks: Sequence[FitTask]) -> FitTask:
        """Return the task whose start is closest to the measurements."""
        self._begin(tasks)
        for task in tasks:
            task.steps, task.refused, task.damping = 0, 0, self.rule.start
        return min(tasks, key=lambda t: t.cost)

    def _begin(self, tasks: Sequence[FitTask]) -> None:
        """Evaluate tasks at their starting values."""
        for task in tasks:
            for c in task.cases:
                task.deviations.setdefault(c, np.zeros_like(self._start(c).sigma))
        found = self._simulated(tasks, [[(t.values, t.deviations)] for t in tasks])
        settle(self, tasks, found, self.rule)

    def _start(self, case: int) -> Start:
        return self.experiment.cases[case].start

    def _unknowns(self, task: FitTask) -> int:
        return len(task.free) + sum(len(self._start(c).free) for c in task.cases)

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Simulate jobs in batches."""
        out: list[dict[str, Floats]] = []
        for k in range(0, len(jobs), BATCH):
            out += self.experiment.predictor.run(jobs[k : k + BATCH])
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
            r = self.experiment.weighted(c, predicted[c])
            start = self._start(c)
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
                    values[k] += self._step(k, values[k])
                    jobs.append(Job(c, t.deviations[c], values))
                for s in self._start(c).free:
                    deviation = t.deviations[c].copy()
                    deviation[s] += _START_STEP
                    jobs.append(Job(c, deviation, t.values))
        found = iter(self.run(jobs))
        for t in tasks:
            t.system = self._system(t, [next(found) for _ in range(self._columns(t))])
            t.linear = True

    def _columns(self, task: FitTask) -> int:
        return sum(len(task.free) + len(self._start(c).free) for c in task.cases)

    def _step(self, key: int, value: float) -> float:
        """Finite difference of a key, away from its upper bound."""
        step = _SHARE * self.scale[key]
        if self.experiment.names[key].endswith(".delay"):
            step = max(step, _TICK)
        return float(-step if value + step > self.bounds[key, 1] else step)

    def _system(self, task: FitTask, moved: list[dict[str, Floats]]) -> tuple[Floats, Floats]:
        """Normal matrix and gradient of all unknowns: the free keys, then the starts run by run."""
        p, total = len(task.free), self._unknowns(task)
        normal, right = np.zeros((total, total)), np.zeros(total)
        free = list(task.free)
        normal[range(p), range(p)] += self.precision[free]
        right[:p] -= self.precision[free] * (task.values[free] - self.centre[free])
        at, used = p, 0
        for c in task.cases:
            start = self._start(c)
            base = self.experiment.weighted(c, task.predicted[c])
            steps = [self._step(k, task.values[k]) for k in free]
            steps += [_START_STEP] * len(start.free)
            rows = moved[used : used + len(steps)]
            used += len(steps)
            columns = (
                np.stack(
                    [
                        (base - self.experiment.weighted(c, m)) / h
                        for m, h in zip(rows, steps, strict=True)
                    ],
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
        task.normal = reduced(normal, p)
        return np.nan_to_num(normal), np.nan_to_num(right)

    def _reach(self, task: FitTask) -> Floats:
        """Longest step of every unknown.

        Keys that set out away from zero bend strongly: their step is a share of what they are.
        """
        out = np.full(self._unknowns(task), np.inf)
        for place, k in enumerate(task.free):
            if self.kicked[k]:
                size = abs(task.values[k] - self.centre[k])
                out[place] = max(_REACH * size, 0.5 * self.scale[k])
        return out

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
        reach = self._reach(task)
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
            places = self._start(c).free
            new = task.deviations[c].copy()
            new[places] += change[at : at + len(places)]
            deviations[c] = new
            at += len(places)
        return values, deviations


def reduced(normal: Floats, count: int) -> Floats:
    """Eliminate unknowns by the Schur complement, keeping the first ``count``.

    Example:
        >>> reduced(np.array([[2.0, 1.0], [1.0, 1.0]]), 1)
        array([[1.]])
    """
    if normal.shape[0] == count:
        return normal
    rest = normal[count:, count:]
    cross = normal[count:, :count]
    return np.asarray(normal[:count, :count] - cross.T @ np.linalg.solve(rest, cross))
