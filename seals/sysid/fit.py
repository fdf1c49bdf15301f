"""Fits factors to the windows of a log by damped Gauss-Newton, with priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.sysid.along import Along, Anchor
from seals.sysid.factors import Library
from seals.sysid.linearise import DELAY, Columns, Dynamics, columns_along, predict
from seals.sysid.normal import Fit, newton_step, reserve
from seals.sysid.plant import Plant
from seals.sysid.trajectory import Course
from seals.sysid.whitened import Whitened
from seals.sysid.windows import Windows

_SHARES = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried."""
_SLOW = 3e-5
"""Share of the cost that a step must gain for another one to follow."""
_COARSE = 3e-3
"""The same as a share of the misfit above a complete model's: far from one, digits are idle."""
_AGAIN = 2
"""Times that a fit is repeated about exact steps at its own values."""
_ROUGH = 1e-2
"""The same for steps about an anchor that will move."""
_WIDE = 1.5
"""Prior width of a freed factor in units of its plausible size."""


class Seen(NamedTuple):
    """What windows saw of a model.

    Args:
        windows: that saw it.
        misfit: of the model.
        columns: responses of the freed factors; None without any.
    """

    windows: Windows
    misfit: Whitened
    columns: Whitened | None


class Fitter:
    """Fits any freed factors on one linearisation of a log.

    Args:
        plant: extended model.
        course: about which the model is linear.
        dynamics: derivatives along the course.
        windows: of the log.
        at: parameters of the linearisation of the tolerances.
        columns: responses of the tolerances, when they are known.
        along: the plant along the course, when it is known; it spares exact steps: those of a fit
            are taken where it starts and where it ends.
        fixed: whitened responses of the tolerances, when they are known.
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
        along: Along | None = None,
        fixed: Whitened | None = None,
    ) -> None:
        self.plant, self.course, self.dynamics, self.windows = plant, course, dynamics, windows
        self.along = along
        self.library: Library = plant.library
        self.tolerances = self.library.tolerances
        self.at = dict(at or {})
        self.columns = columns or self._columns(self.tolerances, self.at)
        self.fixed = windows.whiten(windows.responses(self.columns)) if fixed is None else fixed
        self._square = self.fixed.product(self.fixed)

    def seen_through(self, windows: Windows) -> Fitter:
        """Return the same linearisation in other windows."""
        return Fitter(
            self.plant,
            self.course,
            self.dynamics,
            windows,
            at=self.at,
            columns=self.columns,
            along=self.along,
            fixed=windows.again(self.fixed) if windows.like(self.windows) else None,
        )

    def _columns(self, keys: Sequence[str], values: Mapping[str, float]) -> Columns:
        return columns_along(
            self.plant,
            self.course,
            values,
            keys,
            self.dynamics,
            delay=self.windows.delay,
            along=self.along,
        )

    def whitened(self, keys: Sequence[str], values: Mapping[str, float]) -> Whitened:
        """Whitened responses of factors at given values."""
        return self.windows.whiten(self.windows.responses(self._columns(keys, values)))

    def misfit(self, values: Mapping[str, float]) -> Whitened:
        """Whitened misfit of the model at given values."""
        return self._misfit(values, None)

    def _near(self, values: Mapping[str, float], anchor: Anchor | None) -> Whitened:
        """The same, with steps to first order about those at an anchor."""
        return self.misfit(values) if anchor is None else self._misfit(values, anchor)

    def _misfit(self, values: Mapping[str, float], anchor: Anchor | None) -> Whitened:
        prediction = predict(
            self.plant,
            self.course,
            values,
            delay=self.windows.delay,
            along=self.along,
            anchor=anchor,
            dynamics=self.dynamics,
        )
        return self.windows.whiten(self.windows.residual(prediction)[:, :, None])

    def _anchor(self, values: Mapping[str, float]) -> Anchor | None:
        """Exact steps at some values, where the plant along the course is known."""
        return None if self.along is None else self.along.anchor(values)

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
        rough: bool = False,
    ) -> Fit:
        """Fit freed factors and all tolerances.

        The freed factors move first, with the tolerances eliminated to first order, so that a
        large effect does not drive them far from where their responses were taken.

        Args:
            freed: keys.
            start: starting values of the freed factors.
            iterations: at most, in each of the two stages.
            tolerance: change of the cost at which to stop.
            rough: whether `refined` is to follow for what is worth it.
        """
        more = [k for k in freed if k not in self.tolerances]
        keys = (*self.tolerances, *more)
        precision = self.precision(keys, freed)
        first = {k: float(self.at.get(k, 0.0)) for k in keys}
        first |= {k: float(v) for k, v in (start or {}).items() if k in freed}
        if self.windows.delay and DELAY in first:
            first[DELAY] = self.windows.delay
        anchor = self._anchor(self.at)
        enough = tolerance, (0.0 if anchor is None else _ROUGH)
        now = self._linear(keys, freed, first, precision, anchor)
        if freed:
            now = self._descend(now, iterations, enough, set(freed), anchor)
        now = self._descend(now, iterations, enough, set(keys), anchor)
        return now if rough else self.refined(now, iterations=iterations, tolerance=tolerance)

    def refined(self, fit: Fit, *, iterations: int = 6, tolerance: float = 0.3) -> Fit:
        """Repeat a fit about exact steps at its own values, until they hold.

        Args:
            fit: of this fitter.
            iterations: at most, for each time.
            tolerance: change of the cost at which to stop.
        """
        if self.along is None:
            return fit
        best: Fit | None = None
        for _ in range(_AGAIN):
            guessed, anchor = fit.cost, self._anchor(fit.values)
            fit = self._linear(fit.keys, fit.freed, fit.values, fit.precision, anchor)
            if best is not None and fit.cost > best.cost:
                return best
            best = fit
            off, exact = abs(fit.cost - guessed), fit.cost
            fit = self._descend(fit, iterations, (tolerance, 0.0), set(fit.keys), anchor)
            if off < tolerance or exact - fit.cost < tolerance:
                break
        return fit

    def again(self, fit: Fit, *, seen: Seen | None = None) -> Fit:
        """Misfit and equations of another fitter's fit in these windows.

        Args:
            fit: of another fitter.
            seen: what that fitter's windows saw, if they are like these.
        """
        if seen is None or not self.windows.like(seen.windows):
            return self._linear(fit.keys, fit.freed, fit.values, fit.precision)
        misfit = self.windows.again(seen.misfit)
        columns = None if seen.columns is None else self.windows.again(seen.columns)
        found, _ = self._standing(fit.keys, fit.freed, fit.values, fit.precision, misfit)
        return self._with_freed(found, misfit, columns)

    def seen(self, fit: Fit) -> Seen:
        """Misfit and freed columns at the values of a fit."""
        columns = self.whitened(fit.freed, fit.values) if fit.freed else None
        return Seen(self.windows, self.misfit(fit.values), columns)

    def start(self, freed: Sequence[str]) -> Fit:
        """Equations where the tolerances were linearised, nothing fitted."""
        more = [k for k in freed if k not in self.tolerances]
        keys = (*self.tolerances, *more)
        values = {k: float(self.at.get(k, 0.0)) for k in keys}
        return self._linear(keys, freed, values, self.precision(keys, freed))

    def _descend(
        self,
        now: Fit,
        iterations: int,
        enough: tuple[float, float],
        moving: set[str],
        anchor: Anchor | None,
    ) -> Fit:
        """Gauss-Newton steps with step halving on the cost less what still frozen keys could do.

        They end with one that gains less than enough: an amount, or a share of the misfit above a
        complete model's.
        """
        tolerance, share_of_misfit = enough
        frozen = [i for i, k in enumerate(now.keys) if k not in moving]
        level = now.cost - reserve(now, frozen)
        for _ in range(iterations):
            step, promised = newton_step(now, self._bounds(now.keys))
            if promised - reserve(now, frozen) < tolerance:
                return now
            step[frozen] = 0.0
            for share in _SHARES:
                values = self._moved(now, step, share)
                misfit = self._near(values, anchor)
                trial, misfit = self._standing(now.keys, now.freed, values, now.precision, misfit)
                reached = trial.cost - reserve(trial, frozen)
                if reached < level:
                    break
            else:
                return now
            gained, level, now = level - reached, reached, self._with_freed(trial, misfit)
            above = level - self.windows.observed
            whole = max(_COARSE if share == 1.0 else 0.0, share_of_misfit) * above
            if gained < max(tolerance, _SLOW * level, whole):
                return now
        return now

    def _bounds(self, keys: Sequence[str]) -> tuple[Floats, Floats]:
        """Least and largest values of factors."""
        pairs = np.array([self.library.factors[k].bounds for k in keys], dtype=float).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]

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
        anchor: Anchor | None = None,
    ) -> Fit:
        """Misfit and normal equations at given values."""
        misfit = self._near(values, anchor)
        return self._with_freed(*self._standing(keys, freed, values, precision, misfit))

    def _standing(
        self,
        keys: Sequence[str],
        freed: Sequence[str],
        values: Mapping[str, float],
        precision: Floats,
        misfit: Whitened,
    ) -> tuple[Fit, Whitened]:
        """Misfit at given values with the equations of the tolerances alone: half the work."""
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
        cost = float(level.sum()) + penalty
        fit = Fit(
            freed=tuple(freed),
            keys=tuple(keys),
            values=dict(values),
            # a prediction that ran out of digits is never the best one; NaN would compare as such
            cost=cost if np.isfinite(cost) else np.inf,
            misfit=level,
            normal=normal,
            right=right,
            precision=precision,
            centre=centre,
            penalty=penalty,
        )
        return fit, misfit

    def _with_freed(self, fit: Fit, misfit: Whitened, columns: Whitened | None = None) -> Fit:
        """The same with the equations of the freed factors, in place."""
        fresh, count = list(fit.freed), len(self.tolerances)
        if not fresh:
            return fit
        columns = self.whitened(fresh, fit.values) if columns is None else columns
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
