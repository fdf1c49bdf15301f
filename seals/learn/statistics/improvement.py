"""Comparison of two arms: probability of improvement, paired seeds, exact rank-sum test."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from seals.arrays import Floats
from seals.errors import SealsError
from seals.learn.statistics.bootstrap import RESAMPLES, percentiles
from seals.learn.statistics.interval import (
    LEVEL,
    Interval,
    checked_scores,
    normal_quantile,
    wilson,
)


def improvement(better: ArrayLike, worse: ArrayLike, *, level: float = LEVEL) -> Interval:
    """Return the probability that a run of one arm scores higher than one of the other.

    Ties count half, as in the statistic of Mann and Whitney. The interval is Newcombe's: it has a
    width even where all runs of one arm lie above all of the other, where a bootstrap has none.

    Equation:
        p = U / (m n);  limits t solve (p - t)^2 = z^2 V(t),
        V(t) = t (1 - t) (1 + k ((1 - t)/(2 - t) + t/(1 + t))) / (m n),  k = (m + n)/2 - 1

    Args:
        better: scores of the arm in question, shape (m,).
        worse: scores of the other, shape (n,).
        level: of the interval.

    Raises:
        SealsError: an arm has fewer than two runs, or a score is not finite.

    Assumptions:
        Runs are independent; the variance is that of two exponential distributions.

    References:
        Newcombe 2006, Statistics in Medicine 25, 559-573, method 5, doi:10.1002/sim.2324;
        Agarwal et al. 2021, arXiv:2108.13264, for the use of the probability.

    Example:
        >>> improvement([0.9, 0.8, 0.95, 0.7, 0.9], [0.1, 0.2, 0.3, 0.1, 0.4]).text()
        '1.00 (0.64 to 1.00)'
    """
    x, y = checked_scores(better), checked_scores(worse)
    p = _probability(x, y)
    z2 = normal_quantile(level) ** 2
    runs = (len(x), len(y))
    low = 0.0 if p == 0.0 else _limit(p, 0.0, z2, runs)
    high = 1.0 if p == 1.0 else _limit(p, 1.0, z2, runs)
    return Interval(p, low, high)


def _probability(x: Floats, y: Floats) -> float:
    """Return the fraction of pairs in which ``x`` is above ``y``; ties count half."""
    above = (x[:, None] > y[None, :]).mean()
    tied = (x[:, None] == y[None, :]).mean()
    return float(above + 0.5 * tied)


def improvement_bootstrap(
    better: ArrayLike,
    worse: ArrayLike,
    *,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return the probability of improvement with a bootstrap percentile interval.

    Each arm is resampled by itself. Two arms that do not overlap give an interval of no width:
    :func:`improvement` is the one to claim by.

    Raises:
        SealsError: an arm has fewer than two runs, or a score is not finite.
    """
    x, y = checked_scores(better), checked_scores(worse)

    def share(first: Floats, second: Floats, *, axis: int) -> Floats:
        pairs = np.sign(first[..., :, None] - second[..., None, :])
        return 0.5 + 0.5 * np.asarray(pairs.mean(axis=(-2, -1)))

    low, high = percentiles([x, y], share, level=level, resamples=resamples, seed=seed)
    return Interval(_probability(x, y), float(low), float(high))


def paired(better: ArrayLike, worse: ArrayLike, *, level: float = LEVEL) -> Interval:
    """Return the fraction of paired seeds in which one arm is above the other, with interval.

    Args:
        better: scores of the arm in question, shape (seeds,).
        worse: scores of the other with the same seeds, in the same order.
        level: of the interval.

    Raises:
        SealsError: the arms differ in their number of runs, or all pairs are tied.
    """
    x, y = checked_scores(better), checked_scores(worse)
    if len(x) != len(y):
        raise SealsError(
            f"{len(x)} and {len(y)} runs cannot be paired.\nGive both arms the same seeds."
        )
    # a tie says nothing on either side, as in the sign test
    apart = int(np.count_nonzero(x != y))
    if apart == 0:
        raise SealsError("all pairs are tied: no arm is above the other.\nLook at the intervals.")
    return wilson(int(np.count_nonzero(x > y)), apart, level=level)


def rank_test(x: ArrayLike, y: ArrayLike) -> float:
    """Return the exact two-sided p value of the rank-sum test, over all permutations.

    Ties get mean ranks. Three runs against three cannot go below 0.1, whatever they show; five
    against five reach 0.008.

    Args:
        x: scores of one arm, shape (m,).
        y: scores of the other, shape (n,).

    Raises:
        SealsError: an arm has fewer than two runs, or a score is not finite.

    References:
        Mann and Whitney 1947, doi:10.1214/aoms/1177730491.

    Example:
        >>> rank_test([1, 2, 3], [4, 5, 6])
        0.1
    """
    from scipy.stats import rankdata

    first, second = checked_scores(x), checked_scores(y)
    # twice the mean ranks, which are whole numbers
    doubled = (2 * rankdata(np.concatenate([first, second]))).astype(int)
    m = len(first)
    centre = m * (len(doubled) + 1)
    seen = abs(int(doubled[:m].sum()) - centre)
    # ways[k][s]: choices of k runs whose doubled ranks add up to s; exact integers
    ways: list[dict[int, int]] = [{0: 1}, *({} for _ in range(m))]
    for rank in map(int, doubled):
        for k in range(m, 0, -1):
            for total, count in ways[k - 1].items():
                ways[k][total + rank] = ways[k].get(total + rank, 0) + count
    extreme = sum(count for total, count in ways[m].items() if abs(total - centre) >= seen)
    return extreme / math.comb(len(doubled), m)


def _variance(t: float, runs: tuple[int, int]) -> float:
    m, n = runs
    k = 0.5 * (m + n) - 1.0
    return t * (1.0 - t) * (1.0 + k * ((1.0 - t) / (2.0 - t) + t / (1.0 + t))) / (m * n)


def _limit(p: float, end: float, z2: float, runs: tuple[int, int]) -> float:
    """Return the root of the score equation between the estimate and an end of the scale."""
    from scipy.optimize import brentq

    def excess(t: float) -> float:
        return (p - t) ** 2 - z2 * _variance(t, runs)

    # where p is 0 or 1 it is a root itself
    return float(brentq(excess, p + 1e-9 * (end - p), end, xtol=1e-14))
