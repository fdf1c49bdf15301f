"""Normal equations of a fit: the step they promise, and what each key could still give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from seals.arrays import Floats


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
        known: 1-sigma of factors that the equations hold fixed, where it was found otherwise.
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
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def covariance(self) -> Floats:
        """Posterior covariance of the keys, shape (p, p)."""
        matrix = self.normal.sum(axis=0) + np.diag(self.precision)
        covariance: Floats = np.linalg.inv(matrix)
        return covariance

    def spread(self, key: str) -> float:
        """Posterior 1-sigma of one factor."""
        if key in self.known:
            return float(self.known[key])
        k = self.keys.index(key)
        return float(np.sqrt(self.covariance[k, k]))


def newton_step(fit: Fit, bounds: tuple[Floats, Floats] | None = None) -> tuple[Floats, float]:
    """Gauss-Newton step of all keys inside their bounds, and the fall of the cost it promises.

    A key that would leave its bounds goes to the bound, and the others take their best step beside
    it: a step that is merely cut off need not lead downhill.

    Args:
        fit: equations at its values.
        bounds: least and largest values of the keys, shape (p,) each; None for none.

    Returns:
        The step, shape (p,), and the fall.
    """
    at = np.array([fit.values[k] for k in fit.keys])
    matrix = fit.normal.sum(axis=0) + np.diag(fit.precision)
    gradient = fit.right.sum(axis=0) - fit.precision * (at - fit.centre)
    if bounds is None:
        step = solve_scaled(matrix, gradient)
        return step, float(step @ gradient)
    least, most = bounds[0] - at, bounds[1] - at
    step, free = np.zeros(len(at)), np.ones(len(at), dtype=bool)
    while free.any():
        right = gradient[free] - matrix[np.ix_(free, ~free)] @ step[~free]
        step[free] = solve_scaled(matrix[np.ix_(free, free)], right)
        beyond = free & ((step < least) | (step > most))
        if not beyond.any():
            break
        step[beyond] = np.clip(step, least, most)[beyond]
        free &= ~beyond
    return step, float(step @ (2.0 * gradient - matrix @ step))


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
