"""Starting values of effects that are not linear about zero, from the residual force."""

from __future__ import annotations

import numpy as np
import pytest

from seals.sysid.candidates.activity import ACTIVE, Activity, Moment, Span
from seals.sysid.data.vehicle import read_vehicle
from seals.sysid.predictors.problem import Problem, linearise_model
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection import initial_guesses as guessing
from seals.sysid.selection.initial_guesses import free_force, initial_guesses
from tests.unit.test_diagnose_along import described, waving

BEGIN, END = 0.5, 1.0
ANCHOR = np.array([0.4, -0.3, -1.0])


def activity() -> Activity:
    """A time span in the middle of the log."""
    first, last = (Moment(value=v, low90=v, high90=v) for v in (BEGIN, END))
    return Activity(spans=(Span(log=0, start=first, end=last),), occam_factor=7.0)


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A log of a vehicle in the air."""
    vehicle = read_vehicle(described(None))
    plant, trajectory = waving(vehicle)
    fitter = linearise_model(plant, trajectory, {}, window=0.5)
    return Problem(vehicle=vehicle, samples=plant.samples, plant=plant, fitter=fitter)


@pytest.fixture(scope="module")
def nominal(problem: Problem) -> EvidenceHypothesis:
    """Its stated model."""
    fitter = problem.fitter
    return EvidenceHypothesis(candidates=(), fit=fitter.fit(()), fitter=fitter, score=0.0)


def test_the_force_of_some_times_is_that_of_all_at_these_times(
    problem: Problem, nominal: EvidenceHypothesis
) -> None:
    """Only rows in which the effect acts are kept, unchanged and in order."""
    whole, part = (free_force(problem, nominal, a) for a in (None, activity()))
    here = (whole.time >= BEGIN) & (whole.time < END)
    assert 0 < here.sum() < len(here)
    for name in ("time", "position", "force", "log"):
        assert np.array_equal(getattr(part, name), getattr(whole, name)[here])


def test_a_cable_for_a_time_is_guessed_from_the_force_of_that_time(
    problem: Problem, nominal: EvidenceHypothesis, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The force at other times, where it is slack or cut, would contradict it."""
    found = free_force

    def pulled(*given: object) -> object:
        """The residual force of a cable that is taut between two moments only."""
        residual = found(*given)  # type: ignore[arg-type]  # passed on as given
        acts = (residual.time >= BEGIN) & (residual.time < END)
        gap = residual.position - ANCHOR
        length = np.linalg.norm(gap, axis=1, keepdims=True)
        force = -9.0 * np.maximum(length - 0.4, 0.0) * gap / length * acts[:, None]
        object.__setattr__(residual, "force", force)
        return residual

    monkeypatch.setattr(guessing, "free_force", pulled)
    cables = [c for c in problem.plant.candidate_set.candidates if c.name == "tether"]
    for own, right in ((None, False), (activity(), True)):
        (candidate, start), *_ = initial_guesses(problem, nominal, cables, own)
        assert candidate.activity == own
        ending = ACTIVE if own else ""
        keys = [f"{candidate.instance}.anchor_{a}{ending}" for a in "xyz"]
        assert set(keys) < set(candidate.all_keys)
        off = np.linalg.norm(np.array([start[k] for k in keys]) - ANCHOR)
        assert (off < 0.05) == right


def test_what_is_linear_about_zero_needs_no_guess(
    problem: Problem, nominal: EvidenceHypothesis
) -> None:
    """Nor does anything from a time span that holds no row."""
    every = problem.plant.candidate_set.candidates
    assert not initial_guesses(problem, nominal, [c for c in every if c.name == "wind"])
    assert not initial_guesses(problem, nominal, every, Activity(spans=()))
