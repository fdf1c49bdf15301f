"""Fits and ladders on motion computed by closed forms that share no code with the simulator."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from seals.compare.application import compare_logs, settings_of
from seals.compare.result import Comparison
from seals.config.compose import compose
from seals.errors import ConfigError, LogError
from seals.logs import Log

MASS, GRAVITY = 0.3, 9.81
DRAG = 0.02
NOISE = 0.01
OVERRIDES = [
    "robot=ball",
    "+effect@effects.drag=quadratic_drag",
    "effects.drag.medium=air",
    "effects.drag.correction=true",
    "fit=[effects.drag.coefficient_x+coefficient_y+coefficient_z]",
    "+ladder.gravity=[gravity]",
    "+ladder.drag=[gravity,drag]",
    "held_out=['*/1']",
    "train=['*/0']",
    "compare.step=0.02",
]


def height(t: np.ndarray, drag: float, start: float) -> np.ndarray:
    """Fall from rest, quadratic drag: z = z0 - (m/c) ln cosh(g t / v_t), v_t = sqrt(m g / c)."""
    if drag == 0.0:
        return start - 0.5 * GRAVITY * t**2
    terminal = np.sqrt(MASS * GRAVITY / drag)
    return start - terminal**2 / GRAVITY * np.log(np.cosh(GRAVITY * t / terminal))


def falls(drag: float, *, seed: int = 0, noise: float = NOISE) -> Log:
    """Two drops from different heights, seen by a camera."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 2.0, 0.02)
    z = np.concatenate([height(t, drag, 40.0), height(t, drag, 30.0)])
    return Log(
        name="fall",
        columns={
            "t": np.concatenate([t, t]),
            "position_z": z + rng.normal(0.0, noise, z.size),
        },
        segment=np.repeat([0, 1], t.size),
    )


def compared(log: Log, *more: str) -> Comparison:
    """Compare the ball with a log."""
    settings = settings_of(compose([*OVERRIDES, *more], root="compare"))
    return compare_logs(settings, [log])


@functools.cache
def falls_compared() -> Comparison:
    """The comparison that two tests look at."""
    return compared(falls(DRAG))


def test_a_hidden_drag_is_found_and_the_held_out_error_falls_to_the_noise() -> None:
    """The coefficient is within three standard deviations, the unseen drop down to the noise."""
    group = falls_compared().groups[0]
    gravity, drag = group.variants
    fitted = drag.fitted[0]
    assert fitted.value == pytest.approx(DRAG, abs=3.0 * fitted.sigma)
    assert fitted.sigma < 0.02 * DRAG
    assert gravity.rms("position", held_out=True) > 10.0 * NOISE
    # 100 samples less two for the start: the rms scatters by 7 %
    assert drag.rms("position", held_out=True) == pytest.approx(NOISE, rel=0.25)
    assert drag.scores[1].total == pytest.approx(1.0, abs=0.3)


@pytest.mark.thorough
def test_an_absent_drag_is_not_found() -> None:
    """On a fall in vacuum the fitted drag is zero within its uncertainty and nothing improves."""
    group = compared(falls(0.0, seed=4)).groups[0]
    fitted = group.variants[1].fitted[0]
    assert fitted.value <= 3.0 * fitted.sigma
    before, after = (r.rms("position", held_out=True) for r in group.variants)
    assert after == pytest.approx(before, rel=0.05)


def test_the_result_is_plain_data() -> None:
    """The JSON form holds the ladder and no number that JSON lacks."""
    import json

    data = falls_compared().as_data()
    text = json.dumps(data, allow_nan=False)
    variants: list[dict[str, Any]] = json.loads(text)["groups"][0]["ladder"]
    assert [r["name"] for r in variants] == ["gravity", "drag"]
    assert variants[1]["held_out"]["position"]["samples"] == 100


@pytest.mark.thorough
def test_the_clock_offset_is_reported() -> None:
    """A measurement that lags the model by 60 ms is said to."""
    log = falls(DRAG, noise=0.002)
    late = log.with_columns({"t": log.time})
    group = compared(late, "compare.offset=0.1").groups[0]
    lag, match = group.offsets["fall/0"]["position"]
    assert abs(lag) < 0.02
    assert match > 0.999


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("fit=[effects.drga.coefficient_x]", "drag"),
        ("fit=[effects.drag.coeficient_x]", "coefficient_x"),
        ("fit=[robot.mass]", "seals calibrate"),
        ("train=['fal/0']", "fall/0"),
    ],
)
def test_wrong_names_are_answered_with_the_right_ones(override: str, words: str) -> None:
    """Each wrong name of a comparison is refused with the nearest right one."""
    with pytest.raises(ConfigError, match=words):
        compared(falls(DRAG), override)


def test_no_variant_is_fitted_before_all_are_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong name in the last variant costs no minute of fitting the others."""
    monkeypatch.setattr("seals.compare.variants.predictor_of", lambda _: pytest.fail("was fitted"))
    with pytest.raises(ConfigError, match="gravity"):
        compared(falls(DRAG), "+ladder.third=[gravty]")


def test_a_log_that_the_model_cannot_predict_is_refused() -> None:
    """A log of battery voltages alone is refused in words."""
    log = Log(
        name="volts", columns={"t": np.arange(50) * 0.1, "battery_voltage": np.linspace(16, 15, 50)}
    )
    with pytest.raises(LogError, match="no channel that the model predicts"):
        compared(log, "train=[]", "held_out=[]")
