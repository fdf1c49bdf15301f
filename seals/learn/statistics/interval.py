"""An estimate with its interval, and Wilson's interval of a share."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

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
        raise SealsError(f"level={level} is no level of an interval.\nAllowed: 0 to 1, as 0.95")
    return NormalDist().inv_cdf(0.5 + 0.5 * level)


def wilson(successes: int, trials: int, *, level: float = LEVEL) -> Interval:
    """Return a share with Wilson's score interval, which holds near 0 and 1, too.

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
    z2 = normal_quantile(level) ** 2
    share = successes / trials
    centre = share + z2 / (2 * trials)
    half = math.sqrt(z2 * share * (1.0 - share) / trials + (z2 / (2 * trials)) ** 2)
    scale = 1.0 + z2 / trials
    # rounding must not push a limit beyond the estimate
    low = 0.0 if successes == 0 else (centre - half) / scale
    high = 1.0 if successes == trials else (centre + half) / scale
    return Interval(share, low, high)
