"""Damped Gauss-Newton for many least-squares problems, simulated together in batches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Start
from seals.compare.predict import Job
from seals.sysid.predictors.batch import Experiment

_START_STEP = 1e-4
_SHARE = 1e-3
"""Finite difference of a key, as a share of its plausible size."""
_TICK = 2e-3
"""The same of a delay, over a few rows of the commands, which are held in between [s]."""
_LOOSE = 30.0
"""Prior of a candidate's key, in plausible sizes: wide, so that the data decide."""
_DAMPING = 1e-3
_SETTLED = 1e-4
"""Relative gain of a step below which a fit has settled: long valleys gain little at a time."""
_SHORTER = 0.4
_REACH = 0.7
_TRIALS = 2
"""Trials for every step that may be taken."""
BATCH = 1500
"""Most simulations at a time."""


@dataclass(kw_only=True)
class FitTask:
    """Least-squares problem: free keys and runs; the solver fills in the rest.

    Args:
        free: indices of the free keys.
        cases: indices of the runs.
        values: of all keys.
        deviations: of the starts, by run.
        predicted: samples of the model, by run.
        cost: weighted squares with priors.
        normal: curvature of the free keys once the starts are eliminated.
        steps: taken so far.
        done: whether it has settled.
        damping: of the next step, as a share of the curvature.
        refused: trials since the last step that was kept.
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
    damping: float = _DAMPING
    refused: int = 0
    _system: tuple[Floats, Floats] | None = None

    def spread(self, experiment: Experiment) -> Floats:
        """Standard deviations of the free keys, scaled by the misfit."""
        if not self.free:
            return np.zeros(0)
        samples = sum(len(experiment.weighted(c, self.predicted[c])) for c in self.cases)
        count = min(samples, 40 * len(self.cases)) - len(self.free)
        grow = max(self.cost / max(count, 1), 1.0)
        return np.sqrt(np.maximum(np.diag(np.linalg.pinv(self.normal)) * grow, 0.0))


Tell = Callable[[float], None]
Trial = tuple[Floats, dict[int, Floats]]
"""Values of all keys, and deviations of the starts by run."""


def _update_damping(task: FitTask, before: float) -> None:
    """Update damping and progress after trials; ``before`` is the cost that they had to beat."""
    if task.cost < before:
        gain = (before - task.cost) / max(task.cost, 1e-12)
        # after a refusal the damping has just become right
        task.damping = max(task.damping / (2.0 if task.refused else 10.0), 1e-9)
        task._system, task.steps, task.refused = None, task.steps + 1, 0
        task.done = bool(gain < _SETTLED)
    else:
        task.damping *= 10.0
        task.refused += 1
        task.done = bool(task.damping > 1e5)


class BatchedLeastSquares:
    """Damped Gauss-Newton over many tasks in parallel.

    Args:
        experiment: runs and model.
        iterations: most steps.
    """

    def __init__(self, experiment: Experiment, *, iterations: int = 10) -> None:
        """Keep the parts."""
        self.experiment, self.iterations = experiment, iterations
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
        """Solve all tasks in place, in at most ``most`` steps; ``tell`` takes the share done."""
        for task in tasks:
            for c in task.cases:
                task.deviations.setdefault(c, np.zeros_like(self._start(c).sigma))
        fresh = [t for t in tasks if not t.predicted]
        self._evaluate(fresh, [[(t.values, t.deviations)] for t in fresh])
        for task in tasks:
            task.done = False
        limit = most or self.iterations
        most_steps = {id(t): t.steps + limit for t in tasks}
        # a step that is taken back costs one simulation only and does not count
        for _ in range(_TRIALS * limit):
            active = [
                t for t in tasks if not t.done and t.steps < most_steps[id(t)] and self._unknowns(t)
            ]
            if not active:
                break
            if tell is not None:
                tell(1.0 - len(active) / len(tasks))
            self._linearise([t for t in active if t._system is None])
            self._evaluate(active, [self._trials(t) for t in active])

    def nearest(self, tasks: Sequence[FitTask]) -> FitTask:
        """Return the task whose start is closest to the measurements."""
        for task in tasks:
            for c in task.cases:
                task.deviations.setdefault(c, np.zeros_like(self._start(c).sigma))
        self._evaluate(tasks, [[(t.values, t.deviations)] for t in tasks])
        for task in tasks:
            task.steps, task.refused, task.damping = 0, 0, _DAMPING
        return min(tasks, key=lambda t: t.cost)

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

    def _evaluate(self, tasks: Sequence[FitTask], trials: Sequence[Sequence[Trial]]) -> None:
        """Simulate trials, one or two a task, and keep the best one where it is better."""
        jobs = [
            Job(c, deviations[c], values)
            for t, row in zip(tasks, trials, strict=True)
            for values, deviations in row
            for c in t.cases
        ]
        found = iter(self.run(jobs))
        for task, row in zip(tasks, trials, strict=True):
            before = task.cost
            for values, deviations in row:
                predicted = {c: next(found) for c in task.cases}
                cost = self._cost(task, values, deviations, predicted)
                if cost < task.cost:
                    task.values, task.deviations = values, deviations
                    task.predicted, task.cost = predicted, cost
            _update_damping(task, before)

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

    def _linearise(self, tasks: Sequence[FitTask]) -> None:
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

    def _trials(self, task: FitTask) -> list[Trial]:
        """Propose the damped step; after a refusal also a share of the undamped one.

        Along a bent valley damping shortens the way along it far more than is needed.
        """
        out = [self._moved(task, task.damping, 1.0)]
        if task.refused:
            out.append(self._moved(task, 0.0, _SHORTER**task.refused))
        return out

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

    def _moved(self, task: FitTask, damping: float, share: float) -> Trial:
        """One step within the bounds."""
        assert task._system is not None
        normal, right = task._system
        held = {
            k
            for k, key in enumerate(task.free)
            if (task.values[key] <= self.bounds[key, 0] and right[k] < 0.0)
            or (task.values[key] >= self.bounds[key, 1] and right[k] > 0.0)
        }
        change = share * limited_step(normal, right, self._reach(task), held, damping)
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


def limited_step(
    normal: Floats, right: Floats, reach: Floats, held: set[int], damping: float
) -> Floats:
    """Compute a damped least-squares step within a trust region; ``held`` unknowns stay.

    Example:
        >>> limited_step(np.diag([1.0, 4.0]), np.ones(2), np.array([0.5, 9.0]), set(), 0.0)
        array([0.5 , 0.25])
    """
    size = np.sqrt(np.maximum(np.diag(normal), 1e-30))
    scaled = normal / size[:, None] / size[None, :]
    scaled[np.diag_indices_from(scaled)] += damping + 1e-12
    change = np.zeros(len(right))
    fixed = set(held)
    while len(fixed) < len(right):
        keep = [k for k in range(len(right)) if k not in fixed]
        rest = sorted(fixed)
        known = right / size - scaled[:, rest] @ (change * size)[rest]
        change[keep] = np.linalg.solve(scaled[np.ix_(keep, keep)], known[keep]) / size[keep]
        far = [k for k in keep if abs(change[k]) > reach[k]]
        if not far:
            break
        change[far] = np.clip(change[far], -reach[far], reach[far])
        fixed |= set(far)
    return change


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
