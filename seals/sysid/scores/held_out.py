"""Held-out misfit of a hypothesis: every block of windows predicted by a fit to the others."""

from __future__ import annotations

import numpy as np

from seals.arrays import Floats
from seals.sysid.least_squares.normal_equations import solve_scaled
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis

FOLDS = 5
"""Parts of the log that are held out in turn."""


def held_out_misfit(hypothesis: EvidenceHypothesis) -> float:
    """Misfit per degree of freedom of windows that the fit did not see, by blocks."""
    return float(held_out_by_window(hypothesis).sum() / hypothesis.fitter.windows.observed)


def held_out_by_window(hypothesis: EvidenceHypothesis) -> Floats:
    """Held-out misfit of every window, shape (W,); each is predicted by a fit to other blocks."""
    fit, count = hypothesis.fit, hypothesis.fitter.windows.count
    fold = np.arange(count) * min(FOLDS, count) // count
    at = np.array([fit.values[k] for k in fit.keys])
    out = np.empty(count)
    for part in range(int(fold.max()) + 1):
        test = fold == part
        matrix = fit.normal[~test].sum(axis=0) + np.diag(fit.precision)
        gradient = fit.right[~test].sum(axis=0) - fit.precision * (at - fit.centre)
        step = solve_scaled(matrix, gradient)
        inner = np.einsum("i,wij,j->w", step, fit.normal[test], step)
        out[test] = fit.misfit[test] - 2.0 * fit.right[test] @ step + inner
    return out


def held_out_fall(smaller: EvidenceHypothesis, larger: EvidenceHypothesis) -> float:
    """Fall of the held-out misfit by the effects that one of two hypotheses has more [chi2].

    What the larger one saves by moving nominal values less within their tolerances counts as well.

    Args:
        smaller: with fewer effects.
        larger: with more effects.
    """
    before, after = (
        float(held_out_by_window(h).sum()) + h.fit.penalty - h.fitter.windows.observed
        for h in (smaller, larger)
    )
    return before - after
