"""Excitation of a log: expected gain of each effect at a plausible size."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seals.least_squares import solve_scaled
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.predictors.linear_screen import candidate_keys, screen
from seals.sysid.predictors.windows_fit import Fitter
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


def expected_gains(base: EvidenceHypothesis, *, more: float = 1.0) -> Mapping[str, float]:
    """Predict the decrease of the misfit by each candidate at its plausible size.

    Args:
        base: model that they would extend.
        more: times the readings of the log. However many there are, an effect stays hidden that
            is smaller than a stated tolerance which does the same, such as a second linear drag.

    Returns:
        Gain by label of the candidate; the best of its directions counts.
    """
    fitter = base.fitter
    candidate_set = fitter.candidate_set
    candidates = [c for c in candidate_set.candidates if not c.identification.guessed]
    about = fitter.start(base.fit.free)
    table = screen(fitter, about, candidate_keys(candidates))
    total = more * table.normal.sum(axis=0)
    return {c.label: _gain(fitter, total, table.keys, c) for c in candidates}


def best_gains(gains: Mapping[str, float]) -> dict[str, float]:
    """Return the largest gain of each effect, by name.

    Args:
        gains: by label, which says a medium or a place behind the name.

    Example:
        >>> best_gains({"linear_drag (medium 0)": 3.0, "linear_drag (medium 1)": 5.0})
        {'linear_drag': 5.0}
    """
    best: dict[str, float] = {}
    for label, gain in gains.items():
        name = label.partition(" ")[0]
        best[name] = max(best.get(name, 0.0), gain)
    return best


def _gain(fitter: Fitter, total: np.ndarray, keys: tuple[str, ...], candidate: Candidate) -> float:
    # what the other numbers cannot take over: the Schur complement A - C^T (B + P)^-1 C, with P
    # their tolerances' precision
    parameters = fitter.candidate_set.parameters
    own = [keys.index(k) for k in candidate.keys]
    rest = [keys.index(k) for k in fitter.tolerances if k not in candidate.keys]
    block = total[np.ix_(own, own)]
    held = total[np.ix_(rest, rest)] + np.diag(fitter.precision([keys[i] for i in rest], ()))
    cross = total[np.ix_(rest, own)]
    solved = np.stack([solve_scaled(held, c) for c in cross.T], axis=1)
    left = block - cross.T @ solved
    size = np.array([parameters[k].scale for k in candidate.keys])
    # what the effect may be within its own tolerance cannot be told from it
    width = np.array([parameters[k].tolerance for k in candidate.keys])
    spread = np.linalg.inv(left + 1e-12 * np.diag(np.diag(left) + 1e-12)) + np.diag(width**2)
    return float(size @ np.linalg.solve(spread, size))
