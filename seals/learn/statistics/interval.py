"""Estimates with intervals, and comparisons of two arms of few runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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


def _normal_quantile(level: float) -> float:
    """Return the two-sided quantile of the normal distribution.

    Raises:
        SealsError: the level is not between 0 and 1.

    Example:
        >>> round(_normal_quantile(0.95), 6)
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

    _normal_quantile(level)
    found = binomtest(successes, trials).proportion_ci(confidence_level=level, method="wilson")
    return Interval(successes / trials, float(found.low), float(found.high))


def _checked_scores(values: ArrayLike) -> Floats:
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


RESAMPLES = 10_000
"""Resamples of one interval: its limits then move by about a hundredth of its width."""
_CHUNK = 4_000_000
"""Numbers that are drawn at once."""

Statistic = Callable[[Floats], Floats]
"""Takes shape (..., runs), returns shape (...)."""


def iqm(scores: ArrayLike) -> Floats:
    """Return the interquartile mean over the last axis.

    The lowest and the highest quarter of the runs, rounded down to whole runs, are left out: less
    at the mercy of one lucky seed than the mean, and less wasteful than the median. Three runs or
    fewer leave nothing out.

    Args:
        scores: shape (..., runs).

    References:
        Agarwal et al. 2021, Deep reinforcement learning at the edge of the statistical precipice,
        arXiv:2108.13264.

    Example:
        >>> float(iqm([0.0, 0.2, 0.4, 9.0]))
        0.30000000000000004
    """
    ordered = np.sort(np.asarray(scores, dtype=float), axis=-1)
    runs = ordered.shape[-1]
    cut = runs // 4
    return np.asarray(ordered[..., cut : runs - cut].mean(axis=-1), dtype=float)


def bootstrap(
    strata: Sequence[ArrayLike],
    *,
    statistic: Statistic = iqm,
    level: float = LEVEL,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return a statistic of all runs with its percentile interval.

    Each stratum, for instance a task, is resampled by itself and keeps its number of runs; the
    statistic sees all strata in one row.

    Args:
        strata: one array of scores a stratum, each of shape (runs,).
        statistic: takes shape (..., runs), returns shape (...).
        level: of the interval.
        resamples: number of resamples.
        seed: of the draws.

    Raises:
        SealsError: a stratum has fewer than two runs, or a score is not finite.

    Limitations:
        With few runs the interval is too narrow. That of the mean of n normal scores covers
        P(abs(t) < z sqrt(1 - 1/n)), t of n - 1 degrees of freedom: 0.84 for 5 runs, 0.90 for 10,
        0.93 for 20, where 0.95 is asked for.

    Example:
        >>> bootstrap([[0.1, 0.2, 0.3, 0.4]]).value
        0.25
    """
    groups = [_checked_scores(stratum) for stratum in strata]

    def joined(*samples: Floats, axis: int) -> Floats:
        return statistic(np.concatenate(samples, axis=-1))

    low, high = _percentiles(groups, joined, level=level, resamples=resamples, seed=seed)
    return Interval(float(statistic(np.concatenate(groups))), float(low), float(high))


def bootstrap_band(
    curves: ArrayLike,
    *,
    statistic: Statistic = iqm,
    level: float = LEVEL,
    resamples: int = 2_000,
    seed: int = 0,
) -> tuple[Floats, Floats, Floats]:
    """Return a statistic of curves with its percentile interval at every point.

    Whole curves are resampled, since the points of one run hang together.

    Args:
        curves: shape (runs, points).
        statistic: takes shape (..., runs), returns shape (...).
        level: of the interval at each point, not of all points together.
        resamples: number of resamples.
        seed: of the draws.

    Returns:
        Line, lower and upper limit, each of shape (points,).

    Raises:
        SealsError: there are fewer than two runs, or a value is not finite.
    """
    values = np.asarray(curves, dtype=float)
    columns = np.stack([_checked_scores(column) for column in values.T])

    def joined(sample: Floats, *, axis: int) -> Floats:
        return statistic(sample)

    low, high = _percentiles([columns], joined, level=level, resamples=resamples, seed=seed)
    return np.asarray(statistic(columns), dtype=float), low, high


def _percentiles(
    samples: Sequence[Floats],
    statistic: Callable[..., Floats],
    *,
    level: float,
    resamples: int,
    seed: int,
) -> tuple[Floats, Floats]:
    """Return the limits of a percentile interval, by `scipy.stats.bootstrap`.

    Args:
        samples: each resampled by itself along its last axis.
        statistic: takes resampled samples and ``axis=-1``, returns their values.
        level: of the interval.
        resamples: number of resamples.
        seed: of the draws.
    """
    import scipy.stats

    found = scipy.stats.bootstrap(
        samples,
        statistic,
        n_resamples=resamples,
        batch=max(1, _CHUNK // sum(sample.size for sample in samples)),
        vectorized=True,
        axis=-1,
        confidence_level=level,
        method="percentile",
        random_state=np.random.default_rng(seed),
    )
    low, high = found.confidence_interval
    return np.asarray(low), np.asarray(high)


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
    x, y = _checked_scores(better), _checked_scores(worse)
    p = _probability(x, y)
    z2 = _normal_quantile(level) ** 2
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
    x, y = _checked_scores(better), _checked_scores(worse)

    def share(first: Floats, second: Floats, *, axis: int) -> Floats:
        pairs = np.sign(first[..., :, None] - second[..., None, :])
        return 0.5 + 0.5 * np.asarray(pairs.mean(axis=(-2, -1)))

    low, high = _percentiles([x, y], share, level=level, resamples=resamples, seed=seed)
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
    x, y = _checked_scores(better), _checked_scores(worse)
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

    first, second = _checked_scores(x), _checked_scores(y)
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
