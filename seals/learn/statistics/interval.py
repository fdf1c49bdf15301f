"""Estimates with intervals, and Wilson's interval of a proportion."""

from __future__ import annotations

from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from seals.arrays import Floats
from seals.errors import SealsError

LEVEL = 0.95
"""Level of an interval where none is given."""


class Interval(NamedTuple):
    """An estimate between two limits.

    Args:
        value: the estimate.
        low: lower limit.
        high: upper limit.
    """

    value: float
    low: float
    high: float

    def text(self, digits: int = 2) -> str:
        """Return the estimate and its limits.

        Example:
            >>> Interval(0.5, 0.4, 0.6).text()
            '0.50 (0.40 to 0.60)'
        """
        value, low, high = (f"{x:.{digits}f}" for x in self)
        return f"{value} ({low} to {high})"


def normal_quantile(level: float) -> float:
    """Return the two-sided quantile of the normal distribution.

    Raises:
        SealsError: the level is not between 0 and 1.

    Example:
        >>> round(normal_quantile(0.95), 6)
        1.959964
    """
    if not 0.0 < level < 1.0:
        raise SealsError(f"level={level} is not a level of an interval.\nAllowed: 0 to 1, as 0.95")
    return NormalDist().inv_cdf(0.5 + 0.5 * level)


def wilson(successes: int, trials: int, *, level: float = LEVEL) -> Interval:
    """Return a proportion with Wilson's score interval, valid near 0 and 1 too.

    Equation:
        (p + z^2/2n +- z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n), p = successes / n

    Args:
        successes: number of trials that succeeded.
        trials: n, at least 1.
        level: of the interval.

    Raises:
        SealsError: there are no trials, or more successes than trials.

    References:
        Wilson 1927, doi:10.1080/01621459.1927.10502953.

    Example:
        >>> wilson(15, 20).text()
        '0.75 (0.53 to 0.89)'
    """
    if not 0 <= successes <= trials or trials < 1:
        raise SealsError(
            f"{successes} successes in {trials} trials have no share.\n"
            "Allowed: at least one trial, and no more successes than trials."
        )
    from scipy.stats import binomtest

    normal_quantile(level)
    found = binomtest(successes, trials).proportion_ci(confidence_level=level, method="wilson")
    return Interval(successes / trials, float(found.low), float(found.high))


def checked_scores(values: ArrayLike) -> Floats:
    """Return scores of the runs of one arm as an array, shape (runs,).

    Raises:
        SealsError: there are fewer than two runs, or a score is not finite.
    """
    scores = np.asarray(values, dtype=float)
    if scores.ndim != 1 or len(scores) < 2:
        raise SealsError(
            f"an arm with scores of shape {scores.shape} cannot be compared.\n"
            "Give at least two runs of each arm: train with more seeds."
        )
    if not np.isfinite(scores).all():
        raise SealsError(
            f"a score is not finite: {scores.tolist()}.\nCheck the run that produced it."
        )
    return scores
