"""Four classical methods to identify the effect that is missing in the model of a log.

All of them see the samples of the diagnosis: the same log, the same trajectory, and the responses
of the same library of effects (`seals.sysid`). Only the inference differs: no tolerances of the
stated values, no gusts, no price of freedom beyond that of BIC, and no way to abstain but to find
nothing. A fifth answer is granted tolerances and gusts, to show what they alone are worth.
"""

from __future__ import annotations

import copy
import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.sysid.candidates.parameters import Candidate, CandidateSet
from seals.sysid.predictors.linear_screen import candidate_keys, linear_gain, screen
from seals.sysid.predictors.linearise import Prediction, columns_along, predict
from seals.sysid.predictors.problem import Problem, transient_rows, windows_of
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.initial_guesses import initial_guesses

Names = tuple[str, ...]
"""Effects that are declared missing, the likeliest first; none for nothing missing."""
THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9)
"""Of sparse regression, as shares of the largest normalised coefficient."""
RIDGE = 0.05
"""On columns of length one, as pysindy's STLSQ has it."""
BEYOND = 3.0
"""Standard deviations from zero at which a parameter is declared."""
_STILL = 1e-3
"""Factor on the stated gusts that leaves none."""
_FITTED = 6
"""Candidates of the multi-shoot fit that are fitted in full."""
_CURVED = ("tether", "waves")
"""Effects that have no response about zero."""


@dataclass(frozen=True, kw_only=True)
class Regression:
    """One-step residuals and the regressors of all effects, in units of the noise.

    Args:
        residual: measured less modelled accelerations and inertial readings, shape (n,).
        columns: responses, shape (n, p).
        groups: of each effect and variant, the numbers of its columns.
        freedom: number of parameters of each group.
        curved: starting values of effects that have no response about zero.
    """

    residual: Floats
    columns: Floats
    groups: Mapping[tuple[str, str], tuple[int, ...]]
    freedom: Mapping[tuple[str, str], int]
    curved: Mapping[str, Mapping[str, float]]

    @classmethod
    def of(cls, problem: Problem) -> Regression:
        """Set up the regression of one log."""
        plant, trajectory = problem.plant, problem.fitter.trajectory
        candidates = [c for c in plant.candidate_set.candidates if c.name not in _CURVED]
        keys = candidate_keys(candidates)
        responses = columns_along(plant, trajectory, {}, keys, problem.fitter.dynamics)
        nominal = predict(plant, trajectory, {})
        # readings of the inertial sensors, not a number where there is none, shape (T, 6)
        seen, rows = problem.samples.channels, problem.samples.rows
        none = np.full((rows, 3), np.nan)
        parts = [seen.get(name, none) for name in ("angular_velocity", "specific_force")]
        both: Floats = np.concatenate(parts, axis=1)
        target = -_stacked(problem, nominal.defect, nominal.reading - both)
        table = [_stacked(problem, responses.push[:, :, i], responses.reading[:, :, i])
                 for i in range(len(keys))]  # fmt: skip
        groups = {(c.name, c.label): tuple(keys.index(k) for k in c.all_keys) for c in candidates}
        freedom = {name: len(columns) for name, columns in groups.items()}
        fitter = problem.fitter
        base = EvidenceHypothesis(candidates=(), fit=fitter.start(()), fitter=fitter, score=0.0)
        bent = initial_guesses(problem, base, problem.plant.candidate_set.candidates)
        curved = {candidate.name: start for candidate, start in reversed(bent)}
        for name, start in curved.items():
            found: Prediction = predict(plant, trajectory, start)
            groups[name, name] = (len(table),)
            freedom[name, name] = len(start)
            change = found.defect - nominal.defect
            table.append(_stacked(problem, change, found.reading - nominal.reading))
        residual, columns = _whitened(target, np.stack(table, axis=1))
        return cls(
            residual=residual, columns=columns, groups=groups, freedom=freedom, curved=curved
        )


def _stacked(problem: Problem, defect: Floats, reading: Floats) -> Floats:
    """Accelerations over each step and readings at its start, shape (rows, 12 + J)."""
    samples, skip = problem.samples, transient_rows(problem.plant)
    joints = problem.fitter.trajectory.joints.shape[1]
    used = np.concatenate([np.arange(a + skip, b - 1) for a, b in samples.runs])
    change = np.concatenate([defect[:, 6:12], defect[:, 12 + joints :]], axis=1) / samples.step
    both: Floats = np.concatenate([change, reading], axis=1)[used]
    return both


def _whitened(target: Floats, table: Floats) -> tuple[Floats, Floats]:
    """Weigh every channel by what the whole library leaves of it: residual and columns."""
    rows, channels = target.shape
    good = np.isfinite(target)
    flat = np.where(good, target, 0.0)
    matrix = np.where(good[:, None, :], table, 0.0)
    weight = 1.0 / _level(flat, good)
    for _ in range(2):
        x = (matrix * weight).transpose(0, 2, 1).reshape(rows * channels, -1)
        solved, _ = _ridge(x, (flat * weight).ravel())
        rest = flat - np.einsum("rpc,p->rc", matrix, solved)
        weight = 1.0 / _level(rest, good)
    return (flat * weight)[good], (matrix * weight).transpose(0, 2, 1)[good]


def _level(values: Floats, good: Floats) -> Floats:
    """Root mean square of every channel."""
    count = np.maximum(good.sum(axis=0), 1)
    level: Floats = np.maximum(np.sqrt((values**2).sum(axis=0) / count), 1e-12)
    return level


def _ridge(columns: Floats, residual: Floats, ridge: float = 1e-9) -> tuple[Floats, Floats]:
    """Least squares on columns scaled to length one: coefficients, and those of scaled columns."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    unit = columns / scale
    matrix = unit.T @ unit + ridge * np.eye(len(scale))
    scaled: Floats = np.linalg.solve(matrix, unit.T @ residual)
    return scaled / scale, scaled


Kept = NDArray[np.int64]
Sparsifier = Callable[[Floats, Floats, float], Kept]
"""Columns that sparse regression keeps, of columns of length one, a residual and a threshold."""


def _stlsq(unit: Floats, residual: Floats, least: float) -> Kept:
    """Sequentially thresholded least squares: refit without small coefficients."""
    kept = np.arange(unit.shape[1])
    for _ in range(20):
        _, size = _ridge(unit[:, kept], residual, RIDGE)
        rest = kept[np.abs(size) >= least]
        if len(rest) in (0, len(kept)):
            return rest
        kept = rest
    return kept


def stlsq_of_pysindy(unit: Floats, residual: Floats, least: float) -> Kept:
    """The same by pysindy, as a check."""
    found = importlib.import_module("pysindy.optimizers")
    fit = found.STLSQ(threshold=least, alpha=RIDGE, unbias=False).fit(unit, residual[:, None])
    return np.flatnonzero(fit.coef_[0])


def sparse(
    table: Regression, threshold: float, sparsify: Sparsifier = _stlsq
) -> tuple[Names, float]:
    """Sequentially thresholded least squares at one threshold.

    Args:
        table: of one log.
        threshold: share of the largest coefficient of columns of length one.
        sparsify: that does it.

    Returns:
        Effects of the columns that are kept, and BIC of the fit.
    """
    # a column that does nothing in this log is not a column
    length = np.linalg.norm(table.columns, axis=0)
    alive = np.flatnonzero(length > 1e-9 * max(float(length.max()), 1e-30))
    unit = table.columns[:, alive] / length[alive]
    least = threshold * float(np.abs(_ridge(unit, table.residual, RIDGE)[1]).max())
    kept = sparsify(unit, table.residual, least)
    if not len(kept):
        return (), _bic(table, ())
    _, size = _ridge(unit[:, kept], table.residual)
    strength = dict(zip(alive[kept].tolist(), np.abs(size).tolist(), strict=True))
    ranked = sorted(
        ((max(strength.get(i, 0.0) for i in group), name)
         for (name, _), group in table.groups.items()),
        reverse=True,
    )  # fmt: skip
    names = tuple(dict.fromkeys(name for value, name in ranked if value > 0.0))
    return names, _bic(table, tuple(alive[kept].tolist()))


def _bic(table: Regression, columns: Sequence[int], freedom: int | None = None) -> float:
    """Bayesian information criterion of a regression on some columns, noise level unknown."""
    left, n = table.residual, len(table.residual)
    if columns:
        chosen = table.columns[:, list(columns)]
        left = left - chosen @ _ridge(chosen, table.residual)[0]
    count = len(columns) if freedom is None else freedom
    return float(n * np.log(left @ left / n) + count * np.log(n))


def one_step_sparse(table: Regression, sparsify: Sparsifier = _stlsq) -> Names:
    """Sparse regression (STLSQ) at the threshold that BIC prefers."""
    found = [sparse(table, threshold, sparsify) for threshold in THRESHOLDS]
    names, score = min(found, key=lambda f: f[1])
    return names if score < _bic(table, ()) else ()


def _one_step_bic(table: Regression) -> Names:
    """Return the effect with the best BIC, if any is better than none."""
    found: dict[str, float] = {}
    for (name, label), group in table.groups.items():
        score = _bic(table, group, table.freedom[name, label])
        found[name] = min(found.get(name, np.inf), score)
    best = min(found, key=lambda name: found[name])
    return (best,) if found[best] < _bic(table, ()) else ()


def plain(problem: Problem) -> Fitter:
    """Return a fitter of the same windows without tolerances and gusts."""
    given = problem.plant.candidate_set
    exact = {key: replace(factor, tolerance=0.0) for key, factor in given.parameters.items()}
    plant = copy.copy(problem.plant)
    plant.candidate_set = CandidateSet(
        effects=given.effects, parameters=exact, candidates=given.candidates
    )
    trajectory, dynamics = problem.fitter.trajectory, problem.fitter.dynamics
    windows = windows_of(plant, trajectory, dynamics, gusts=_STILL)
    return Fitter(plant, trajectory, dynamics, windows)


def _multi_shoot_bic(curved: Mapping[str, Mapping[str, float]], fitter: Fitter) -> Names:
    """Multiple shooting: fit every effect with free start states; BIC chooses one, or none.

    Args:
        curved: starting values of effects that have no response about zero.
        fitter: of the windows; what tolerances it has move within their priors.
    """
    about = fitter.start(())
    price = float(np.log(max(fitter.windows.observed, 2)))
    regular = [c for c in fitter.candidate_set.candidates if c.name not in _CURVED]
    table = screen(fitter, about, candidate_keys(regular))
    ranked: list[tuple[float, Candidate, Mapping[str, float]]] = []
    for c in regular:
        gain, values = linear_gain(fitter, table, c.all_keys)
        ranked.append((gain - price * len(c.all_keys), c, {k: values[k] for k in c.all_keys}))
    ranked.sort(key=lambda r: -r[0])
    jobs = [(c, start) for _, c, start in ranked[:_FITTED]]
    jobs += [(c, curved[c.name]) for c in fitter.candidate_set.candidates if c.name in curved]
    scores: dict[Names, float] = {(): fitter.fit((), iterations=2).cost}
    for c, start in jobs:
        fit = fitter.fit(c.all_keys, start=start, iterations=2)
        score = fit.cost + price * len(c.all_keys)
        scores[(c.name,)] = min(score, scores.get((c.name,), np.inf))
    return min(scores, key=lambda names: scores[names])


def _all_at_once(curved: Mapping[str, Mapping[str, float]], fitter: Fitter) -> Names:
    """Ridge regression of all parameters together; those beyond 3 sigma are declared.

    One linear solve: steps from zero of a model this free diverge on some logs. A tether and waves
    take part with the shape of their starting values and a free size.
    """
    candidates = [c for c in fitter.candidate_set.candidates if c.name not in _CURVED]
    keys = candidate_keys(candidates)
    misfit, columns = fitter.misfit({}), fitter.whitened(keys, {})
    for start in curved.values():
        columns = columns.beside(misfit.less(fitter.misfit(start)))
    ridge = np.concatenate([fitter.precision(keys, keys), np.ones(len(curved))])
    matrix = columns.product(columns).sum(axis=0) + np.diag(ridge)
    right = columns.product(misfit).sum(axis=0)[:, 0]
    scale = 1.0 / np.sqrt(np.diag(matrix))
    inverse = np.linalg.pinv(matrix * scale[:, None] * scale, hermitian=True)
    values = inverse @ (right * scale)
    # the noise that the fit itself leaves sets the width, as least-squares programs do
    left = float(misfit.product(misfit).sum()) - float(values @ (right * scale))
    width = np.sqrt(max(left, 0.0) / max(fitter.windows.observed - len(values), 1))
    spread = np.maximum(width * np.sqrt(np.diag(inverse)), 1e-30)
    ratio = dict(zip((*keys, *curved), np.abs(values) / spread, strict=True))
    beyond: dict[str, float] = {name: float(ratio[name]) for name in curved}
    for c in candidates:
        beyond[c.name] = max(beyond.get(c.name, 0.0), *(float(ratio[k]) for k in c.keys))
    ranked = sorted(beyond, key=lambda name: -beyond[name])
    return tuple(name for name in ranked if beyond[name] > BEYOND)


@dataclass(frozen=True, kw_only=True)
class Question:
    """One log, prepared for the methods.

    Args:
        table: one-step regression.
        plain: windows with exact stated values in calm air.
        tolerant: windows with the tolerances of the data sheet and the stated gusts.
    """

    table: Regression
    plain: Fitter
    tolerant: Fitter

    @classmethod
    def of(cls, problem: Problem) -> Question:
        """Prepare a log for the methods."""
        return cls(table=Regression.of(problem), plain=plain(problem), tolerant=problem.fitter)


METHODS: Mapping[str, Callable[[Question], Names]] = {
    "one-step STLSQ": lambda q: one_step_sparse(q.table),
    "one-step group BIC": lambda q: _one_step_bic(q.table),
    "multi-shoot BIC": lambda q: _multi_shoot_bic(q.table.curved, q.plain),
    "all at once": lambda q: _all_at_once(q.table.curved, q.plain),
    "BIC with tolerances": lambda q: _multi_shoot_bic(q.table.curved, q.tolerant),
}
"""By the name in the table. The last has all of the engine's model of what is uncertain, and lacks
its price of freedom, its search for more than one effect, and its ways to abstain."""
