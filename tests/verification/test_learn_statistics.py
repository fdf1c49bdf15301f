"""Intervals and tests against published values, closed forms and simulated coverage."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from seals.errors import SealsError
from seals.learn.statistics.curve import area, curve, held, last_mean, metric, on_grid
from seals.learn.statistics.interval import (
    bootstrap,
    bootstrap_band,
    improvement,
    improvement_bootstrap,
    iqm,
    paired,
    rank_test,
    wilson,
)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        # Newcombe 1998, Statistics in Medicine 17, 857-872, table I, score method
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_is_the_published_interval(
    successes: int, trials: int, low: float, high: float
) -> None:
    """Wilson's interval has the four digits of the published examples."""
    found = wilson(successes, trials)
    assert found.low == pytest.approx(low, abs=5e-5)
    assert found.high == pytest.approx(high, abs=5e-5)


def test_wilson_covers_as_it_says() -> None:
    """Over all shares, the exact coverage for 100 trials is 95 % in the mean."""
    limits = [wilson(k, 100) for k in range(101)]
    shares = np.linspace(0.005, 0.995, 199)
    mass = scipy.stats.binom.pmf(np.arange(101)[:, None], 100, shares[None, :])
    inside = np.array([(x.low <= shares) & (shares <= x.high) for x in limits])
    coverage = (mass * inside).sum(axis=0)
    assert coverage.mean() == pytest.approx(0.95, abs=0.005)
    assert coverage[(shares > 0.1) & (shares < 0.9)].min() > 0.92


def test_iqm_is_the_trimmed_mean() -> None:
    """A quarter of the runs, rounded down, is left out at either end."""
    random = np.random.default_rng(1)
    for runs in range(2, 14):
        scores = random.normal(size=(5, runs))
        expected = scipy.stats.trim_mean(scores, 0.25, axis=1)
        np.testing.assert_allclose(iqm(scores), expected, rtol=1e-12)


def test_strata_are_resampled_by_themselves() -> None:
    """The variance of the resampled mean is that of the strata, not that between them."""
    random = np.random.default_rng(4)
    low, high = random.normal(0.0, 0.2, 40), random.normal(10.0, 0.5, 30)
    # mean of N draws, n_k of them from stratum k: sum n_k var_k / N^2
    expected = (40 * low.var() + 30 * high.var()) / 70**2
    found = bootstrap(
        [low, high], statistic=lambda x: x.mean(axis=-1), level=0.6827, resamples=40_000, seed=3
    )
    # a mean of seventy draws is nearly normal: one deviation to either side
    assert (found.high - found.low) / 2 == pytest.approx(math.sqrt(expected), rel=0.04)
    assert found.value == pytest.approx(np.concatenate([low, high]).mean())


@pytest.mark.parametrize("runs", [5, 10, 20])
def test_bootstrap_covers_as_theory_says(runs: int) -> None:
    """Of the mean of normal scores the percentile interval covers what Student's t predicts."""
    reach = 1.959964 * math.sqrt(1.0 - 1.0 / runs)
    expected = 1.0 - 2.0 * scipy.stats.t.sf(reach, runs - 1)
    random = np.random.default_rng(runs)
    trials, hits = 1000, 0
    for k in range(trials):
        found = bootstrap(
            [random.normal(size=runs)],
            statistic=lambda x: x.mean(axis=-1),
            resamples=600,
            seed=k,
        )
        hits += found.low <= 0.0 <= found.high
    error = math.sqrt(expected * (1.0 - expected) / trials)
    assert hits / trials == pytest.approx(expected, abs=4.0 * error)


def test_a_band_resamples_whole_curves() -> None:
    """Runs that differ by a shift have a band of one width: no point is drawn by itself."""
    shifts, rise = np.random.default_rng(2).normal(size=10), np.linspace(0.0, 3.0, 7)
    line, low, high = bootstrap_band(shifts[:, None] + rise)
    np.testing.assert_allclose(line, iqm(shifts) + rise, rtol=1e-12)
    assert np.ptp(high - low) < 1e-12
    expected = bootstrap([shifts], resamples=40_000)
    # limits from 2,000 draws are good to a few hundredths of the width
    assert high[0] - low[0] == pytest.approx(expected.high - expected.low, rel=0.08)


def _alternative_variance(t: float, m: int, n: int) -> float:
    """The same variance in the other form in print: (2N - 1) - (3N - 3)/((2 - t)(1 + t))."""
    mean = 0.5 * (m + n)
    return t * (1 - t) / (m * n) * ((2 * mean - 1) - (3 * mean - 3) / ((2 - t) * (1 + t)))


@pytest.mark.parametrize(("m", "n", "moved"), [(10, 10, 0), (10, 10, 1), (5, 8, 2), (30, 7, 5)])
def test_improvement_limits_solve_the_equation(m: int, n: int, moved: int) -> None:
    """Both limits are roots of the score equation, found by another solver and another form."""
    x, y = np.arange(m) + 100.0, np.arange(n, dtype=float)
    x[:moved] -= 97.5
    found = improvement(x, y)
    p = float((x[:, None] > y).mean())
    assert found.value == p

    def equation(t: float) -> float:
        return (p - t) ** 2 - 1.959963985**2 * _alternative_variance(t, m, n)

    assert found.low == pytest.approx(scipy.optimize.brentq(equation, 1e-9, p - 1e-6), abs=1e-7)
    if p < 1.0:
        above = scipy.optimize.brentq(equation, p + 1e-6, 1.0 - 1e-9)
        assert found.high == pytest.approx(above, abs=1e-7)
    else:
        assert found.high == 1.0


@pytest.mark.parametrize("truth", [0.5, 0.8, 0.95])
def test_improvement_covers(truth: float) -> None:
    """Ten runs against ten of exponential scores: the truth lies inside about 95 % of the time."""
    random = np.random.default_rng(int(100 * truth))
    # P(X > Y) = b / (a + b) for exponential X and Y of means b and a
    x = random.exponential(truth / (1.0 - truth), size=(1500, 10))
    y = random.exponential(1.0, size=(1500, 10))
    found = [improvement(a, b) for a, b in zip(x, y, strict=True)]
    coverage = np.mean([f.low <= truth <= f.high for f in found])
    assert 0.935 < coverage < 0.99


def test_the_bootstrap_of_improvement_is_the_published_one() -> None:
    """Its spread is that of resampled pairs; arms that do not meet leave it without width."""
    random = np.random.default_rng(5)
    x, y = random.normal(0.7, 1.0, 10), random.normal(0.0, 1.0, 10)
    found = improvement_bootstrap(x, y, resamples=4000)
    rows = random.integers(0, 10, size=(4000, 10))
    columns = random.integers(0, 10, size=(4000, 10))
    plain = (x[rows][:, :, None] > y[columns][:, None, :]).mean(axis=(1, 2))
    assert found.low == pytest.approx(np.quantile(plain, 0.025), abs=0.03)
    assert found.high == pytest.approx(np.quantile(plain, 0.975), abs=0.03)
    assert tuple(improvement_bootstrap(x + 50, y, resamples=50)) == (1.0, 1.0, 1.0)


def test_rank_test_is_exact() -> None:
    """Published ends for small arms, SciPy's exact p without ties, all deals with ties."""
    assert rank_test([1, 2, 3], [4, 5, 6]) == pytest.approx(0.1)
    # two of the 252 ways to choose five of ten
    assert rank_test(range(5), range(5, 10)) == pytest.approx(2 / 252)
    random = np.random.default_rng(8)
    for _ in range(20):
        x, y = random.normal(0.4, 1.0, 7), random.normal(0.0, 1.0, 6)
        expected = scipy.stats.mannwhitneyu(x, y, method="exact").pvalue
        assert rank_test(x, y) == pytest.approx(float(expected), abs=1e-12)
        coarse = [np.round(v).tolist() for v in (x, y)]
        assert rank_test(*coarse) == pytest.approx(_all_deals(*coarse), abs=1e-12)


def _all_deals(x: list[float], y: list[float]) -> float:
    ranks = scipy.stats.rankdata([*x, *y])
    centre = len(x) * (len(ranks) + 1) / 2
    seen = abs(ranks[: len(x)].sum() - centre) - 1e-9
    sums = [abs(sum(deal) - centre) for deal in itertools.combinations(ranks, len(x))]
    return float(np.mean([s >= seen for s in sums]))


def test_pairs_are_counted_without_ties() -> None:
    """Nine pairs up, one down, two tied: 9 of 10 with Wilson's interval."""
    x, y = np.arange(12.0), np.arange(12.0) - 1.0
    y[0], y[1:3] = 5.0, x[1:3]
    assert paired(x, y) == wilson(9, 10)
    with pytest.raises(SealsError, match="the same seeds"):
        paired(x, y[:-1])
    with pytest.raises(SealsError, match="all pairs are tied"):
        paired(x, x)


def test_the_area_is_the_integral() -> None:
    """Straight lines are integrated exactly, a parabola to the trapezoid's error, cuts included."""
    steps = np.linspace(0.0, 50_000.0, 26)
    assert area(curve(steps, steps / 50_000), budget=50_000) == pytest.approx(0.5)
    assert area(curve(steps, steps / 50_000), budget=33_333) == pytest.approx(33_333 / 100_000)
    # h^2 / 6 above 1/3 for the trapezoid rule with step h = 1/25
    parabola = area(curve(steps, (steps / 50_000) ** 2), budget=50_000)
    assert parabola == pytest.approx(1 / 3 + 1 / (6 * 25**2), rel=1e-9)
    # what lies before the first evaluation earns nothing
    assert area(curve([50.0, 100.0], [1.0, 1.0]), budget=100) == pytest.approx(0.5)


def test_the_end_is_the_last_tenth() -> None:
    """Evaluations at 45,000 and later of 50,000 count, and nothing after the budget."""
    line = curve([44_999, 45_000, 50_000, 60_000], [9.0, 0.5, 0.7, 9.0])
    assert last_mean(line, budget=50_000) == pytest.approx(0.6)
    with pytest.raises(SealsError, match="Evaluate more often"):
        last_mean(curve([0, 10, 100], [0, 0, 0]), budget=90)


def test_short_and_broken_curves_are_refused() -> None:
    """A run that stopped before the budget, went back or holds NaN is not compared in silence."""
    line = curve([0, 10, 20], [0.0, 0.5, 1.0])
    with pytest.raises(SealsError, match="ends at 20, and the budget is 30"):
        area(line, budget=30)
    assert area(held(line, budget=40), budget=40) == pytest.approx((10 + 20) / 40)
    with pytest.raises(SealsError, match="is not increasing at point 2"):
        curve([0, 10, 5], [0, 0, 0])
    with pytest.raises(SealsError, match="not finite"):
        curve([0, 10], [0, math.nan])
    with pytest.raises(SealsError, match="Did you mean 'area'"):
        metric("aera", line, budget=20)


def test_curves_share_a_grid() -> None:
    """Evaluations at the same steps are kept; others meet on an even grid, straight between."""
    same = [curve([0, 10, 20], [0, 1, 2]), curve([0, 10, 20], [0, 2, 4])]
    x, values = on_grid(same, budget=15)
    assert x.tolist() == [0, 10]
    assert values.tolist() == [[0, 1], [0, 2]]
    x, values = on_grid([same[0], curve([5, 20], [0, 3])], budget=20, points=4)
    assert x.tolist() == [5, 10, 15, 20]
    np.testing.assert_allclose(values, [[0.5, 1, 1.5, 2], [0, 1, 2, 3]])


def test_too_little_is_refused() -> None:
    """One run, no trials or a score that is not finite are refused in words."""
    with pytest.raises(SealsError, match="at least two runs"):
        bootstrap([[1.0]])
    with pytest.raises(SealsError, match="at least two runs of each arm"):
        improvement([1.0], [2.0, 3.0])
    with pytest.raises(SealsError, match="not finite"):
        improvement([1.0, math.inf], [2.0, 3.0])
    with pytest.raises(SealsError, match="no share"):
        wilson(3, 2)
    with pytest.raises(SealsError, match="not a level"):
        wilson(1, 2, level=95)
