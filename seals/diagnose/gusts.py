"""How strong the unmodelled force is: the evidence for gusts of different levels."""

from __future__ import annotations

from dataclasses import dataclass

from seals.diagnose.fit import newton_step
from seals.diagnose.hypothesis import Hypothesis, price
from seals.diagnose.problem import GUSTS, rewindowed

LEVELS = (0.7, 1.0, 1.5, 2.5, 6.0, 20.0)
"""Factors on the gusts that are compared."""


@dataclass(frozen=True, kw_only=True)
class Unrest:
    """Evidence for stronger or weaker gusts under one hypothesis.

    Args:
        level: factor on the assumed gusts with the best evidence.
        gain: twice the log of that evidence against the assumed gusts.
    """

    level: float
    gain: float


def unrest(hypothesis: Hypothesis) -> Unrest:
    """Compare levels of the gusts at the values of a hypothesis."""
    fitter = hypothesis.fitter
    scores = {}
    for level in LEVELS:
        other = rewindowed(fitter, gusts=level * GUSTS)
        fit = other.again(hypothesis.fit)
        promised = newton_step(fit)[1]
        scores[level] = fit.cost - promised + price(fit, other.library) + other.windows.volume
    best = min(scores, key=lambda s: scores[s])
    return Unrest(level=best, gain=scores[1.0] - scores[best])
