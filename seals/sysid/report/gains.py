"""Held-out gain of each tried effect, with error bars."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from seals.sysid.scores.held_out import held_out_by_window, held_out_misfit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection.search import Search


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Decrease of the held-out error, in units of the noise variance.

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


def gain_over(base: EvidenceHypothesis, other: EvidenceHypothesis) -> Gain:
    """Decrease of the held-out error from ``base`` to ``other``."""
    seen = base.fitter.windows.observed
    before, after = held_out_by_window(base), held_out_by_window(other)
    if before.shape != after.shape:
        return Gain(value=held_out_misfit(base) - held_out_misfit(other), error=None)
    # windows that follow a late sensor leave out rows, each worth one
    dropped = (seen - other.fitter.windows.observed) / len(before)
    fall = (before - after - dropped) / seen
    error = float(np.std(fall, ddof=1) * np.sqrt(len(fall))) if len(fall) > 2 else None
    return Gain(value=float(fall.sum()), error=error)


def ablation_steps(search: Search[EvidenceHypothesis]) -> tuple[Step, ...]:
    """Held-out errors from the stated model to the chosen one, one change at a time."""
    nominal, best = search.nominal, search.best
    first = nominal.fitter.start(())
    raw = float(first.misfit.sum()) / nominal.fitter.windows.observed
    steps = [
        Step(name="data sheet values", error=raw),
        Step(name="values fitted within their tolerances", error=held_out_misfit(nominal)),
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
        steps.append(Step(name=f"+ {added}", error=held_out_misfit(chosen), added=added))
        have = labels
    if best.candidates:
        added = " + ".join(c.name for c in best.candidates if c.label not in have)
        steps.append(Step(name=f"+ {added}", error=held_out_misfit(best), added=added))
    return tuple(steps)
