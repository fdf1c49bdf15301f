"""A delay that windows follow: value and spread by the parabola of the score."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seals.sysid.predictors.normal_equations import Fit
from seals.sysid.scores.laplace_evidence import EvidenceHypothesis
from seals.sysid.selection import sensor_delay

TOP, SIGMA = 0.0214, 4e-4
DELAY = "sensor_delay.delay"


def at(delay: float) -> EvidenceHypothesis:
    """A hypothesis whose score falls by one at one standard deviation from the true delay."""
    fit = Fit(
        free=(DELAY,),
        keys=(DELAY,),
        values={DELAY: delay},
        cost=0.0,
        misfit=np.zeros(1),
        normal=np.zeros((1, 1, 1)),
        right=np.zeros((1, 1)),
        precision=np.array([1.0 / 0.03**2]),
        centre=np.array([delay]),
        penalty=0.0,
    )
    fitter: Any = SimpleNamespace(
        windows=SimpleNamespace(delay=delay), candidate_set=SimpleNamespace(sensor_delay=DELAY)
    )
    score = 80.0 - ((delay - TOP) / SIGMA) ** 2
    return EvidenceHypothesis(candidates=(), fit=fit, fitter=fitter, score=score)


@pytest.fixture
def parabola(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits at a delay are looked up on the parabola."""
    monkeypatch.setattr(sensor_delay, "_at_delay", lambda nominal, hypothesis, delay: at(delay))


@pytest.mark.usefixtures("parabola")
@pytest.mark.parametrize("start", [0.02, 0.0175, 0.0262])
def test_the_top_of_the_parabola_is_found_with_its_spread(start: float) -> None:
    """The delay is exact between the steps, and its spread that of the score."""
    found = sensor_delay.estimate_sensor_delay(at(0.0), at(start))
    assert found.fitter.windows.delay == pytest.approx(TOP, abs=1e-9)
    assert found.fit.spread(DELAY) == pytest.approx(SIGMA, rel=1e-6)


@pytest.mark.usefixtures("parabola")
def test_no_top_no_spread() -> None:
    """On a slope the middle stays, and the spread is the prior's."""
    near = [at(0.030), at(0.032)]
    found = sensor_delay.parabola_peak(at(0.0), at(0.031), near)
    assert found.fitter.windows.delay == 0.031
    assert found.fit.spread(DELAY) == pytest.approx(0.03)
