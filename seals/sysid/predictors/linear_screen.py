"""Linear screen: gain of each candidate to first order, without a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.least_squares import solve_scaled
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.tempering import temperature
from seals.sysid.predictors.windows_fit import Fitter


@dataclass(frozen=True, kw_only=True)
class CandidateEquations:
    """Normal equations of all candidate parameters about one fit.

    Args:
        keys: of all parameters.
        normal: of every window, shape (W, p, p).
        right: of every window, shape (W, p).
        values: about which the equations hold.
        cost: of the fit.
        free: keys that are free already.
        centre: prior means that are not zero.
    """

    keys: tuple[str, ...]
    normal: Floats
    right: Floats
    values: Mapping[str, float]
    cost: float
    free: tuple[str, ...]
    centre: Mapping[str, float]


def screen(fitter: Fitter, fit: Fit, keys: Sequence[str]) -> CandidateEquations:
    """Linearise further parameters about a fit."""
    more = [k for k in keys if k not in fit.keys]
    columns = fitter.whitened(more, fit.values)
    misfit = fitter.misfit(fit.values)
    count, p = len(fit.keys), len(fit.keys) + len(more)
    windows = fitter.windows.count
    normal, right = np.zeros((windows, p, p)), np.zeros((windows, p))
    normal[:, :count, :count], right[:, :count] = fit.normal, fit.right
    own = len(fitter.tolerances)
    fixed = (
        fitter.fixed
        if len(fit.keys) == own
        else fitter.fixed.beside(fitter.whitened(fit.keys[own:], fit.values))
    )
    cross = fixed.product(columns)
    normal[:, :count, count:] = cross
    normal[:, count:, :count] = cross.transpose(0, 2, 1)
    normal[:, count:, count:] = columns.product(columns)
    right[:, count:] = columns.product(misfit)[:, :, 0]
    return CandidateEquations(
        keys=(*fit.keys, *more),
        normal=normal,
        right=right,
        values={**dict.fromkeys(more, 0.0), **fit.values},
        cost=fit.cost,
        free=fit.free,
        centre=dict(zip(fit.keys, map(float, fit.centre), strict=True)),
    )


def linear_gain(
    fitter: Fitter, table: CandidateEquations, free: Sequence[str]
) -> tuple[float, dict[str, float]]:
    """Predict to first order the decrease of the cost with more free keys, and their values.

    Args:
        fitter: priors.
        table: linear equations.
        free: keys to free beside those already free.
    """
    use = [
        i
        for i, k in enumerate(table.keys)
        if k in fitter.tolerances or k in table.free or k in free
    ]
    keys = [table.keys[i] for i in use]
    hot = temperature(table.cost, float(fitter.windows.observed))
    weight = np.array([1.0 if k in table.free or k in free else hot for k in keys])
    precision = weight * fitter.precision(keys, (*table.free, *free))
    at = np.array([table.values[k] for k in keys]) - np.array(
        [table.centre.get(k, 0.0) for k in keys]
    )
    matrix = table.normal.sum(axis=0)[np.ix_(use, use)] + np.diag(precision)
    gradient = table.right.sum(axis=0)[use] - precision * at
    step = solve_scaled(matrix, gradient)
    before = weight * fitter.precision(keys, table.free)
    # freeing a prior already lowers the cost of values that it held
    relief = float(np.sum((np.where(np.isfinite(before), before, 0.0) - precision) * at**2))
    reached = {k: table.values[k] + float(d) for k, d in zip(keys, step, strict=True)}
    return float(step @ gradient) + relief, reached


def candidate_keys(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Parameter keys of some candidates without repetition."""
    return tuple(dict.fromkeys(k for c in candidates for k in c.all_keys))
