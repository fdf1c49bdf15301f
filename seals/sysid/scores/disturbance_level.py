"""Level of the unmodelled force (gusts), chosen by evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from seals.sysid.predictors.normal_equations import newton_step
from seals.sysid.predictors.problem import rewindowed
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis, occam_factor

LEVELS = (0.7, 1.0, 1.5, 2.5, 6.0, 20.0)
"""Factors on the gusts that are compared."""


@dataclass(frozen=True, kw_only=True)
class DisturbanceLevel:
    """Level of the gusts with the best evidence under one hypothesis.

    Args:
        level: factor on the assumed gusts with the best evidence.
        gain: twice the log of that evidence against the assumed gusts.
        allowance: the same for the best of the levels that the stated one admits, being good to a
            factor of two.
        between: the likeliest factor between those compared.
    """

    level: float
    gain: float
    allowance: float
    between: float


def disturbance_level(hypothesis: EvidenceHypothesis) -> DisturbanceLevel:
    """Find the level of the gusts with the best evidence at the values of a hypothesis."""
    fitter = hypothesis.fitter
    scores, whitened = {}, fitter.whitened_residuals(hypothesis.fit)
    for level in LEVELS:
        other = rewindowed(fitter, gusts=level)
        fit = other.reevaluated(hypothesis.fit, whitened=whitened)
        promised = newton_step(fit)[1]
        scores[level] = (
            fit.cost - promised + occam_factor(fit, other.candidate_set) + other.windows.volume
        )
    best = min(scores, key=lambda s: scores[s])
    most = fitter.candidate_set.policy.disturbance_admitted
    admitted = min(score for level, score in scores.items() if level <= most)
    return DisturbanceLevel(
        level=best,
        gain=scores[1.0] - scores[best],
        allowance=scores[1.0] - admitted,
        between=lowest_between(scores),
    )


def lowest_between(scores: Mapping[float, float]) -> float:
    """Return where a parabola in the logarithm of the level is lowest.

    Args:
        scores: by level, ascending; the parabola goes through the lowest and its neighbours.

    Returns:
        The level; the lowest one itself at either end.

    Example:
        >>> round(lowest_between({1.0: 2.0, 2.0: 1.0, 4.0: 2.0}), 6)
        2.0
    """
    levels = list(scores)
    k = min(range(len(levels)), key=lambda i: scores[levels[i]])
    if not 0 < k < len(levels) - 1:
        return levels[k]
    place = np.log(levels[k - 1 : k + 2])
    curve = np.polyfit(place, [scores[level] for level in levels[k - 1 : k + 2]], 2)
    return float(np.exp(-0.5 * curve[1] / curve[0])) if curve[0] > 0.0 else levels[k]
