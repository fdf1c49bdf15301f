"""Runs of an experiment prepared for batch simulation: cases, predictor, weights, fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seals.arrays import Floats
from seals.compare.case import Case
from seals.compare.predict import FitKey, Job, Predictor, residuals
from seals.compare.prediction_methods import cases_of, predictor_of, step_of
from seals.compare.settings import CompareSettings
from seals.compare.solve import CaseFitter, FitTask
from seals.effects.binding import bind_effects
from seals.errors import ConfigError
from seals.least_squares import LevenbergMarquardt
from seals.logs.log import Log
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.schema import Parameter as ParameterField
from seals.sysid.candidates.catalogue import candidates_of_runs
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.decision.policy import DecisionPolicy

INDEPENDENT = 40
"""Most samples of a channel in one run that are taken to err independently of each other."""
_OBSERVABLE = 0.05
"""Change of the readings, in units of the floor, below which a plausible effect is unobservable."""


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Runs of an experiment with stated model and candidate effects.

    Args:
        settings: of the recipe.
        candidate_set: stated model and candidates.
        cases: stretches, training ones and those that only judge.
        predictor: simulates jobs; a job's values follow ``names``.
        names: keys in the order of a job's values.
        fold: by training case, the part with which it is held out.
    """

    settings: CompareSettings
    candidate_set: CandidateSet
    cases: tuple[Case, ...]
    predictor: Predictor
    names: tuple[str, ...]
    fold: Mapping[int, int]

    @property
    def policy(self) -> DecisionPolicy:
        """Thresholds of the decisions."""
        return self.candidate_set.policy

    @property
    def train(self) -> tuple[int, ...]:
        """Indices of the training cases."""
        return tuple(k for k, c in enumerate(self.cases) if not c.held_out)

    @property
    def unseen(self) -> tuple[int, ...]:
        """Indices of the cases held out from all fits."""
        return tuple(k for k, c in enumerate(self.cases) if c.held_out)

    def parameter(self, index: int) -> Parameter:
        """Parameter of one index."""
        return self.candidate_set.parameters[self.names[index]]

    def nominal(self) -> Floats:
        """Values of the stated model."""
        return np.array([self.parameter(k).nominal for k in range(len(self.names))])

    def systematic(self, case: int) -> bool:
        """Return true if a systematic error, not noise, sets the floor of a fitted channel."""
        one, floor = self.cases[case], self.settings.naming.floor
        fitted = [c for c in one.measured if c not in self.settings.naming.judge]
        return any(float(floor.get(c, 0.0)) > float(one.sigma[c].min()) for c in fitted)

    def white(self, case: int, predicted: dict[str, Floats], *, judged: bool) -> dict[str, Floats]:
        """Residuals of one case in units of the noise floor, by channel, shape (rows, k)."""
        one = self.cases[case]
        judge = set(self.settings.naming.judge)
        parts = residuals(one, predicted)
        return {
            c: r / np.maximum(one.sigma[c], float(self.settings.naming.floor.get(c, 0.0)))
            for c, r in parts.items()
            if judged or c not in judge
        }

    def weighted(self, case: int, predicted: dict[str, Floats]) -> Floats:
        """Residuals of the fitted channels as one vector; correlated samples are weighted down."""
        rows = []
        for part in self.white(case, predicted, judged=False).values():
            count = max(int(np.isfinite(part).sum()), 1)
            share = float(np.sqrt(min(1.0, INDEPENDENT / count)))
            rows.append(share * np.nan_to_num(part).ravel())
        return np.concatenate(rows)


def prepare(settings: CompareSettings, logs: Sequence[Log]) -> Experiment:
    """Prepare runs for the fits; candidates that no channel observes are left out.

    Raises:
        LogError: nothing in the logs can be predicted.
        ConfigError: a name does not fit, or there is only one run.
    """
    own = settings.naming
    finer = replace(
        settings.compare,
        step=own.step or settings.compare.step,
        stride=own.stride or settings.compare.stride,
    )
    # an actuator is an effect like any other
    effects = {**settings.effects, **settings.actuators}
    settings = replace(settings, compare=finer, effects=effects)
    robot = build_robot(settings.robot)
    candidate_set = candidates_of_runs(settings, robot)
    given = cases_of(settings)(logs, settings, robot)
    if len(given) < 2:
        raise ConfigError(
            f"{len(given)} run is too few to name an effect: none can be held out.\n"
            "Give at least two, see train and held_out."
        )
    cases = (
        list(given)
        if sum(not c.held_out for c in given) >= 2
        else [replace(c, held_out=False) for c in given]
    )
    whole = _experiment(settings, robot, candidate_set, cases)
    kept, unobservable = _observable(whole)
    silent = {c.instance for c in candidate_set.candidates} - {c.instance for c in kept}
    effects = {
        n: e
        for n, e in candidate_set.effects.items()
        if n in candidate_set.nominal or n not in silent
    }
    less = replace(candidate_set, effects=effects, candidates=kept, unobservable=unobservable)
    return _experiment(settings, robot, less, cases)


def _experiment(
    settings: CompareSettings, robot: RobotModel, candidate_set: CandidateSet, cases: Sequence[Case]
) -> Experiment:
    free = [*candidate_set.tolerances, *(k for c in candidate_set.candidates for k in c.keys)]
    names = tuple(dict.fromkeys(free))
    keys = []
    for n in names:
        known = candidate_set.parameters[n]
        meta = ParameterField(
            unit=known.unit,
            bounds=known.bounds,
            tolerance=known.tolerance,
            relative=False,
            source="nominal",
            fit=True,
        )
        keys.append(FitKey(key=n, targets=(n,), parameter=meta, start=known.nominal))
    bound = bind_effects(candidate_set.effects, robot.links)
    step = settings.compare.step or step_of(cases)
    train = [k for k, c in enumerate(cases) if not c.held_out]
    parts = min(len(train), max(2, settings.naming.folds))
    return Experiment(
        settings=settings,
        candidate_set=candidate_set,
        cases=tuple(cases),
        predictor=predictor_of(settings)(settings, robot, bound, keys, cases, step=step),
        names=names,
        fold={case: k * parts // len(train) for k, case in enumerate(train)},
    )


def _observable(experiment: Experiment) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Divide candidates into observable and unobservable ones.

    Keys without influence, such as drag across a straight fall, are taken out of a candidate.
    """
    candidate_set = experiment.candidate_set
    used = sorted({k for c in candidate_set.candidates for k in c.keys})
    change = dict(zip(used, _changes(experiment, used), strict=True))
    kept, unobservable = [], []
    for c in candidate_set.candidates:
        keys = tuple(k for k in c.keys if change[k] > _OBSERVABLE)
        if keys:
            kept.append(replace(c, keys=keys))
        else:
            unobservable.append(c)
    return tuple(kept), tuple(unobservable)


def _changes(experiment: Experiment, keys: Sequence[str]) -> list[float]:
    """Change of the readings by a plausible size of each key, in units of the noise floor."""
    jobs, shares = [], []
    off = experiment.nominal()
    chosen = experiment.train[:: max(1, len(experiment.train) // 4)]
    still = {c: np.zeros_like(experiment.cases[c].start.sigma) for c in chosen}
    for name in keys:
        k = experiment.names.index(name)
        known = experiment.parameter(k)
        # where a fit sets out away from zero, the law has a corner there
        share = 1.0 if known.start != known.nominal else 1e-2
        step = share * known.scale
        values = off.copy()
        values[k] += -step if off[k] + step > known.bounds[1] else step
        jobs += [Job(c, still[c], values) for c in chosen]
        shares.append(share)
    found = iter(experiment.predictor.run([Job(c, still[c], off) for c in chosen] + jobs))
    base = {c: experiment.white(c, next(found), judged=True) for c in chosen}
    return [_size(experiment, base, found) / share for share in shares]


def _size(
    experiment: Experiment,
    base: Mapping[int, Mapping[str, Floats]],
    found: Iterator[dict[str, Floats]],
) -> float:
    rows = []
    for c, before in base.items():
        after = experiment.white(c, next(found), judged=True)
        rows += [np.nan_to_num(after[x] - before[x]).ravel() for x in before]
    size = float(np.sqrt(np.mean(np.concatenate(rows) ** 2)))
    return size if np.isfinite(size) else 0.0


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

    def nudge(self, key: int) -> float:
        """Size of the finite difference of a key."""
        step = float(_SHARE * self.scale[key])
        return max(step, _TICK) if self.experiment.names[key].endswith(".delay") else step

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
