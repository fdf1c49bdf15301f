"""How strong the unmodelled force is: the evidence for gusts of different levels."""

from __future__ import annotations

from dataclasses import dataclass

from seals.sysid.hypothesis import Hypothesis, price
from seals.sysid.normal import newton_step
from seals.sysid.problem import rewindowed

LEVELS = (0.7, 1.0, 1.5, 2.5, 6.0, 20.0)
"""Factors on the gusts that are compared."""


@dataclass(frozen=True, kw_only=True)
class Unrest:
    """Evidence for stronger or weaker gusts under one hypothesis.

    Args:
        level: factor on the assumed gusts with the best evidence.
        gain: twice the log of that evidence against the assumed gusts.
        allowance: the same for the best of the levels that the stated one admits, being good to a
            factor of two.
    """

    level: float
    gain: float
    allowance: float


def unrest(hypothesis: Hypothesis) -> Unrest:
    """Compare levels of the gusts at the values of a hypothesis."""
    fitter = hypothesis.fitter
    scores, seen = {}, fitter.seen(hypothesis.fit)
    for level in LEVELS:
        other = rewindowed(fitter, gusts=level)
        fit = other.again(hypothesis.fit, seen=seen)
        promised = newton_step(fit)[1]
        scores[level] = fit.cost - promised + price(fit, other.library) + other.windows.volume
    best = min(scores, key=lambda s: scores[s])
    most = fitter.library.policy.disturbance_admitted
    admitted = min(score for level, score in scores.items() if level <= most)
    return Unrest(level=best, gain=scores[1.0] - scores[best], allowance=scores[1.0] - admitted)
