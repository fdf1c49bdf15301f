"""Many least-squares problems in step: the jobs of all of them are simulated in one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Start
from seals.compare.predict import Job
from seals.rivals.problem import Experiment

_START_STEP = 1e-4
_SHARE = 1e-3
"""Finite difference of a key, as a share of its plausible size."""
_TICK = 2e-3
"""The same of a delay, over a few rows of the commands, which are held in between [s]."""
_LOOSE = 30.0
"""Prior of a candidate's key, in plausible sizes: wide, so that the data decide."""
_SETTLED = 1e-3
BATCH = 1500
"""Most simulations at a time."""


@dataclass(kw_only=True)
class Task:
    """One problem: which keys are free, and on which runs; the solver fills in the rest.

    Args:
        free: indices of the free keys.
        cases: indices of the runs.
        values: of all keys.
        deviations: of the starts, by run.
        predicted: samples of the model, by run.
        cost: weighted squares with priors.
        normal: curvature of the free keys once the starts are eliminated.
        steps: taken so far.
    """

    free: tuple[int, ...]
    cases: tuple[int, ...]
    values: Floats
    deviations: dict[int, Floats] = field(default_factory=dict)
    predicted: dict[int, dict[str, Floats]] = field(default_factory=dict)
    cost: float = np.inf
    normal: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    steps: int = 0
    done: bool = False
    damping: float = 1e-3
    _system: tuple[Floats, Floats] | None = None

    def spread(self, experiment: Experiment) -> Floats:
        """Standard deviations of the free keys, scaled by the misfit."""
        if not self.free:
            return np.zeros(0)
        samples = sum(len(experiment.weighted(c, self.predicted[c])) for c in self.cases)
        count = min(samples, 40 * len(self.cases)) - len(self.free)
        grow = max(self.cost / max(count, 1), 1.0)
        return np.sqrt(np.maximum(np.diag(np.linalg.pinv(self.normal)) * grow, 0.0))


class Lockstep:
    """Damped Gauss-Newton over many tasks in step.

    Args:
        experiment: runs and model.
        iterations: most steps.
    """

    def __init__(self, experiment: Experiment, *, iterations: int = 10) -> None:
        """Keep the parts."""
        self.experiment, self.iterations = experiment, iterations
        keys = [experiment.key(k) for k in range(len(experiment.names))]
        self.centre = np.array([k.off for k in keys])
        wide = np.array([k.tolerance or _LOOSE * k.scale for k in keys])
        self.precision = 1.0 / np.maximum(wide, 1e-30) ** 2
        self.scale = np.array([k.scale for k in keys])
        self.bounds = np.array([k.bounds for k in keys]).reshape(-1, 2)

    def solve(self, tasks: Sequence[Task], *, most: int | None = None) -> None:
        """Solve all tasks in place, in at most ``most`` steps."""
        for task in tasks:
            for c in task.cases:
                task.deviations.setdefault(c, np.zeros_like(self._start(c).sigma))
        self._evaluate(tasks, [(t.values, t.deviations) for t in tasks])
        for task in tasks:
            task.done = False
        for _ in range(most or self.iterations):
            active = [t for t in tasks if not t.done and self._unknowns(t)]
            if not active:
                break
            self._linearise([t for t in active if t._system is None])
            self._evaluate(active, [self._moved(t) for t in active])

    def _start(self, case: int) -> Start:
        return self.experiment.cases[case].start

    def _unknowns(self, task: Task) -> int:
        return len(task.free) + sum(len(self._start(c).free) for c in task.cases)

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Floats]]:
        """Simulate jobs in batches."""
        out: list[dict[str, Floats]] = []
        for k in range(0, len(jobs), BATCH):
            out += self.experiment.predictor.run(jobs[k : k + BATCH])
        return out

    def _evaluate(
        self, tasks: Sequence[Task], trials: Sequence[tuple[Floats, dict[int, Floats]]]
    ) -> None:
        """Simulate trials and keep those that are better."""
        jobs = [
            Job(c, trial[1][c], trial[0])
            for t, trial in zip(tasks, trials, strict=True)
            for c in t.cases
        ]
        found = iter(self.run(jobs))
        for task, (values, deviations) in zip(tasks, trials, strict=True):
            predicted = {c: next(found) for c in task.cases}
            cost = self._cost(task, values, deviations, predicted)
            if not np.isfinite(task.cost) or cost < task.cost:
                gain = (task.cost - cost) / max(cost, 1e-12) if np.isfinite(task.cost) else np.inf
                task.values, task.deviations = values, deviations
                task.predicted, task.cost = predicted, cost
                task.damping = max(task.damping / 10.0, 1e-9)
                task._system, task.steps = None, task.steps + 1
                task.done = bool(gain < _SETTLED)
            else:
                task.damping *= 10.0
                task.done = bool(task.damping > 1e5)

    def _cost(
        self,
        task: Task,
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

    def _linearise(self, tasks: Sequence[Task]) -> None:
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
            t._system = self._system(t, [next(found) for _ in range(self._columns(t))])

    def _columns(self, task: Task) -> int:
        return sum(len(task.free) + len(self._start(c).free) for c in task.cases)

    def _step(self, key: int, value: float) -> float:
        """Finite difference of a key, away from its upper bound."""
        step = _SHARE * self.scale[key]
        if self.experiment.names[key].endswith(".delay"):
            step = max(step, _TICK)
        return float(-step if value + step > self.bounds[key, 1] else step)

    def _system(self, task: Task, moved: list[dict[str, Floats]]) -> tuple[Floats, Floats]:
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

    def _moved(self, task: Task) -> tuple[Floats, dict[int, Floats]]:
        """One damped step within the bounds."""
        assert task._system is not None
        normal, right = task._system
        held = {
            k
            for k, key in enumerate(task.free)
            if (task.values[key] <= self.bounds[key, 0] and right[k] < 0.0)
            or (task.values[key] >= self.bounds[key, 1] and right[k] > 0.0)
        }
        keep = [k for k in range(len(right)) if k not in held]
        matrix = normal[np.ix_(keep, keep)].copy()
        diagonal = np.maximum(np.diag(matrix).copy(), 1e-30)
        size = np.sqrt(diagonal)
        scaled = matrix / size[:, None] / size[None, :]
        scaled[np.diag_indices_from(scaled)] += task.damping + 1e-12
        change = np.zeros(len(right))
        change[keep] = np.linalg.solve(scaled, right[keep] / size) / size
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
    """Schur complement of the first ``count`` unknowns.

    Example:
        >>> reduced(np.array([[2.0, 1.0], [1.0, 1.0]]), 1)
        array([[1.]])
    """
    if normal.shape[0] == count:
        return normal
    rest = normal[count:, count:]
    cross = normal[count:, :count]
    return np.asarray(normal[:count, :count] - cross.T @ np.linalg.solve(rest, cross))
