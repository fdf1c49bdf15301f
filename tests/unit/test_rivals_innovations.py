"""Contests that slow faults hide: news in errors, on errors that are known in closed form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.signal import lfilter

from seals.compare.predict import Job
from seals.compare.sampled import bare_case
from seals.compare.settings import CompareSettings
from seals.sysid.candidates.parameters import Candidate, CandidateSet, Parameter
from seals.sysid.decision.cross_validation import decide
from seals.sysid.predictors.batch import Experiment
from seals.sysid.scores.cross_validation import CrossValidator
from seals.sysid.scores.innovations import autocorrelation, gain, innovations
from seals.sysid.selection.run_models import search_runs

TIME = np.linspace(0.0, 6.0, 300)
SIGMA = 0.05
RUNS = 6


def response(name: str, case: int) -> np.ndarray:
    """A square wave through a lag of 0.1 s, by its solution between edges, or shifted by 0.1 s."""
    phase = 0.05 * case
    state, out = -1.0, []
    step = TIME[1] - TIME[0]
    for t in TIME:
        command = 1.0 if np.sin(4.0 * t + phase) > 0.0 else -1.0
        state = command + (state - command) * np.exp(-step / 0.1)
        out.append(state)
    if name == "lag":
        return np.array(out)
    return np.where(np.sin(4.0 * (TIME - 0.1) + phase) > 0.0, 1.0, -1.0)


class Sums:
    """A predictor that adds multiples of the two responses."""

    def run(self, jobs: Sequence[Job]) -> list[dict[str, np.ndarray]]:
        """Return the depth of every job."""
        return [
            {
                "depth": sum(
                    v * response(n, j.case) for v, n in zip(j.values, ("lag", "delay"), strict=True)
                )[:, None]
            }
            for j in jobs
        ]


def judge_of(drift: float, *, floor: float = 0.0) -> CrossValidator:
    """Runs that answer with a lag, under errors that wander by so much a row."""
    noise = np.random.default_rng(5)
    cases = []
    for k in range(RUNS):
        wander = lfilter([drift], [1.0, -0.99], noise.standard_normal(TIME.size))
        y = response("lag", k) + wander + SIGMA * noise.standard_normal(TIME.size)
        cases.append(
            bare_case(f"run_{k}", TIME, {"depth": y[:, None]}, {"depth": np.array([SIGMA])})
        )
    names = ("lag", "delay")
    settings = CompareSettings()
    settings.naming.floor = {"depth": floor}
    experiment = Experiment(
        settings=settings,
        candidate_set=CandidateSet(
            effects={},
            parameters={f"{n}.size": Parameter(key=f"{n}.size", bounds=(-9.0, 9.0)) for n in names},
            candidates=tuple(Candidate(name=n, keys=(f"{n}.size",)) for n in names),
        ),
        cases=tuple(cases),
        predictor=Sums(),  # type: ignore[arg-type]
        names=tuple(f"{n}.size" for n in names),
        fold={k: k for k in range(RUNS)},
    )
    return CrossValidator(experiment)


def test_news_of_a_known_error() -> None:
    """An error that halves from row to row has none; one that jumps by one has a one."""
    halves = {"depth": 2.0 ** -np.arange(9.0)[:, None]}
    rho = autocorrelation([halves])
    assert rho["depth"] == pytest.approx(0.5)
    assert innovations(halves, rho)["depth"] == pytest.approx(0.0)
    jump = {"depth": np.array([0.0, 0.0, 1.0, 0.5, 0.25])[:, None]}
    assert innovations(jump, rho)["depth"][:, 0] == pytest.approx([0.0, 1.0, 0.0, 0.0])


def test_gaps_are_left_out() -> None:
    """Correlation over a gap is none: the pair on each side is not counted."""
    gap = {"depth": np.array([4.0, 2.0, np.nan, 8.0, 4.0])[:, None]}
    assert autocorrelation([gap])["depth"] == pytest.approx(0.5)


def test_the_gain_is_the_log_of_the_ratio() -> None:
    """Errors of three times the size have log 3 of gain; a run of five rows says nothing."""
    x = np.random.default_rng(2).standard_normal((50, 1))
    assert gain({"depth": x}, {"depth": 3.0 * x}, {"depth": 0.7}) == pytest.approx(np.log(3.0))
    assert np.isnan(gain({"depth": x[:5]}, {"depth": x[:5]}, {"depth": 0.7}))


def test_news_settle_what_a_wandering_error_hides() -> None:
    """Under a drift three times the size of what differs, lag beats delay by its news alone."""
    validator = judge_of(0.25)
    first, second = ((c,) for c in validator.experiment.candidate_set.candidates)
    lag, delay = validator.fitted([(first, None), (second, None)])
    assert not validator.margin(lag, delay).significant
    assert validator.compare_innovations(lag, delay).significant
    assert not validator.compare_innovations(delay, lag).significant


def test_a_systematic_floor_lets_the_margin_stand() -> None:
    """Where a fault of the measurement sets the floor, its news are no evidence."""
    validator = judge_of(0.25, floor=1.0)
    first, second = ((c,) for c in validator.experiment.candidate_set.candidates)
    lag, delay = validator.fitted([(first, None), (second, None)])
    assert validator.compare_innovations(lag, delay) == validator.margin(lag, delay)


def test_words_say_what_only_fast_changes_rule_out() -> None:
    """The lag is named alone; the delay that follows slow changes as well is said."""
    answer = decide(search_runs(judge_of(0.14).experiment))
    assert answer.verdict.value == "named"
    assert [c.candidate.name for c in answer.claims] == ["lag"]
    assert answer.reasons == ("delay follows slow changes as well, fast ones speak for lag",)
