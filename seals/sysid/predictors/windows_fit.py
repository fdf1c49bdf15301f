"""Fit of parameters to the windows of a log by damped Gauss-Newton, with priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.least_squares import Backtracking, Iterate, Proposal, minimise
from seals.sysid.candidates.parameters import Candidate, CandidateSet, prior_widths
from seals.sysid.data.trajectory import Trajectory
from seals.sysid.predictors.extended_model import ExtendedModel
from seals.sysid.predictors.linearise import (
    Columns,
    Dynamics,
    Prediction,
    ReleasableDynamics,
    columns_along,
    dynamics_of,
    predict,
)
from seals.sysid.predictors.normal_equations import Fit, newton_step, reserve
from seals.sysid.predictors.tempering import approached
from seals.sysid.predictors.trajectory_cache import ExpansionPoint, TrajectoryCache
from seals.sysid.predictors.whitened import Whitened
from seals.sysid.predictors.windows import BLOCK, Windows

_AGAIN = 2
"""Times that a fit is repeated about exact steps at its own values."""
_SMALL = 0.3
"""Change of the cost at which a fit stops."""
_ROUGH = 1e-2
"""Share of the excess misfit that a step must gain about an expansion point that will move."""
_ROUNDING = 1e-6
"""Share of the largest misfit of a window by which rounding may put another below zero."""
WIDE = 1.5
"""Prior width of a free parameter in units of its plausible size."""


class WhitenedResiduals(NamedTuple):
    """Whitened residuals of a model in some windows.

    Args:
        windows: that saw it.
        misfit: of the model.
        columns: responses of the free parameters; None without any.
    """

    windows: Windows
    misfit: Whitened
    columns: Whitened | None


class Fitter:
    """Fitter of parameters to the windows of a linearised log.

    Args:
        plant: extended model.
        trajectory: about which the model is linear.
        dynamics: derivatives along the trajectory.
        windows: of the log.
        at: parameters of the linearisation of the tolerances.
        columns: responses of the tolerances, when they are known.
        cache: the plant along the trajectory, when it is known; it saves exact steps: those of a
            fit are taken where it starts and where it ends.
        fixed: whitened responses of the tolerances, when they are known.
        square: their products with each other, when they are known.
    """

    def __init__(
        self,
        plant: ExtendedModel,
        trajectory: Trajectory,
        dynamics: Dynamics | ReleasableDynamics,
        windows: Windows,
        *,
        at: Mapping[str, float] | None = None,
        columns: Columns | None = None,
        cache: TrajectoryCache | None = None,
        fixed: Whitened | None = None,
        square: Floats | None = None,
    ) -> None:
        self.plant, self.trajectory, self.windows = plant, trajectory, windows
        self.along, self.cache = dynamics, cache
        self.candidate_set: CandidateSet = plant.candidate_set
        self.tolerances = self.candidate_set.tolerances
        self.at = dict(at or {})
        if columns is not None:
            self.columns = columns
        if fixed is not None:
            self.fixed = fixed
        if square is not None:
            self._square = square

    @property
    def dynamics(self) -> Dynamics:
        """Derivatives along the trajectory."""
        return dynamics_of(self.along)

    @cached_property
    def columns(self) -> Columns:
        """Responses of the tolerances, row by row."""
        return self.columns_at(self.tolerances, self.at)

    def release(self) -> None:
        """Release the memory of this linearisation; it is computed again on demand.

        Rows, readings and weights of the windows stay. One that cannot be computed again is kept.
        """
        if isinstance(self.along, Dynamics):
            return
        self.along.release()
        self.windows.release()
        if self.cache is not None:
            self.cache.release()
        for name in ("columns", "fixed", "_square"):
            self.__dict__.pop(name, None)

    @cached_property
    def fixed(self) -> Whitened:
        """Whitened responses of the tolerances."""
        return self.windows.whiten(self.windows.responses(self.columns))

    @cached_property
    def _square(self) -> Floats:
        """Inner products of `fixed`, shape (W, p, p)."""
        return self.fixed.product(self.fixed)

    def prepare(self) -> None:
        """Compute what all fits share: once, before processes part."""
        _ = self._square

    def with_windows(self, windows: Windows) -> Fitter:
        """Return the same linearisation in other windows."""
        return Fitter(
            self.plant,
            self.trajectory,
            self.along,
            windows,
            at=self.at,
            columns=self.columns,
            cache=self.cache,
            fixed=windows.rewhitened(self.fixed) if windows.shares_outputs(self.windows) else None,
        )

    def acting(self, candidates: Sequence[Candidate]) -> Fitter:
        """Return the fitter with some effects restricted to their active times."""
        plant = self.plant.acting(candidates)
        if plant is self.plant:
            return self
        return Fitter(
            plant,
            self.trajectory,
            self.along,
            self.windows,
            at=self.at,
            columns=self.columns,
            cache=None if self.cache is None else self.cache.acting(plant),
            fixed=self.fixed,
            square=self._square,
        )

    def columns_at(self, keys: Sequence[str], values: Mapping[str, float]) -> Columns:
        """Return the derivatives by parameters at given values, row by row."""
        return columns_along(
            self.plant,
            self.trajectory,
            values,
            keys,
            self.dynamics,
            delay=self.windows.delay,
            cache=self.cache,
        )

    def whitened(self, keys: Sequence[str], values: Mapping[str, float]) -> Whitened:
        """Whitened responses of parameters at given values, in groups to limit the memory."""
        out = self.windows.responses(self.columns_at(keys[:BLOCK], values))
        if len(keys) > BLOCK:
            first, out = out, np.empty((*out.shape[:2], len(keys)))
            out[:, :, :BLOCK] = first
        for k in range(BLOCK, len(keys), BLOCK):
            block = keys[k : k + BLOCK]
            out[:, :, k : k + BLOCK] = self.windows.responses(self.columns_at(block, values))
        return self.windows.whiten(out)

    def misfit(
        self, values: Mapping[str, float], expansion_point: ExpansionPoint | None = None
    ) -> Whitened:
        """Whitened misfit of the model at given values, see `prediction`."""
        return self.windows.missed(self.prediction(values, expansion_point))

    def prediction(
        self, values: Mapping[str, float], expansion_point: ExpansionPoint | None = None
    ) -> Prediction:
        """One-step prediction of the model at given values, see `predict`."""
        return predict(
            self.plant,
            self.trajectory,
            values,
            delay=self.windows.delay,
            cache=self.cache,
            expansion_point=expansion_point,
            dynamics=self.dynamics,
        )

    def _expansion_point(self, values: Mapping[str, float]) -> ExpansionPoint | None:
        """Exact steps at some values, where the plant along the trajectory is known."""
        return None if self.cache is None else self.cache.expansion_point(values)

    def precision(self, keys: Sequence[str], free: Sequence[str]) -> Floats:
        """Prior precision of parameters: low for free ones, else from their tolerances."""
        widths = prior_widths(self.candidate_set.parameters, keys, free, WIDE)
        with np.errstate(divide="ignore"):
            # a parameter that is known exactly and not freed cannot move: infinite precision
            precision: Floats = 1.0 / widths**2
        return precision

    def fit(
        self,
        free: Sequence[str],
        *,
        start: Mapping[str, float] | None = None,
        around: Mapping[str, float] | None = None,
        iterations: int = 6,
        coarse: bool = False,
    ) -> Fit:
        """Fit free parameters and all tolerances.

        The free parameters move first, with the tolerances eliminated to first order, so that a
        large effect does not drive them far from where their responses were taken.

        Args:
            free: keys.
            start: starting values of the free parameters; the bound where one lies outside.
            around: starting values of all others; where the responses were taken when left out.
            iterations: at most, in each of the two stages.
            coarse: leave out `refined`, which follows for the best fits.
        """
        keys = (*self.tolerances, *(k for k in free if k not in self.tolerances))
        precision = self.precision(keys, free)
        begin = self.at if around is None else around
        first = {k: float(begin.get(k, 0.0)) for k in keys}
        first |= {
            k: self.candidate_set.allowed(k, v) for k, v in (start or {}).items() if k in free
        }
        late = self.candidate_set.sensor_delay
        if self.windows.delay and late in first:
            first[late] = self.windows.delay
        expansion_point = self._expansion_point(self.at)
        excess = 0.0 if expansion_point is None else _ROUGH
        rule = Backtracking(absolute=_SMALL, excess=excess)

        def descend(now: Fit, moving: Sequence[str]) -> Fit:
            return self._descend(now, iterations, rule, moving, expansion_point)

        now = self._linear(keys, free, first, precision, expansion_point)
        if free:
            now = descend(approached(now, float(self.windows.observed), descend), free)
        now = descend(now, keys)
        return now if coarse else self.refined(now, iterations=iterations)

    def refined(self, fit: Fit, *, iterations: int = 6) -> Fit:
        """Repeat a fit about exact steps at its own values until it converges.

        Args:
            fit: of this fitter.
            iterations: at most, for each time.
        """
        if self.cache is None:
            return fit
        best, rule = None, Backtracking(absolute=_SMALL)
        for _ in range(_AGAIN):
            guessed, expansion_point = fit.cost, self._expansion_point(fit.values)
            fit = self._linear(fit.keys, fit.free, fit.values, fit.precision, expansion_point)
            if best is not None and fit.cost > best.cost:
                return best
            best = fit
            off, exact = abs(fit.cost - guessed), fit.cost
            fit = self._descend(fit, iterations, rule, fit.keys, expansion_point)
            if off < _SMALL or exact - fit.cost < _SMALL:
                break
        return fit

    def reevaluated(self, fit: Fit, *, whitened: WhitenedResiduals | None = None) -> Fit:
        """Evaluate misfit and equations of another fitter's fit in these windows.

        Args:
            fit: of another fitter.
            whitened: residuals in that fitter's windows, if they are like these.
        """
        if whitened is None or not self.windows.shares_outputs(whitened.windows):
            return self._linear(fit.keys, fit.free, fit.values, fit.precision)
        misfit = self.windows.rewhitened(whitened.misfit)
        columns = None if whitened.columns is None else self.windows.rewhitened(whitened.columns)
        found, _ = self.equations(fit.keys, fit.free, fit.values, fit.precision, misfit)
        return self.with_free(found, misfit, columns)

    def whitened_residuals(self, fit: Fit) -> WhitenedResiduals:
        """Whitened misfit and responses of the free parameters at the values of a fit."""
        columns = self.whitened(fit.free, fit.values) if fit.free else None
        return WhitenedResiduals(self.windows, self.misfit(fit.values), columns)

    def start(self, free: Sequence[str]) -> Fit:
        """Return the equations at the linearisation point, before any fit."""
        keys = (*self.tolerances, *(k for k in free if k not in self.tolerances))
        values = {k: float(self.at.get(k, 0.0)) for k in keys}
        return self._linear(keys, free, values, self.precision(keys, free))

    def _descend(
        self,
        now: Fit,
        iterations: int,
        rule: Backtracking,
        moving: Sequence[str],
        expansion_point: ExpansionPoint | None,
    ) -> Fit:
        """Minimise the cost over some keys, the others eliminated to first order."""
        descent = _Descent(self, now.keys, moving, rule.absolute, expansion_point)
        task = descent.task(now)
        minimise(descent, [task], rule, steps=iterations)
        return task.fit

    def bounds(self, keys: Sequence[str]) -> tuple[Floats, Floats]:
        """Return lower and upper bounds of parameters."""
        pairs = np.array(
            [self.candidate_set.parameters[k].bounds for k in keys], dtype=float
        ).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]

    def moved(self, fit: Fit, step: Floats, share: float) -> dict[str, float]:
        """Return the values after a fraction of a step, inside the bounds."""
        return {
            k: self.candidate_set.allowed(k, fit.values[k] + share * step[i])
            for i, k in enumerate(fit.keys)
        }

    def _linear(
        self,
        keys: Sequence[str],
        free: Sequence[str],
        values: Mapping[str, float],
        precision: Floats,
        expansion_point: ExpansionPoint | None = None,
    ) -> Fit:
        """Misfit and normal equations at given values."""
        misfit = self.misfit(values, expansion_point)
        return self.with_free(*self.equations(keys, free, values, precision, misfit))

    def equations(
        self,
        keys: Sequence[str],
        free: Sequence[str],
        values: Mapping[str, float],
        precision: Floats,
        misfit: Whitened,
    ) -> tuple[Fit, Whitened]:
        """Return misfit and equations at given values, without the rows of the free parameters."""
        count, total = len(self.tolerances), len(keys)
        normal = np.zeros((self.windows.count, total, total))
        right = np.zeros((self.windows.count, total))
        normal[:, :count, :count] = self._square
        right[:, :count] = self.fixed.product(misfit)[:, :, 0]
        level = misfit.product(misfit)[:, 0, 0]
        at_values = np.array([values[k] for k in keys])
        centre = np.zeros(total)
        late = self.candidate_set.sensor_delay
        if self.windows.delay and late in keys:
            # these windows follow a late sensor: its delay is theirs, and held
            held = list(keys).index(late)
            _silence(normal, right, held)
            # a delay that is not fitted is still one beyond its tolerance
            centre[held] = self.windows.delay if late in free else 0.0
        penalty = float(np.sum(precision * (at_values - centre) ** 2))
        cost = float(level.sum()) + penalty
        fit = Fit(
            free=tuple(free),
            keys=tuple(keys),
            values=dict(values),
            # a prediction that ran out of digits is never the best one: NaN would compare as such,
            # and a misfit below zero is the difference of two products that are both too large
            cost=cost if np.isfinite(cost) and is_determined(level) else np.inf,
            misfit=level,
            normal=normal,
            right=right,
            precision=precision,
            centre=centre,
            penalty=penalty,
        )
        return fit, misfit

    def with_free(self, fit: Fit, misfit: Whitened, columns: Whitened | None = None) -> Fit:
        """Add the equations of the free parameters, in place."""
        fresh, count = list(fit.free), len(self.tolerances)
        if not fresh:
            return fit
        columns = self.whitened(fresh, fit.values) if columns is None else columns
        at = [fit.keys.index(k) for k in fresh]
        cross, own = self.fixed.product(columns), columns.product(columns)
        right = columns.product(misfit)
        for a, i in enumerate(at):
            fit.normal[:, :count, i] = cross[:, :, a]
            fit.normal[:, i, :count] = cross[:, :, a]
            fit.right[:, i] = right[:, a, 0]
        for a, i in enumerate(at):
            for b, j in enumerate(at):
                fit.normal[:, i, j] = own[:, a, b]
        late = self.candidate_set.sensor_delay
        if self.windows.delay and late in fit.keys:
            _silence(fit.normal, fit.right, fit.keys.index(late))
        return fit


def is_determined(misfit: Floats) -> bool:
    """Return true if all windows have a misfit that is finite and not negative beyond rounding."""
    largest = float(np.abs(misfit).max())
    return bool(np.isfinite(largest) and misfit.min() >= -_ROUNDING * largest)


def _silence(normal: Floats, right: Floats, held: int) -> None:
    """Remove one parameter from the equations."""
    normal[:, held, :], normal[:, :, held], right[:, held] = 0.0, 0.0, 0.0


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


class _Descent:
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
