"""Answers about a healthy flight, from its checks and from a diagnosis."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.nanobench import Flight, engine_answers, span_of
from seals.logs.log import Log


def _parameters(**values: float) -> dict[str, Any]:
    return {name: {"value": value} for name, value in values.items()}


def test_a_diagnosis_becomes_rates_and_effects() -> None:
    """Drag over mass, sensitivity to the voltage, lag; what else is named stands by itself."""
    fitted = [
        {
            "name": "linear_drag",
            "parameters": _parameters(
                coefficient_x=0.0108, coefficient_y=0.0108, coefficient_z=9.0
            ),
        },
        {"name": "battery_sag", "parameters": _parameters(sensitivity=1.9)},
        {"name": "rotor_lag", "parameters": _parameters(time_constant_change=0.04)},
        {"name": "weak_rotor", "parameters": {}},
    ]
    # a delay that is fitted within its tolerance adds to a lag
    nominal = {"command_delay.delay": {"value": 0.003}, "mass.mass": {"value": 1.0}}
    found = {"verdict": "named", "fitted": fitted, "effects": fitted[1:], "nominal": nominal}
    told = {quantity: value for _, quantity, value in engine_answers("a", found)}
    assert float(told["drag_rate_1_s"]) == pytest.approx(0.4)
    assert told["sag_k"] == "1.90"
    assert told["lag_s"] == "0.0430"
    assert told["other_effects"] == "weak_rotor"
    alone = {"verdict": "named", "effects": [], "nominal": nominal, "fitted": [
        {"name": "rotor_drag", "parameters": _parameters(coefficient=0.04)}
    ]}  # fmt: skip
    told = {quantity: value for _, quantity, value in engine_answers("a", alone)}
    assert float(told["drag_rate_1_s"]) == pytest.approx(0.04 * 9.81, abs=1e-3)
    assert told["other_effects"] == "none"


def test_the_stretch_that_is_diagnosed_is_flight() -> None:
    """Climb, landing and more than a dozen seconds stay out; a late gyroscope is told."""
    time = np.arange(0.0, 40.0, 0.01)
    height = np.where((time > 5.0) & (time < 35.0), 1.0, 0.1)
    roll = 0.2 * np.sin(2.0 * time)
    rate = 0.4 * np.cos(2.0 * (time - 0.03))
    rng = np.random.default_rng(1)
    columns = {"t": time, "position_x": 0.0 * time, "position_y": 0.0 * time, "position_z": height}
    columns |= {"orientation_x": np.sin(roll / 2), "orientation_w": np.cos(roll / 2)}
    columns |= {"orientation_y": 0.0 * time, "orientation_z": 0.0 * time}
    for axis, values in (("x", rate), ("y", 0.0 * rate), ("z", 0.0 * rate)):
        columns[f"angular_velocity_{axis}"] = values + 1e-3 * rng.standard_normal(time.size)
    log = Log(name="a", columns=columns)
    first, last = span_of(log)
    assert (first, last) == pytest.approx((7.01, 19.01), abs=0.02)
    told = {quantity: value for _, quantity, value in Flight.of(log).answers()}
    assert float(told["time_offset_s"]) == pytest.approx(0.03, abs=0.004)
