"""Misfit of a hypothesis: held out, of the stated model, and what one of its effects lowers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.least_squares import solve_scaled
from seals.sysid.candidates.activity import log_rows
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.predictors.linearise import predict
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

FOLDS = 5
"""Parts of the log that are held out in turn."""


def held_out_misfit(hypothesis: EvidenceHypothesis) -> float:
    """Return the cross-validated misfit per degree of freedom."""
    return float(held_out_by_window(hypothesis).sum() / hypothesis.fitter.windows.observed)


def stated_misfit(nominal: EvidenceHypothesis) -> float:
    """Return the misfit per degree of freedom of the stated model, none of its numbers fitted."""
    fitter, windows = nominal.fitter, nominal.fitter.windows
    return windows.level(predict(fitter.plant, fitter.trajectory, {}, delay=windows.delay))


def fall_by(hypothesis: EvidenceHypothesis, candidate: Candidate) -> float:
    """Return the share by which one effect of a model lowers the misfit, all numbers as fitted.

    A tolerance that would take over what the effect does is not asked: that it would be moved is
    what speaks for the effect.
    """
    fitter, values = hypothesis.fitter, hypothesis.fit.values
    without = {**values, **dict.fromkeys(candidate.all_keys, 0.0)}
    after, before = (
        float(misfit.product(misfit).sum()) for misfit in map(fitter.misfit, (values, without))
    )
    return 1.0 - after / before


def held_out_by_log(hypothesis: EvidenceHypothesis) -> Floats:
    """Return the cross-validated misfit per degree of freedom of each log, shape (logs,).

    NaN for a log without a window.
    """
    windows, misfit = hypothesis.fitter.windows, held_out_by_window(hypothesis)
    first = windows.rows[:, 0]
    spans = log_rows(hypothesis.fitter.plant.samples)
    inside = [(first >= begin) & (first < end) for begin, end in spans]
    return np.array(
        [misfit[own].sum() / windows.freedom[own].sum() if own.any() else np.nan for own in inside]
    )


def explained_by_log(nominal: EvidenceHypothesis, best: EvidenceHypothesis) -> Floats:
    """Return the share of each log's excess held-out misfit that a model explains, shape (logs,).

    Equation:
        (before - after) / (before - 1), no less than zero; 1 where `after` is as low as a complete
        model's, the policy's `misfit_trusted`, or the log has no window.

    Args:
        nominal: model without effects.
        best: chosen model.
    """
    before, after = held_out_by_log(nominal), held_out_by_log(best)
    left = after > best.fitter.candidate_set.policy.misfit_trusted
    share: Floats = np.clip((before - after) / np.maximum(before - 1.0, after - 1.0), 0.0, 1.0)
    return np.where(left, share, 1.0)


def folds_of(hypothesis: EvidenceHypothesis) -> NDArray[np.int64]:
    """Return the cross-validation fold of every window, shape (W,).

    Parts are blocks of the log. Where effects act for a time, the windows in which the same ones
    act are dealt out to the parts block by block: no part holds all that is known of an effect.
    """
    windows = hypothesis.fitter.windows
    acting = np.zeros((windows.count, 1), dtype=bool)
    for activity in (c.activity for c in hypothesis.candidates if c.activity is not None):
        weights = activity.weights(hypothesis.fitter.plant.samples)[windows.rows]
        acting = np.concatenate([acting, weights.mean(axis=1, keepdims=True) > 0.5], axis=1)
    fold = np.zeros(windows.count, dtype=np.int64)
    for kind in np.unique(acting, axis=0):
        own = np.flatnonzero((acting == kind).all(axis=1))
        fold[own] = np.arange(len(own)) * min(FOLDS, len(own)) // len(own)
    return fold


def held_out_by_window(
    hypothesis: EvidenceHypothesis, fold: NDArray[np.int64] | None = None
) -> Floats:
    """Return the held-out misfit of every window, predicted by a fit to other folds, shape (W,).

    Args:
        hypothesis: fitted to all windows.
        fold: part of each window, shape (W,); those of `folds_of` when left out.
    """
    fit, count = hypothesis.fit, hypothesis.fitter.windows.count
    fold = folds_of(hypothesis) if fold is None else fold
    out = np.empty(count)
    for part in range(int(fold.max()) + 1):
        test = fold == part
        step = solve_scaled(*fit.system(~test))
        inner = np.einsum("i,wij,j->w", step, fit.normal[test], step)
        out[test] = fit.misfit[test] - 2.0 * fit.right[test] @ step + inner
    return out


def held_out_fall(smaller: EvidenceHypothesis, larger: EvidenceHypothesis) -> float:
    """Return the decrease of the held-out misfit from one hypothesis to a larger one [chi2].

    What the larger one saves by moving nominal values less within their tolerances counts as well.
    """
    fold = folds_of(larger)
    before, after = (
        float(held_out_by_window(h, fold).sum()) + h.fit.penalty - h.fitter.windows.observed
        for h in (smaller, larger)
    )
    return float(before - after)
