"""Solver, search and verdicts of naming from several runs, on models that are sums of curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from seals.compare.predict import Job
from seals.compare.sampled import bare_case
from seals.compare.settings import CompareSettings
from seals.compare.solve import FitTask
from seals.least_squares import bounded_step
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.decision.cross_validation import decide
from seals.sysid.predictors.batch import Experiment, RunFitter, spread_of
from seals.sysid.scores.cross_validation import CrossValidator
from seals.sysid.selection.run_models import search_runs

TIME = np.linspace(0.0, 2.0, 60)
SIGMA = 0.05
RUNS = 6
CURVES = {
    "line": lambda t, c: (1.0 + 0.3 * c) * t,
    "wave": lambda t, c: np.cos(7.0 * t + c),
    "line_twin": lambda t, c: (1.0 + 0.3 * c) * (t + 0.002 * np.sin(9.0 * t)),
    "half_up": lambda t, c: 5.0 * t + np.sin(3.0 * t + c),
    "half_down": lambda t, c: -5.0 * t + np.sin(3.0 * t + c),
}


class Curves:
    """A predictor whose sample is a function of the values, the run and time."""

    def __init__(self, law: Any) -> None:
        """Keep the law."""
        self.law = law

    def run(self, jobs: Sequence[Job]) -> list[dict[str, np.ndarray]]:
        """Return the depth of every job."""
        return [{"depth": self.law(j.values, j.case)[:, None]} for j in jobs]


def experiment(
    names: Sequence[str], measured: Sequence[np.ndarray], law: Any, **key: Any
) -> Experiment:
    """An experiment of one channel with one key for every candidate."""
    known = {"nominal": 0.0, "start": 0.0, "scale": 1.0, "bounds": (-1e3, 1e3), **key}
    keys = {f"{n}.size": Parameter(key=f"{n}.size", **known) for n in names}
    found = tuple(Candidate(name=n, keys=(f"{n}.size",)) for n in names)
    cases = tuple(
        bare_case(f"run_{k}", TIME, {"depth": y[:, None]}, {"depth": np.array([SIGMA])}, speed=2.0)
        for k, y in enumerate(measured)
    )
    candidate_set = CandidateSet(effects={}, parameters=keys, candidates=found)
    return Experiment(
        settings=CompareSettings(),
        candidate_set=candidate_set,
        cases=cases,
        predictor=Curves(law),  # type: ignore[arg-type]
        names=tuple(keys),
        fold={k: k for k in range(len(cases))},
    )


def of_curves(names: Sequence[str], truth: dict[str, float], *, extra: Any = None) -> Experiment:
    """Runs made of known multiples of known curves, with noise."""
    noise = np.random.default_rng(7)
    measured = []
    for c in range(RUNS):
        y = sum(size * CURVES[n](TIME, c) for n, size in truth.items()) + 0.0 * TIME
        y = y if extra is None else y + extra(TIME, c)
        measured.append(y + SIGMA * noise.standard_normal(TIME.size))

    def law(values: np.ndarray, case: int) -> np.ndarray:
        parts = zip(names, values, strict=True)
        return sum((v * CURVES[n](TIME, case) for n, v in parts), 0.0 * TIME)

    return experiment(names, measured, law)


def test_a_fit_finds_the_rate_of_a_decay() -> None:
    """Y = exp(-3 t) without noise: the rate is found to six digits, within its steps."""
    data = [np.exp(-3.0 * TIME)] * 2
    found = experiment(["rate"], data, lambda v, c: np.exp(-v[0] * TIME), start=1.0, nominal=0.0)
    task = FitTask(free=(0,), cases=(0, 1), values=np.array([1.0]))
    RunFitter(found, iterations=12).solve([task])
    assert task.values[0] == pytest.approx(3.0, rel=1e-4)
    assert task.done


def test_a_fit_ends_on_a_bound_and_the_others_take_over() -> None:
    """Y = 2 + 3 t with a slope of at most 1: the best constant is 2 + 2 mean(t)."""
    line = experiment(
        ["constant", "slope"],
        [2.0 + 3.0 * TIME],
        lambda v, c: v[0] + v[1] * TIME,
        bounds=(-1e3, 1e3),
        scale=100.0,
    )
    solver = RunFitter(line, iterations=12)
    solver.bounds[1] = (-1.0, 1.0)
    task = FitTask(free=(0, 1), cases=(0,), values=np.zeros(2))
    solver.solve([task])
    assert task.values[1] == 1.0
    assert task.values[0] == pytest.approx(2.0 + 2.0 * TIME.mean(), rel=1e-3)


def test_a_fit_walks_down_a_bent_valley() -> None:
    """Y = t / k has its least squares at 1 / 0.7, from ten times too large a start as well."""
    for start in (0.2, 7.0):
        bent = experiment(
            ["k"], [TIME / 0.7], lambda v, c: TIME / max(abs(v[0]), 1e-9), start=1.0, nominal=0.0
        )
        task = FitTask(free=(0,), cases=(0,), values=np.array([start]))
        RunFitter(bent, iterations=15).solve([task])
        assert task.values[0] == pytest.approx(0.7, rel=1e-3)


def test_a_limited_step_solves_the_rest_again() -> None:
    """With the first unknown stopped at 0.5 the second one is the minimum of what remains."""
    normal = np.array([[2.0, 1.0], [1.0, 3.0]])
    step = bounded_step(normal, np.array([5.0, 5.0]), -np.ones(2), np.array([0.5, 9.0]))
    assert step == pytest.approx([0.5, (5.0 - 0.5) / 3.0])


def test_the_spread_of_a_straight_line() -> None:
    """sigma^2 / sum t^2 is the variance of a slope through the origin."""
    noise = np.random.default_rng(3).standard_normal((2, 40))
    time = TIME[:40]
    cases = [time + SIGMA * n for n in noise]
    line = experiment(["slope"], [np.concatenate([y, np.zeros(20)]) for y in cases], _line)
    task = FitTask(free=(0,), cases=(0, 1), values=np.zeros(1))
    RunFitter(line, iterations=12).solve([task])
    # a run of 60 rows counts as 40 independent ones
    expected = SIGMA / np.sqrt(2 * float(time @ time) * 40 / 60)
    assert spread_of(task, line)[0] == pytest.approx(expected, rel=0.15)


def _line(values: np.ndarray, case: int) -> np.ndarray:
    return np.concatenate([values[0] * TIME[:40], np.zeros(20)])


def test_the_effect_that_acts_is_named() -> None:
    """Two curves to choose from, one of which is in the data."""
    found = search_runs(of_curves(["line", "wave"], {"line": 0.4}))
    answer = decide(found)
    assert answer.verdict.value == "named"
    assert [c.candidate.name for c in answer.claims] == ["line"]
    assert found.best.fit.values[0] == pytest.approx(0.4, abs=0.01)


def test_two_curves_that_are_alike_are_both_said() -> None:
    """No run tells a line from its twin; all runs go at one speed, which the words say."""
    answer = decide(search_runs(of_curves(["line", "wave", "line_twin"], {"line": 0.4})))
    assert answer.verdict.value == "ambiguous"
    said = {c.candidate.name for c in (*answer.claims, *answer.others)}
    assert said == {"line", "line_twin"}
    assert "drop at another speed" in " ".join(answer.reasons)
    assert 0.3 < answer.claims[0].confidence < 0.7


def test_noise_alone_lacks_nothing() -> None:
    """An effect that only follows noise does not pay for itself."""
    answer = decide(search_runs(of_curves(["line", "wave"], {})))
    assert answer.verdict.value == "nothing_missing"
    assert not answer.claims


def test_a_large_error_that_no_curve_has_is_none_of_these() -> None:
    """A jerk of three metres across, to which a wave does not belong."""

    def jerk(t: np.ndarray, c: int) -> np.ndarray:
        return 3.0 * np.sign(np.sin(31.0 * t + 2.0 * c))

    answer = decide(search_runs(of_curves(["wave"], {}, extra=jerk)))
    assert answer.verdict.value == "none_of_these"
    assert "times the floor" in answer.reasons[0]


def test_two_effects_that_help_only_together_are_both_named() -> None:
    """Each half alone brings in a large slope; their sum has none."""
    found = search_runs(
        of_curves(["half_up", "half_down", "wave"], {"half_up": 0.3, "half_down": 0.3})
    )
    answer = decide(found)
    assert {c.candidate.name for c in answer.claims} == {"half_up", "half_down"}
    alone = [h for h in found.tried if len(h.candidates) == 1]
    assert all(h.held_out_log_rms.mean() > 2.0 * found.best.held_out_log_rms.mean() for h in alone)


def test_without_candidates_one_cannot_tell() -> None:
    """What no channel sees is listed by name."""
    answer = decide(search_runs(of_curves([], {}, extra=lambda t, c: t)))
    assert answer.verdict.value == "cannot_tell"


def test_the_margin_over_runs() -> None:
    """An idle effect costs its price of 0.03; six runs of some 60 samples are as sure as that."""
    validator = CrossValidator(of_curves(["line", "wave"], {"line": 0.4}))
    line, both = (
        validator.experiment.candidate_set.candidates[:1],
        validator.experiment.candidate_set.candidates,
    )
    one, two = validator.fitted([(line, None), (both, None)])
    margin = validator.margin(one, two)
    assert margin.mean == pytest.approx(
        float(np.mean(two.held_out_log_rms - one.held_out_log_rms)) + 0.03
    )
    # one run alone scatters by sqrt(1 / 120) = 0.09; two runs' worth of that among 6 + 1 degrees
    # of freedom, and hardly any scatter of the difference of two models that are nearly the same
    assert 0.01 < margin.error < 0.05
    assert np.median([validator.independent(one, c) for c in range(RUNS)]) > 30.0


def test_drawn_out_errors_count_as_few_samples() -> None:
    """Sixty values that each follow the last one with 0.9 are worth 60 * 0.1 / 1.9, about 3."""
    noise = np.random.default_rng(11)
    rows = []
    for _ in range(RUNS):
        x = [0.0]
        for e in noise.standard_normal(TIME.size - 1):
            x.append(0.9 * x[-1] + e)
        rows.append(np.array(x))
    drawn = experiment(["line"], rows, lambda v, c: v[0] * np.zeros_like(TIME))
    validator = CrossValidator(drawn)
    counts = [validator.independent(validator.nominal, c) for c in range(RUNS)]
    assert 1.5 < float(np.mean(counts)) < 8.0


def test_progress_counts_hypotheses() -> None:
    """What is told never falls, and ends at all that were fitted."""
    told: list[float] = []
    search_runs(of_curves(["line", "wave"], {"line": 0.4}), tell=told.append)
    assert told == sorted(told)
    assert told[-1] > 2.0
    assert told[-1] <= 20.0
