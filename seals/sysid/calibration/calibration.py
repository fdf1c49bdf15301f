"""Calibration of robot parameters on one log or several, and its result as data."""

from __future__ import annotations

import fnmatch
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, suggestion
from seals.logs.log import Log
from seals.sound_numbers import refuse_undefined, trials
from seals.sysid.calibration.free_numbers import with_free_numbers
from seals.sysid.calibration.stated import StatedNumber, hull_of, stated_numbers
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.candidates.reported_values import NORMAL90
from seals.sysid.data.join import join_logs
from seals.sysid.data.robot_description import RobotDescription
from seals.sysid.data.vehicle import Vehicle
from seals.sysid.predictors.linearise import dynamics_along, predict
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.problem import (
    Problem,
    follow_measurements,
    linearise_model,
    prepare,
    refined,
    windows_of,
)
from seals.sysid.predictors.trajectory_cache import TrajectoryCache
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.held_out import held_out_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

PRIOR = 0.5
"""1-sigma of the prior of a number as a share of what is stated."""
_AT = 1e-6
"""Relative distance from a bound at which a number counts as held by it."""
_SHOWN = 8
"""Names that a refusal lists."""
ROUNDS = 8
"""Linearisations at most; numbers that are 50 % off take three or four."""
STAGES = ROUNDS + 2
"""Stages that a calibration tells of: the log, linearisations, the held-out log."""
_SETTLED = 0.1
"""Move of every number, in units of its 1-sigma, below which a calibration has settled."""


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Result of a calibration: estimates, uncertainties, correlations and held-out error.

    Args:
        problem: the logs made ready, with the numbers free.
        numbers: that were asked for.
        solution: of the fit.
        held_out: misfit per degree of freedom on measurements that the fit did not see: ``before``,
            ``after`` and ``noise_floor``.
        unseen: whether these are of a log of their own, not of parts left out in turn.
        seconds: that it took.
        source: path and checksum of the logs, when they came from files.
        given: words of the command line that gave logs and robot.
    """

    problem: Problem
    numbers: tuple[StatedNumber, ...]
    solution: Solution
    held_out: Mapping[str, float]
    unseen: bool
    seconds: float
    source: Mapping[str, Any] = field(default_factory=dict)
    given: str = ""

    def value(self, number: StatedNumber) -> float:
        """Return the calibrated value of a number."""
        return number.number(float(self.solution.fit.values[number.key]))

    @property
    def widening(self) -> float:
        """Factor by which all standard deviations are widened for a misfit above noise, at least 1.

        Equation:
            sqrt(max(1, misfit per degree of freedom)), on the fitted and on the unseen rows.
        """
        fit, windows = self.solution.fit, self.solution.fitter.windows
        seen = float(fit.misfit.sum()) / windows.observed
        return float(np.sqrt(max(1.0, seen, self.held_out["after"])))

    def sigma(self, number: StatedNumber) -> float:
        """Return the 1-sigma of a number in its unit, at most that of the prior.

        It is the larger one of two: the posterior widened by the misfit, and the scatter of the
        windows.
        """
        fit = self.solution.fit
        spread = max(self.widening * fit.spread(number.key), fit.robust_spread(number.key))
        return abs(number.slope) * float(min(spread, self._prior(number)))

    def prior(self, number: StatedNumber) -> float:
        """Return the 1-sigma of the prior of a number in its unit."""
        return abs(number.slope) * self._prior(number)

    def _prior(self, number: StatedNumber) -> float:
        k = self.solution.fit.keys.index(number.key)
        return float(1.0 / np.sqrt(self.solution.fit.precision[k]))

    def interval(self, number: StatedNumber) -> tuple[float, float]:
        """Return the ends of the 90 % interval of a number, inside its bounds."""
        value, half = self.value(number), NORMAL90 * self.sigma(number)
        low, high = number.bounds
        return max(value - half, low), min(value + half, high)

    def determined(self, number: StatedNumber) -> bool:
        """Return true if the logs narrow the prior of a number enough to determine it."""
        return self.sigma(number) < self.problem.policy.undetermined * self.prior(number)

    def at_bound(self, number: StatedNumber) -> bool:
        """Return true if the estimate of a number lies beyond its allowed range."""
        change = self.solution.fit.values[number.key]
        ends = [number.change(bound) for bound in number.bounds if math.isfinite(bound)]
        return any(math.isclose(change, end, rel_tol=_AT) for end in ends)

    @property
    def correlation(self) -> Floats:
        """Posterior correlation of the numbers, shape (n, n)."""
        fit = self.solution.fit
        at = [fit.keys.index(n.key) for n in self.numbers]
        signs = np.sign([n.slope for n in self.numbers])
        covariance = fit.covariance[np.ix_(at, at)] * signs[:, None] * signs[None, :]
        size = np.sqrt(np.diag(covariance))
        return covariance / size[:, None] / size[None, :]

    def tied(self) -> list[tuple[str, str, float]]:
        """Return strongly correlated pairs of numbers and their correlation, strongest first."""
        found, table = [], self.correlation
        for i, one in enumerate(self.numbers):
            for j, other in enumerate(self.numbers[:i]):
                if abs(table[i, j]) > self.problem.policy.tied:
                    found.append((other.name, one.name, float(table[i, j])))
        return sorted(found, key=lambda pair: -abs(pair[2]))

    def to_dict(self) -> dict[str, Any]:
        """Return the calibration in the form of ``calibration.json``."""
        names = [n.name for n in self.numbers]
        return {
            "parameters": {n.name: self._written(n) for n in self.numbers},
            "held_out_ratio": self.held_out["after"] / self.held_out["noise_floor"],
            "held_out_error": {**self.held_out, "unseen_log": self.unseen},
            "widening": self.widening,
            "correlation": {
                a: {b: float(self.correlation[i, j]) for j, b in enumerate(names)}
                for i, a in enumerate(names)
            },
            "undetermined": [n.name for n in self.numbers if not self.determined(n)],
            "linearisations": self.solution.rounds,
            "settled": self.solution.settled,
            "log": dict(self.source),
            "seconds": self.seconds,
        }

    def _written(self, number: StatedNumber) -> dict[str, Any]:
        low, high = self.interval(number)
        return {
            "value": self.value(number),
            "low90": low,
            "high90": high,
            "unit": number.unit,
            "stated": number.value,
            "determined": self.determined(number),
        }


@trials()
def calibrated(
    logs: Log | Sequence[Log],
    parameters: Sequence[str],
    *,
    robot: RobotDescription | None = None,
    held_out: Log | None = None,
    prior: float = PRIOR,
    tell: Callable[[int], None] = lambda done: None,
) -> Calibration:
    """Estimate numbers of a stated model from logs; all others stay within their tolerances.

    Args:
        logs: one log or several of one vehicle, fitted together.
        parameters: names of the numbers, groups of them, or patterns with ``*``.
        robot: of a robot folder; left out, the metadata describe the vehicle.
        held_out: another log of the vehicle, not fitted.
        prior: 1-sigma of what is asked for, as a share of what is stated.
        tell: takes the number of stages done, of `STAGES`.

    Raises:
        ConfigError: a name means none of the vehicle's numbers.
        LogError: a log cannot be used, or the logs do not belong together.
    """
    begin = time.perf_counter()
    numbers: list[StatedNumber] = []
    hull = hull_of(robot)

    def free(vehicle: Vehicle, candidate_set: CandidateSet) -> CandidateSet:
        every = stated_numbers(vehicle, candidate_set, hull=hull)
        numbers[:] = chosen(parameters, every)
        base = vehicle.robot.links[0]
        return with_free_numbers(
            candidate_set, numbers, others=every.values(), base=base, share=prior
        )

    problem = prepare(join_logs(logs), robot=robot, free=free)
    tell(1)
    solution = solve(problem, [n.key for n in numbers], tell=lambda done: tell(1 + done))
    values = dict(solution.fit.values)
    stated = {**values, **{n.key: 0.0 for n in numbers}}
    if held_out is None:
        fit, fitter = solution.fit, solution.fitter
        found = EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=0.0)
        before, after = fitter.windows.level(fitter.prediction(stated)), held_out_misfit(found)
    else:
        other = prepare(held_out, robot=robot, free=free)
        before, after = _unseen_misfit(other, [stated, values], at=values)
    refuse_undefined("calibration", [before, after, *(values[n.key] for n in numbers)])
    tell(STAGES)
    return Calibration(
        problem=problem,
        numbers=tuple(numbers),
        solution=solution,
        held_out={"before": before, "after": after, "noise_floor": 1.0},
        unseen=held_out is not None,
        seconds=time.perf_counter() - begin,
    )


def score_on(found: Calibration, log: Log, *, robot: RobotDescription | None = None) -> float:
    """Return the misfit per degree of freedom that a calibrated model leaves of another log.

    Args:
        found: the calibration.
        log: of the same vehicle.
        robot: of its robot folder; left out, the metadata describe the vehicle.

    Raises:
        LogError: the log cannot be used.
    """
    parameters = found.problem.plant.candidate_set.parameters
    problem = prepare(
        log, robot=robot, free=lambda vehicle, own: replace(own, parameters=parameters)
    )
    values = found.solution.fit.values
    return _unseen_misfit(problem, [values], at=values)[0]


def _unseen_misfit(
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
    return [windows.level(predict(plant, trajectory, values, cache=cache)) for values in models]


def chosen(asked: Sequence[str], offered: Mapping[str, StatedNumber]) -> tuple[StatedNumber, ...]:
    """Return the selected numbers, each once, in the requested order.

    A name is one of a number, of a group (``inertia`` for its three axes, ``effects.water_drag``
    for all of its fields), or a pattern with ``*``.

    Args:
        asked: names, groups or patterns.
        offered: numbers of the vehicle by name.

    Raises:
        ConfigError: nothing is asked for, or a name means none of the numbers.
    """
    if not asked:
        shown = [n for n, number in offered.items() if number.offered]
        more = f" and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
        raise ConfigError(
            "parameters is not given.\n"
            f"Name the parameters to calibrate, for instance parameters=[{','.join(shown[:3])}]; "
            f"this vehicle has {', '.join(shown[:_SHOWN])}{more}"
        )
    found: dict[str, StatedNumber] = {}
    for name in asked:
        for one in _meant(str(name), offered):
            found.setdefault(one.name, one)
    return tuple(found.values())


def _meant(name: str, offered: Mapping[str, StatedNumber]) -> list[StatedNumber]:
    if name in offered:
        return [offered[name]]
    if any(c in name for c in "*?["):
        meant = [n for k, n in offered.items() if n.offered and fnmatch.fnmatchcase(k, name)]
    else:
        heads = (f"{name}.", f"{name}_")
        meant = [n for k, n in offered.items() if n.offered and k.startswith(heads)]
    if not meant:
        raise ConfigError(
            f"parameters: '{name}' is not a parameter that a log of this vehicle can determine.\n"
            f"{suggestion(name, offered)}"
        )
    return meant


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
    """Fit the requested parameters and all tolerances, relinearising until the fit converges.

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
