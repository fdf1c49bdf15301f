"""Estimate of the residual force of a log, marginalised over all tolerances."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.least_squares import inverses_scaled, solve_scaled
from seals.sysid.candidates.parameters import CandidateSet
from seals.sysid.decision.policy import DecisionPolicy
from seals.sysid.predictors.problem import Problem
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.residual_force.free import FreeWindows
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

_ROUNDING = 1e-12
"""Least eigenvalue of a block, as a share of its largest, that is no rounding."""

ROUNDS = 2
"""Times the tolerances are fitted anew."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Normal equations of free force and tolerances by window, start states eliminated.

    The knots of the force run axis by axis: force x, y, z, torque x, y, z, body axes. Behind them
    come the tolerances, and last the misfit.

    Args:
        gram: inner products, shape (W, 6 K + p + 1, 6 K + p + 1).
        knots: K.
        rows: of the log nearest to the knots, shape (W, K).
        tight: precision of the stated gusts, shape (W, 6 K, 6 K).
        loose: precision of a free force, likewise.
        precision: of the tolerances, shape (p,).
        centre: their mean against the values at which the misfit was taken, shape (p,).
        values: those values by parameter key.
        keys: of the tolerances.
        observed: numbers that the log holds beyond its start states.
        gust: level of the gusts [N, N m], shape (2,).
        policy: thresholds of the decisions.
    """

    gram: Floats
    knots: int
    rows: NDArray[np.integer[Any]]
    tight: Floats
    loose: Floats
    precision: Floats
    centre: Floats
    values: dict[str, float] = field(default_factory=dict)
    keys: tuple[str, ...] = ()
    observed: int = 0
    gust: Floats = field(default_factory=lambda: np.zeros(2))
    policy: DecisionPolicy = field(default_factory=DecisionPolicy)

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.gram)

    @property
    def _force(self) -> int:
        return 6 * self.knots

    @cached_property
    def calm(self) -> Floats:
        """Return the equations marginalised over stated gusts and tolerances.

        The tolerances are integrated out in every window by itself: were they fitted to the whole
        log, a missing effect could hide behind changes far beyond their prior.

        Returns:
            Knots of a further force, and the misfit last, shape (W, 6 K + 1, 6 K + 1).
        """
        return self._alone(self._without(self.tight))

    @cached_property
    def posterior(self) -> tuple[Floats, Floats, Floats]:
        """Free force and its uncertainty.

        Returns:
            Mean (W, 6, K), covariance (W, 6 K, 6 K), and the tolerances (p,) that go with it.
        """
        m, p = self._force, len(self.precision)
        block = self.gram[:, :m, :m] + self.loose
        inverse = inverses_scaled(block)
        cross = self.gram[:, :m, m:]
        gain = np.matmul(inverse, cross)
        rest = (self.gram[:, m:, m:] - np.matmul(cross.transpose(0, 2, 1), gain)).sum(axis=0)
        normal = rest[:p, :p] + np.diag(self.precision)
        delta = solve_scaled(normal, rest[:p, p] + self.precision * self.centre)
        uncertainty = inverses_scaled(normal[None])[0]
        mean = gain[:, :, p] - gain[:, :, :p] @ delta
        spread = np.matmul(
            np.matmul(gain[:, :, :p], uncertainty), gain[:, :, :p].transpose(0, 2, 1)
        )
        return mean.reshape(self.count, 6, self.knots), inverse + spread, delta

    @cached_property
    def free(self) -> Floats:
        """Return the equations with a free force in place of the gusts."""
        return self._alone(self._without(self.loose))

    @property
    def before(self) -> Floats:
        """Misfit of every window under stated gusts and tolerances, shape (W,)."""
        return self.calm[:, -1, -1]

    @property
    def after(self) -> Floats:
        """Misfit of every window when any force may act, shape (W,)."""
        return self.free[:, -1, -1]

    @cached_property
    def freedom(self) -> Floats:
        """Effective degrees of freedom of the free force beyond the gusts, shape (W,)."""
        m = self._force
        out = np.zeros(self.count)
        for prior, sign in ((self.loose, 1.0), (self.tight, -1.0)):
            inverse = inverses_scaled(self.gram[:, :m, :m] + prior)
            out += sign * np.einsum("wij,wji->w", inverse, self.gram[:, :m, :m])
        return out

    def _alone(self, table: Floats) -> Floats:
        """Marginalise each window over the tolerances separately."""
        m, p = self._force, len(self.precision)
        shift = np.eye(table.shape[1])
        shift[m : m + p, -1] = -self.centre
        table = shift.T @ table @ shift
        block = table[:, m : m + p, m : m + p] + np.diag(self.precision)
        level = np.einsum("wii->wi", block)
        held: Floats = block + 1e-12 * level[:, :, None] * np.eye(block.shape[1])
        keep = [*range(m), m + p]
        absorbed = np.linalg.solve(np.linalg.cholesky(held), table[:, m : m + p][:, :, keep])
        rest: Floats = table[:, keep][:, :, keep]
        rest = rest - np.matmul(absorbed.transpose(0, 2, 1), absorbed)
        return rest

    def _without(self, prior: Floats) -> Floats:
        m = self._force
        block = self.gram[:, :m, :m] + prior
        scale = np.sqrt(np.maximum(np.einsum("wii->wi", block), np.finfo(float).tiny))[:, :, None]
        # forces and torques differ by decades, and a start that is stated exactly weighs more than
        # rounding allows: of a unit diagonal, what lies below rounding is held there
        level, axes = np.linalg.eigh(block / scale / scale.transpose(0, 2, 1))
        level = np.maximum(level, _ROUNDING * level[:, -1:])
        absorbed = axes.transpose(0, 2, 1) @ (self.gram[:, :m] / scale)
        absorbed /= np.sqrt(level)[:, :, None]
        table: Floats = self.gram - np.matmul(absorbed.transpose(0, 2, 1), absorbed)
        return table


def evidence(problem: Problem, hypothesis: EvidenceHypothesis | None = None) -> Evidence:
    """Estimate the residual force of a log under a model.

    Args:
        problem: the log made ready.
        hypothesis: the model; the nominal one when left out.
    """
    fitter = problem.fitter if hypothesis is None else hypothesis.fitter
    windows = FreeWindows(fitter)
    loose = fitter.with_windows(windows)
    tolerances = fitter.tolerances
    free = () if hypothesis is None else hypothesis.fit.free
    keys = (*tolerances, *(k for k in free if k not in tolerances))
    mean, width = _priors(fitter.candidate_set, keys, hypothesis)
    values = dict(mean)
    late = fitter.candidate_set.sensor_delay
    if windows.delay and late in keys:
        values[late], width[late] = windows.delay, 1e-9
    precision = np.array([1.0 / width[k] ** 2 for k in keys])
    columns = loose.fixed.outputs
    fresh = [k for k in keys if k not in tolerances]
    if fresh:
        columns = np.concatenate([columns, loose.whitened(fresh, values).outputs], axis=2)
    found = _collected(windows, loose, columns, values, keys, precision, mean)
    for _ in range(ROUNDS):
        moves = zip(keys, found.posterior[2], strict=True)
        values = {k: fitter.candidate_set.allowed(k, values[k] + move) for k, move in moves}
        found = _collected(windows, loose, columns, values, keys, precision, mean)
    return found


def _collected(  # noqa: PLR0917  the parts of one set of equations
    windows: FreeWindows,
    loose: Fitter,
    columns: Floats,
    values: dict[str, float],
    keys: tuple[str, ...],
    precision: Floats,
    mean: dict[str, float],
) -> Evidence:
    return Evidence(
        gram=windows.gram(columns, loose.misfit(values).outputs),
        knots=windows.knots,
        rows=windows.knot_rows,
        tight=windows.tight,
        loose=windows.loose,
        precision=precision,
        centre=np.array([mean[k] - values[k] for k in keys]),
        values=values,
        keys=keys,
        observed=windows.observed,
        gust=windows.stated_gust,
        policy=loose.candidate_set.policy,
    )


def _priors(
    candidate_set: CandidateSet, keys: tuple[str, ...], hypothesis: EvidenceHypothesis | None
) -> tuple[dict[str, float], dict[str, float]]:
    """Mean and standard deviation of the tolerances; effects of the model are held."""
    mean = dict.fromkeys(keys, 0.0)
    width = {k: max(candidate_set.parameters[k].tolerance, 1e-12) for k in keys}
    if hypothesis is not None:
        fit = hypothesis.fit
        spread = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-24))
        for key, uncertainty in zip(fit.keys, spread, strict=True):
            if key in fit.free and key in width:
                mean[key], width[key] = fit.values[key], float(uncertainty)
    return mean, width
