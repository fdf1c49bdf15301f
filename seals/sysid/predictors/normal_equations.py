"""Normal equations of a fit: Gauss-Newton step, predicted decrease of the cost, covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.least_squares import bounded_step, solve_scaled


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Fit of free parameters together with all tolerances.

    Args:
        free: keys of the free parameters.
        keys: of all estimated parameters, tolerances first.
        values: fitted changes by key.
        cost: whitened misfit and prior penalty.
        misfit: whitened misfit of every window, shape (W,).
        normal: normal matrices of the windows, shape (W, p, p).
        right: right sides at the fitted values, shape (W, p).
        precision: prior precision of the keys, shape (p,).
        centre: prior mean of the keys, shape (p,).
        penalty: prior part of the cost.
        known: 1-sigma of parameters that the equations hold fixed, where it was found otherwise.
        error: by key, how far the fit misses what a finer simulation was given.
    """

    free: tuple[str, ...]
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
    error: Mapping[str, float] = field(default_factory=dict)

    @property
    def at(self) -> Floats:
        """Values of the keys, shape (p,)."""
        return np.array([self.values[k] for k in self.keys])

    def system(self, windows: Any = slice(None)) -> tuple[Floats, Floats]:
        """Return matrix and right side of the step from the present values, priors included.

        Args:
            windows: that count; all when left out.
        """
        matrix = self.normal[windows].sum(axis=0) + np.diag(self.precision)
        return matrix, self.right[windows].sum(axis=0) - self.precision * (self.at - self.centre)

    @property
    def covariance(self) -> Floats:
        """Posterior covariance of the keys, shape (p, p); NaN where the equations hold NaN."""
        return posterior_covariance(self.normal.sum(axis=0), self.precision)

    def spread(self, key: str) -> float:
        """Posterior 1-sigma of one parameter, at most that of its prior."""
        if key in self.known:
            return float(self.known[key])
        k = self.keys.index(key)
        return float(np.sqrt(self.covariance[k, k]))

    def accounted(self, keys: Sequence[str]) -> float:
        """Return by how much the misfit rises when some parameters go back to zero [chi2].

        Equation:
            v^T (A - B C^-1 B^T) v with values v and their block A of the normal matrix; all other
            parameters, with priors in C, take over what they can.

        Args:
            keys: of the parameters.
        """
        own = [self.keys.index(k) for k in keys]
        rest = [i for i in range(len(self.keys)) if i not in own]
        whole, _ = self.system()
        cross = whole[np.ix_(rest, own)]
        at = np.array([self.values[k] for k in keys])
        block = self.normal.sum(axis=0)[np.ix_(own, own)]
        taken = [solve_scaled(whole[np.ix_(rest, rest)], c) for c in cross.T]
        return float(at @ (block - np.array(taken) @ cross) @ at)

    def robust_spread(self, key: str) -> float:
        """1-sigma of one parameter, robust to misfit beyond the noise.

        That is the scatter of the windows beyond noise, and the error of the linear model itself.
        """
        if key in self.known:
            return float(np.hypot(self.known[key], self.error.get(key, 0.0)))
        return float(np.hypot(self._scatter(key), self.error.get(key, 0.0)))

    def _scatter(self, key: str) -> float:
        """1-sigma of one parameter by noise, or by the windows where they scatter more."""
        k = self.keys.index(key)
        return float(np.sqrt(max(self.covariance[k, k], _sandwich_covariance(self)[k, k])))

    def joint_covariance(self, keys: Sequence[str], spreads: Sequence[float]) -> Floats:
        """Return the covariance of some parameters that are reported with wider intervals.

        Equation:
            C_ij = R_ij s_i s_j and C_ii = t_i^2, with the correlations R of the posterior, the
            1-sigma s by noise or scatter of the windows, and the reported 1-sigma t >= s: what
            widens an interval beyond s belongs to that parameter alone.

        Args:
            keys: of the parameters, shape (k,).
            spreads: reported 1-sigma t of each, shape (k,).

        Returns:
            Shape (k, k); parameters that the equations hold fixed are uncorrelated.
        """
        where = [self.keys.index(k) if k in self.keys and k not in self.known else -1 for k in keys]
        held = np.array(where) < 0
        whole = self.covariance[np.ix_(where, where)]
        scatter = [0.0 if k < 0 else self._scatter(self.keys[k]) for k in where]
        size = np.where(held, 0.0, np.minimum(scatter, spreads))
        unit = np.sqrt(np.diag(whole))
        found: Floats = whole / np.outer(unit, unit) * np.outer(size, size)
        found[np.diag_indices(len(where))] = np.square(spreads)
        return found


def posterior_covariance(information: Floats, precision: Floats) -> Floats:
    """Compute the covariance of a Gaussian posterior, positive despite rounding errors.

    The information of a log is a difference of large products; between effects that act alike it
    can come out slightly negative. Negative eigenvalues count as zero: a log takes no knowledge
    away.

    Equation:
        (N + P)^-1 by Cholesky factors; where N + P has none, W V (1 + max(L, 0))^-1 V^T W with
        W = P^-1/2 and V L V^T the eigenvalue decomposition of W N W.

    Args:
        information: normal matrix N of the measurements, shape (p, p), symmetric up to rounding.
        precision: diagonal of the prior precision P, shape (p,); infinite for what cannot move.

    Returns:
        Covariance, shape (p, p); NaN throughout where the information holds values not finite.

    Example:
        >>> posterior_covariance(np.array([[3.0, 0.0], [0.0, -9.0]]), np.array([1.0, 4.0])).tolist()
        [[0.25, 0.0], [0.0, 0.25]]
    """
    if not np.isfinite(information).all():
        return np.full_like(information, np.nan)
    width = 1.0 / np.sqrt(precision)
    scaled = 0.5 * (information + information.T) * width[:, None] * width[None, :]
    whole = scaled + np.eye(len(width))
    size = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(whole)), 1e-300))
    try:
        factor = np.linalg.inv(np.linalg.cholesky(whole * size[:, None] * size[None, :])) * size
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(scaled)
        factor = (vectors / np.sqrt(1.0 + np.maximum(values, 0.0))).T
    covariance: Floats = (factor.T @ factor) * width[:, None] * width[None, :]
    return covariance


def _sandwich_covariance(fit: Fit) -> Floats:
    """Compute the sandwich covariance of a fit from the scatter between its windows.

    Equation:
        C (sum over windows of (g - mean g) (g - mean g)^T W / (W - 1) + P) C, with the posterior
        covariance C, the right side g of each of W windows, and the prior precision P (Huber 1967,
        White 1980, by windows). It is C itself where the misfit is the noise that was stated.

    Args:
        fit: at its minimum.

    Returns:
        Covariance, shape (p, p); zeros of one window, which has no scatter.

    Example:
        >>> right = np.array([[3.0], [-3.0]])
        >>> fit = Fit(
        ...     free=("a.b",),
        ...     keys=("a.b",),
        ...     values={"a.b": 0.0},
        ...     cost=18.0,
        ...     misfit=np.array([9.0, 9.0]),
        ...     normal=np.ones((2, 1, 1)),
        ...     right=right,
        ...     precision=np.full(1, 1e-12),
        ...     centre=np.zeros(1),
        ...     penalty=0.0,
        ... )
        >>> _sandwich_covariance(fit)
        array([[9.]])
    """
    count = len(fit.right)
    if count < 2:
        return np.zeros((len(fit.keys), len(fit.keys)))
    scatter = fit.right - fit.right.mean(axis=0)
    movable = np.isfinite(fit.precision)
    prior = np.diag(np.where(movable, fit.precision, 0.0))
    covariance = fit.covariance
    inner = scatter.T @ scatter * (count / (count - 1.0)) + prior
    out: Floats = covariance @ inner @ covariance
    return out


def newton_step(fit: Fit, bounds: tuple[Floats, Floats] | None = None) -> tuple[Floats, float]:
    """Compute the Gauss-Newton step inside the bounds and the predicted decrease of the cost.

    Args:
        fit: equations at its values.
        bounds: least and largest values of the keys, shape (p,) each; None for none.

    Returns:
        The step, shape (p,), and the fall.
    """
    matrix, gradient = fit.system()
    if bounds is None:
        step = solve_scaled(matrix, gradient)
        if not step @ gradient >= 0.0:
            # an indefinite matrix leads uphill, or nowhere: the step of its positive part
            step = fit.covariance @ gradient
        return step, float(step @ gradient)
    step = bounded_step(matrix, gradient, bounds[0] - fit.at, bounds[1] - fit.at)
    return step, float(step @ (2.0 * gradient - matrix @ step))


def reserve(fit: Fit, frozen: Sequence[int]) -> float:
    """Predict to first order the decrease of the cost by a step of some keys alone."""
    if not frozen:
        return 0.0
    matrix, gradient = fit.system()
    right = gradient[frozen]
    return float(right @ solve_scaled(matrix[np.ix_(frozen, frozen)], right))
