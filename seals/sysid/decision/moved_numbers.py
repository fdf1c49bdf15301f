"""Stated numbers that the log moves out of their tolerances.

Every fit may move the stated numbers within their tolerances, so that a wrong one takes over what
it does in silence. Here is the test for one that lies too far off to be chance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import stdtrit

from seals.sysid.scores.laplace_evidence import EvidenceHypothesis


@dataclass(frozen=True, kw_only=True)
class MovedNumber:
    """Stated number and its change by a fit.

    Args:
        key: of its parameter.
        change: of the parameter.
        sigmas: change over the stated tolerance (1-sigma).
        unknown: standard error of ``sigmas``; near 1 the log says nothing about the number.
    """

    key: str
    change: float
    sigmas: float
    unknown: float

    @property
    def effect(self) -> str:
        """Instance of the effect whose number it is."""
        return self.key.partition(".")[0]

    @property
    def determined(self) -> float:
        """Variance of ``sigmas`` over logs of vehicles that keep their tolerances."""
        return max(1.0 - self.unknown**2, 0.0)


def moved_numbers(hypothesis: EvidenceHypothesis) -> tuple[MovedNumber, ...]:
    """Return every number with a tolerance, largest change in tolerances first."""
    fit, parameters = hypothesis.fit, hypothesis.fitter.candidate_set.parameters
    if not fit.keys:
        return ()
    covariance = fit.covariance
    out = [
        MovedNumber(
            key=key,
            change=float(fit.values[key]),
            sigmas=float(fit.values[key] / parameters[key].tolerance),
            unknown=float(max(covariance[k, k], 0.0) ** 0.5 / parameters[key].tolerance),
        )
        for k, key in enumerate(fit.keys)
        if key not in fit.free and parameters[key].tolerance > 0.0
    ]
    return tuple(sorted(out, key=lambda m: -abs(m.sigmas)))


def stated_wrong(hypothesis: EvidenceHypothesis, *, extra: float) -> tuple[MovedNumber, ...]:
    """Return the stated numbers that lie too far off to be chance, farthest first.

    The log must determine the number to half its tolerance. Tolerances are rules of thumb, good to
    a factor of two as gusts are: where all other numbers stay well within theirs, the one that
    does not is the odd one; where many are moved, the data sheet is less exact than it says.

    Equation:
        z_i^2 > (b s_i)^2 + extra with z the change in tolerances and b the 1 - p / 2 m quantile of
        Student's law of n + k degrees of freedom, p the chance that one of m determined numbers
        of a right data sheet lies beyond it (Bonferroni);
        s_i^2 = (n + sum z_j^2) / (n + sum (1 - u_j^2)) over the k determined numbers of other
        effects, each z_j no larger than z_i, u their standard errors and n the weight of the
        tolerances as stated (posterior of a common variance whose prior is a scaled inverse
        chi-squared law), and s_i at least a stated share. What moves one coordinate of a bias
        moves the others: they do not speak for a data sheet that is less exact.

    Args:
        hypothesis: model whose numbers were fitted.
        extra: square in tolerances by which inexact laws may move a number besides.
    """
    policy = hypothesis.fitter.candidate_set.policy
    known = [m for m in moved_numbers(hypothesis) if m.unknown < policy.undetermined]
    if not known:
        return ()
    chance, weight = policy.stated_chance / len(known), policy.stated_weight

    def bound(own: MovedNumber) -> float:
        others = [m for m in known if m.effect != own.effect]
        found = weight + sum(min(m.sigmas**2, own.sigmas**2) for m in others)
        size = math.sqrt(found / (weight + sum(m.determined for m in others)))
        quantile = float(stdtrit(weight + len(others), 1.0 - 0.5 * chance))
        return quantile * max(size, policy.stated_least)

    return tuple(m for m in known if m.sigmas**2 > bound(m) ** 2 + extra)
