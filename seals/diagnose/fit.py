"""Fits factors to the windows of a log by damped Gauss-Newton, with priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.diagnose.factors import Library
from seals.diagnose.linearise import DELAY, Columns, Dynamics, columns_along, predict
from seals.diagnose.plant import Plant
from seals.diagnose.trajectory import Course
from seals.diagnose.windows import Whitened, Windows

_SHARES = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried."""
_SLOW = 3e-5
"""Share of the cost that a step must gain for another one to follow."""
_COARSE = 3e-3
"""The same as a share of the misfit above a complete model's: far from one, digits are idle."""
_WIDE = 1.5
"""Prior width of a freed factor in units of its plausible size."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A fit of some freed factors beside the tolerances.

    Args:
        freed: keys of the freed factors.
        keys: of all factors that moved, tolerances first.
        values: fitted changes by key.
        cost: whitened misfit and prior penalty.
        misfit: whitened misfit of every window, shape (W,).
        normal: normal matrices of the windows, shape (W, p, p).
        right: right sides at the fitted values, shape (W, p).
        precision: prior precision of the keys, shape (p,).
        centre: prior mean of the keys, shape (p,).
        penalty: prior part of the cost.
    """

    freed: tuple[str, ...]
    keys: tuple[str, ...]
    values: Mapping[str, float]
    cost: float
    misfit: Floats
    normal: Floats
    right: Floats
    precision: Floats
    centre: Floats
    penalty: float

    @property
    def covariance(self) -> Floats:
        """Posterior covariance of the keys, shape (p, p)."""
        matrix = self.normal.sum(axis=0) + np.diag(self.precision)
        covariance: Floats = np.linalg.inv(matrix)
        return covariance

    def spread(self, key: str) -> float:
        """Posterior 1-sigma of one factor."""
        k = self.keys.index(key)
        return float(np.sqrt(self.covariance[k, k]))


class Fitter:
    """Fits any freed factors on one linearisation of a log.

    Args:
        plant: extended model.
        course: about which the model is linear.
        dynamics: derivatives along the course.
        windows: of the log.
        at: parameters of the linearisation of the tolerances.
        columns: responses of the tolerances, when they are known.
    """

    def __init__(
        self,
        plant: Plant,
        course: Course,
        dynamics: Dynamics,
        windows: Windows,
        *,
        at: Mapping[str, float] | None = None,
        columns: Columns | None = None,
    ) -> None:
        self.plant, self.course, self.dynamics, self.windows = plant, course, dynamics, windows
        self.library: Library = plant.library
        self.tolerances = self.library.tolerances
        self.at = dict(at or {})
        self.columns = columns or self._columns(self.tolerances, self.at)
        self.fixed = windows.whiten(windows.responses(self.columns))
        self._square = self.fixed.product(self.fixed)

    def seen_through(self, windows: Windows) -> Fitter:
        """Return the same linearisation in other windows."""
        return Fitter(
            self.plant, self.course, self.dynamics, windows, at=self.at, columns=self.columns
        )

    def _columns(self, keys: Sequence[str], values: Mapping[str, float]) -> Columns:
        return columns_along(self.plant, self.course, values, keys, self.dynamics)

    def whitened(self, keys: Sequence[str], values: Mapping[str, float]) -> Whitened:
        """Whitened responses of factors at given values."""
        return self.windows.whiten(self.windows.responses(self._columns(keys, values)))

    def misfit(self, values: Mapping[str, float]) -> Whitened:
        """Whitened misfit of the model at given values."""
        prediction = predict(self.plant, self.course, values, delay=self.windows.delay)
        return self.windows.whiten(self.windows.residual(prediction)[:, :, None])

    def precision(self, keys: Sequence[str], freed: Sequence[str]) -> Floats:
        """Prior precision of factors: wide when freed, else the datasheet's."""
        factors = self.library.factors
        widths = [
            _WIDE * max(factors[k].scale, factors[k].tolerance)
            if k in freed
            else factors[k].tolerance
            for k in keys
        ]
        with np.errstate(divide="ignore"):
            # a factor that is known exactly and not freed cannot move: infinite precision
            precision: Floats = 1.0 / np.asarray(widths, dtype=float) ** 2
        return precision

    def fit(
        self,
        freed: Sequence[str],
        *,
        start: Mapping[str, float] | None = None,
        iterations: int = 6,
        tolerance: float = 0.3,
    ) -> Fit:
        """Fit freed factors and all tolerances.

        The freed factors move first, with the tolerances eliminated to first order, so that a
        large effect does not drive them far from where their responses were taken.

        Args:
            freed: keys.
            start: starting values of the freed factors.
            iterations: at most, in each of the two stages.
            tolerance: change of the cost at which to stop.
        """
        more = [k for k in freed if k not in self.tolerances]
        keys = (*self.tolerances, *more)
        precision = self.precision(keys, freed)
        first = {k: float(self.at.get(k, 0.0)) for k in keys}
        first |= {k: float(v) for k, v in (start or {}).items() if k in freed}
        if self.windows.delay and DELAY in first:
            first[DELAY] = self.windows.delay
        now = self._linear(keys, freed, first, precision)
        if freed:
            now = self._descend(now, iterations, tolerance, set(freed))
        return self._descend(now, iterations, tolerance, set(keys))

    def again(self, fit: Fit) -> Fit:
        """Misfit and equations of another fitter's fit in these windows."""
        return self._linear(fit.keys, fit.freed, fit.values, fit.precision)

    def start(self, freed: Sequence[str]) -> Fit:
        """Equations where the tolerances were linearised, nothing fitted."""
        more = [k for k in freed if k not in self.tolerances]
        keys = (*self.tolerances, *more)
        values = {k: float(self.at.get(k, 0.0)) for k in keys}
        return self._linear(keys, freed, values, self.precision(keys, freed))

    def _descend(self, now: Fit, iterations: int, tolerance: float, moving: set[str]) -> Fit:
        """Gauss-Newton steps with step halving on the cost less what still frozen keys could do."""
        frozen = [i for i, k in enumerate(now.keys) if k not in moving]
        level = now.cost - reserve(now, frozen)
        for _ in range(iterations):
            step, promised = newton_step(now)
            if promised - reserve(now, frozen) < tolerance:
                return now
            step[frozen] = 0.0
            for share in _SHARES:
                trial, misfit = self._standing(
                    now.keys, now.freed, self._moved(now, step, share), now.precision
                )
                reached = trial.cost - reserve(trial, frozen)
                if reached < level:
                    break
            else:
                return now
            gained, level, now = level - reached, reached, self._with_freed(trial, misfit)
            whole = _COARSE * (level - self.windows.observed) if share == 1.0 else 0.0
            if gained < max(tolerance, _SLOW * level, whole):
                return now
        return now

    def _moved(self, fit: Fit, step: Floats, share: float) -> dict[str, float]:
        """Values after a share of a step, inside the bounds."""
        out = {}
        for i, key in enumerate(fit.keys):
            low, high = self.library.factors[key].bounds
            out[key] = float(min(max(fit.values[key] + share * step[i], low), high))
        return out

    def _linear(
        self,
        keys: Sequence[str],
        freed: Sequence[str],
        values: Mapping[str, float],
        precision: Floats,
    ) -> Fit:
        """Misfit and normal equations at given values."""
        return self._with_freed(*self._standing(keys, freed, values, precision))

    def _standing(
        self,
        keys: Sequence[str],
        freed: Sequence[str],
        values: Mapping[str, float],
        precision: Floats,
    ) -> tuple[Fit, Whitened]:
        """Misfit at given values with the equations of the tolerances alone: half the work."""
        misfit = self.misfit(values)
        count, total = len(self.tolerances), len(keys)
        normal = np.zeros((self.windows.count, total, total))
        right = np.zeros((self.windows.count, total))
        normal[:, :count, :count] = self._square
        right[:, :count] = self.fixed.product(misfit)[:, :, 0]
        level = misfit.product(misfit)[:, 0, 0]
        at_values = np.array([values[k] for k in keys])
        centre = np.zeros(total)
        if self.windows.delay and DELAY in keys:
            # these windows follow a late sensor: its delay is theirs, and held
            held = list(keys).index(DELAY)
            _silence(normal, right, held)
            centre[held] = self.windows.delay
        penalty = float(np.sum(precision * (at_values - centre) ** 2))
        fit = Fit(
            freed=tuple(freed),
            keys=tuple(keys),
            values=dict(values),
            cost=float(level.sum()) + penalty,
            misfit=level,
            normal=normal,
            right=right,
            precision=precision,
            centre=centre,
            penalty=penalty,
        )
        return fit, misfit

    def _with_freed(self, fit: Fit, misfit: Whitened) -> Fit:
        """The same with the equations of the freed factors, in place."""
        fresh, count = list(fit.freed), len(self.tolerances)
        if not fresh:
            return fit
        columns = self.whitened(fresh, fit.values)
        at = [fit.keys.index(k) for k in fresh]
        cross, own = self.fixed.product(columns), columns.product(columns)
        for a, i in enumerate(at):
            fit.normal[:, :count, i] = cross[:, :, a]
            fit.normal[:, i, :count] = cross[:, :, a]
            fit.right[:, i] = columns.product(misfit)[:, a, 0]
        for a, i in enumerate(at):
            for b, j in enumerate(at):
                fit.normal[:, i, j] = own[:, a, b]
        if self.windows.delay and DELAY in fit.keys:
            _silence(fit.normal, fit.right, fit.keys.index(DELAY))
        return fit


def _silence(normal: Floats, right: Floats, held: int) -> None:
    """Take one factor out of the equations."""
    normal[:, held, :], normal[:, :, held], right[:, held] = 0.0, 0.0, 0.0


def newton_step(fit: Fit) -> tuple[Floats, float]:
    """Full Gauss-Newton step of all keys, shape (p,), and the fall of the cost it promises."""
    at = np.array([fit.values[k] for k in fit.keys])
    matrix = fit.normal.sum(axis=0) + np.diag(fit.precision)
    gradient = fit.right.sum(axis=0) - fit.precision * (at - fit.centre)
    step = solve_scaled(matrix, gradient)
    return step, float(step @ gradient)


def reserve(fit: Fit, frozen: Sequence[int]) -> float:
    """Fall of the cost that some keys alone would still give, to first order."""
    if not frozen:
        return 0.0
    at = np.array([fit.values[fit.keys[i]] for i in frozen])
    precision = fit.precision[frozen]
    matrix = fit.normal.sum(axis=0)[np.ix_(frozen, frozen)] + np.diag(precision)
    gradient = fit.right.sum(axis=0)[frozen] - precision * (at - fit.centre[frozen])
    return float(gradient @ solve_scaled(matrix, gradient))


def solve_scaled(matrix: Floats, right: Floats) -> Floats:
    """Solve a symmetric positive system after scaling its diagonal to one."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix * scale[:, None] * scale[None, :] + 1e-12 * np.eye(len(scale))
    solved: Floats = np.linalg.solve(scaled, right * scale) * scale
    return solved
