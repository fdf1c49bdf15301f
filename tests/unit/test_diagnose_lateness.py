"""A delay that windows follow: value and spread by the parabola of the score."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.plugins.effects.payload import Payload
from seals.sysid.candidates.parameters import Candidate
from seals.sysid.decision.exact_numbers import numbers_to_hold, still_wrong
from seals.sysid.decision.moved_numbers import MovedNumber
from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.predictors.windows import delaying
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection import relinearised

TOP, SIGMA = 0.0214, 4e-4
DELAY = "sensor_delay.delay"


ROWS, ROW = 9000, 0.01
"""Readings of all windows, and a row [s]: each row of the delay leaves out 100 readings."""


def at(delay: float) -> EvidenceHypothesis:
    """A hypothesis whose misfit rises by one at one standard deviation from the true delay.

    A reading costs 0.9: the score steps by ten where a whole row more is left out.
    """
    seen = ROWS - 100 * math.ceil(delay / ROW)
    off = ((delay - TOP) / SIGMA) ** 2
    fit = Fit(
        free=(DELAY,),
        keys=(DELAY,),
        values={DELAY: delay},
        cost=(0.9 * ROWS + off) * seen / ROWS,
        misfit=np.zeros(1),
        normal=np.zeros((1, 1, 1)),
        right=np.zeros((1, 1)),
        precision=np.array([1.0 / 0.03**2]),
        centre=np.array([delay]),
        penalty=0.0,
    )
    fitter: Any = SimpleNamespace(
        windows=SimpleNamespace(delay=delay, observed=seen),
        candidate_set=SimpleNamespace(sensor_delay=DELAY),
    )
    score = 80.0 - off - 0.1 * (ROWS - seen)
    return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=score)


@pytest.fixture
def parabola(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits at a delay are looked up on the parabola."""
    monkeypatch.setattr(relinearised, "_at_delay", lambda nominal, hypothesis, delay: at(delay))


@pytest.mark.usefixtures("parabola")
@pytest.mark.parametrize("start", [0.02, 0.0175, 0.0262, 0.0302])
def test_the_top_of_the_parabola_is_found_with_its_spread(start: float) -> None:
    """The delay is exact between the steps, and its spread that of the score."""
    found = relinearised.estimate_sensor_delay(at(0.0), at(start))
    assert found.fitter.windows.delay == pytest.approx(TOP, abs=1e-9)
    # readings left out are worth what the others are, and a little of the spread goes with them
    assert found.fit.spread(DELAY) == pytest.approx(SIGMA, rel=0.02)


@pytest.mark.usefixtures("parabola")
def test_no_top_no_spread() -> None:
    """On a slope the middle stays, and the spread is the prior's."""
    near = [at(0.030), at(0.032)]
    found = relinearised.parabola_peak(at(0.0), at(0.031), near)
    assert found.fitter.windows.delay == 0.031
    assert found.fit.spread(DELAY) == pytest.approx(0.03)


@pytest.mark.parametrize("late", [0.4, 1.5, 3.2, -1.5])
def test_a_shift_follows_an_oscillation_between_the_rows(late: float) -> None:
    """Half way between rows a cubic misses it by 3/128 (w T)^4, a straight line by (w T)^2 / 8."""
    rows, turn = np.arange(60), 2.0 * np.pi * 5.0 * 0.01
    error = delaying(60, late) @ np.sin(turn * rows) - np.sin(turn * (rows - late))
    assert np.abs(error[6:-6]).max() < 1.01 * 3.0 / 128.0 * turn**4
    assert np.abs(delaying(60, late) @ (2.0 * rows - 1.0) - 2.0 * (rows - late) + 1.0).max() < 1e-12


def test_a_number_that_late_sensors_had_moved_is_right() -> None:
    """Held, and nothing named changes or adds to it: right. Else, or not held: still wrong.

    So is one that only the second answer finds far off.
    """
    keys = ("lag.t", "mass.mass", "drag.c", "table.a")
    moved = [MovedNumber(key=key, change=0.01, sigmas=5.0, unknown=0.1) for key in keys]
    first: Any = SimpleNamespace(stated_wrong=tuple(moved))
    named = [
        SimpleNamespace(instance="drag", all_keys=("drag.c",)),
        SimpleNamespace(instance="payload_base", all_keys=("payload_base.mass",)),
    ]
    effects = {"lag": 0, "mass": "", "drag": 0.0, "payload_base": "", "table": None}
    problem: Any = SimpleNamespace(
        plant=SimpleNamespace(candidate_set=SimpleNamespace(effects=effects))
    )
    hidden = MovedNumber(key="thrust.k", change=-0.1, sigmas=-6.0, unknown=0.1)
    claims = [SimpleNamespace(candidate=c) for c in named]
    second: Any = SimpleNamespace(claims=claims, stated_wrong=(hidden, moved[3]))
    left = still_wrong(problem, first, second, ["lag.t", "mass.mass", "drag.c"])
    assert [m.key for m in left] == ["thrust.k", "table.a", "mass.mass", "drag.c"]


def test_a_moved_number_is_held_beside_waves_that_are_no_effect() -> None:
    """A payload adds to the stated mass, waves among the candidates to nothing."""
    stated, payload = Payload(mass=0.0), Payload(mass=0.0)
    known = SimpleNamespace(
        effects={"own": stated, "payload": payload},
        candidates=(
            Candidate(name="waves", keys=("waves.height",)),
            Candidate(name="payload", keys=("payload.mass",)),
        ),
        parameters={"own.mass": SimpleNamespace(tolerance=0.01)},
    )
    problem: Any = SimpleNamespace(plant=SimpleNamespace(candidate_set=known))
    moved = SimpleNamespace(key="own.mass")
    answer: Any = SimpleNamespace(stated_wrong=(moved, SimpleNamespace(key="gravity.strength")))
    assert numbers_to_hold(problem, answer) == ("own.mass",)
