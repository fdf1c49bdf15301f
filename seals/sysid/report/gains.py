"""Held-out gain of each tried effect, with error bars."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.arrays import Floats
from seals.sysid.diagnosis import FOLDS
from seals.sysid.least_squares.normal_equations import solve_scaled
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.search import Search


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Fall of the held-out error, which is in units of the noise variance.

    Args:
        value: the fall.
        error: its standard error over the windows; None with fewer than three windows.
    """

    value: float
    error: float | None


@dataclass(frozen=True, kw_only=True)
class Step:
    """Model variant of an ablation, with its held-out error.

    Args:
        name: of the model.
        error: held-out error.
        added: effect that was added last; empty for none.
    """

    name: str
    error: float
    added: str = ""


def held_out_by_window(hypothesis: EvidenceHypothesis) -> Floats:
    """Held-out misfit of every window, shape (W,); each is judged by a fit to the other blocks."""
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


def gain_over(base: EvidenceHypothesis, other: EvidenceHypothesis) -> Gain:
    """Held-out error that ``other`` removes beyond ``base``."""
    seen = base.fitter.windows.observed
    before, after = held_out_by_window(base), held_out_by_window(other)
    if before.shape != after.shape:
        return Gain(value=_error(base) - _error(other), error=None)
    # windows that follow a late sensor leave out rows, each worth one
    dropped = (seen - other.fitter.windows.observed) / len(before)
    fall = (before - after - dropped) / seen
    error = float(np.std(fall, ddof=1) * np.sqrt(len(fall))) if len(fall) > 2 else None
    return Gain(value=float(fall.sum()), error=error)


def ablation_steps(search: Search[EvidenceHypothesis]) -> tuple[Step, ...]:
    """Held-out error from the datasheet's model to the chosen one, one change a variant."""
    nominal, best = search.nominal, search.best
    first = nominal.fitter.start(())
    raw = float(first.misfit.sum()) / nominal.fitter.windows.observed
    steps = [
        Step(name="datasheet values", error=raw),
        Step(name="values moved within their tolerances", error=_error(nominal)),
    ]
    wanted = {c.label for c in best.candidates}
    pool = [h for r in search.rounds for h in r if {c.label for c in h.candidates} < wanted]
    have: set[str] = set()
    for size in range(1, len(best.candidates)):
        fitting = [
            h for h in pool if len(h.candidates) == size and have <= {c.label for c in h.candidates}
        ]
        if not fitting:
            continue
        chosen = max(fitting, key=lambda h: h.score)
        labels = {c.label for c in chosen.candidates}
        added = " + ".join(c.name for c in chosen.candidates if c.label not in have)
        steps.append(Step(name=f"+ {added}", error=_error(chosen), added=added))
        have = labels
    if best.candidates:
        added = " + ".join(c.name for c in best.candidates if c.label not in have)
        steps.append(Step(name=f"+ {added}", error=_error(best), added=added))
    return tuple(steps)


def _error(hypothesis: EvidenceHypothesis) -> float:
    total = float(held_out_by_window(hypothesis).sum())
    return total / float(hypothesis.fitter.windows.observed)
