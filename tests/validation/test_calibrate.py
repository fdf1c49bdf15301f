"""Calibrations on logs of the independent simulator whose data sheets are wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.sysid.calibration.calibration import calibrated
from tests.validation.misstated import drawn, made, misstated

DRAG = "effects.linear_drag_air.coefficient_x"


@pytest.mark.thorough
def test_numbers_wrong_by_a_third_are_found(tmp_path: Path) -> None:
    """Mass and drag of a quadrotor: within their intervals, the error down to the noise."""
    ((log, truth),) = made(tmp_path, "quad", 1, 41)
    found = calibrated(misstated(log, {"mass": 0.7, DRAG: 1.5}), ["mass", DRAG])
    mass, drag = found.numbers
    assert found.value(mass) == pytest.approx(truth["mass"], rel=0.02)
    assert found.value(drag) == pytest.approx(truth[DRAG], rel=0.1)
    for number in found.numbers:
        low, high = found.interval(number)
        assert low < truth[number.name] < high
        assert found.determined(number)
    assert found.held_out["before"] > 5.0
    assert found.held_out["after"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("vehicle", "seed"), [("quad", 71), ("auv", 72)])
def test_the_intervals_hold_as_often_as_they_say(vehicle: str, seed: int, tmp_path: Path) -> None:
    """Three numbers of ten vehicles, wrong by 15 to 50 %: median error, and cover of intervals."""
    errors, held = [], []
    for k, (log, truth) in enumerate(made(tmp_path, vehicle, 10, seed)):
        factors = drawn(truth, np.random.default_rng([seed, k]), 3)
        found = calibrated(misstated(log, factors), list(factors))
        for number in found.numbers:
            true, (low, high) = truth[number.name], found.interval(number)
            errors.append(abs(found.value(number) / true - 1.0))
            held.append(low <= true <= high)
    assert np.median(errors) < 0.03
    # 30 intervals that hold nine times of ten: fewer than 22 have odds of 1 in 200
    assert sum(held) >= 22
