"""What commands become on their way to the actuators."""

from __future__ import annotations

import numpy as np
import pytest

from seals.control.actuator_response import respond


def stepped(rows: int, at: int) -> np.ndarray:
    """A command that jumps from 0 to 1 at one row."""
    return (np.arange(rows) >= at).astype(float)[:, None]


def test_a_step_is_answered_exponentially() -> None:
    """The response to a step is 1 - exp(-t/tau), at every part of a row."""
    found = respond(stepped(60, 10), 0.01, lag=np.array([0.05]), delay=0.0, parts=2)
    time = np.arange(120) * 0.005 - 0.1
    expected = np.where(time > 0.0, 1.0 - np.exp(-np.maximum(time, 0.0) / 0.05), 0.0)
    assert np.allclose(found.reshape(-1), expected, atol=1e-12)


@pytest.mark.parametrize("delay", [0.0005, 0.0042, 0.0137, 0.031])
def test_a_delay_shifts_the_answer_exactly(delay: float) -> None:
    """A delay of any length, across parts and rows, only moves the exponential in time."""
    found = respond(stepped(80, 10), 0.01, lag=np.array([0.04]), delay=delay, parts=4)
    time = np.arange(320) * 0.0025 - 0.1 - delay
    expected = np.where(time > 0.0, 1.0 - np.exp(-np.maximum(time, 0.0) / 0.04), 0.0)
    assert np.allclose(found.reshape(-1), expected, atol=1e-12)


def test_every_actuator_has_its_own_lag() -> None:
    """Two actuators under one command reach different states."""
    command = np.repeat(stepped(20, 5), 2, axis=1)
    found = respond(command, 0.01, lag=np.array([0.02, 0.2]), delay=0.0, parts=1)
    assert found[10, 0, 0] == pytest.approx(1.0 - np.exp(-0.05 / 0.02))
    assert found[10, 0, 1] == pytest.approx(1.0 - np.exp(-0.05 / 0.2))


def test_an_actuator_slows_down_with_a_time_constant_of_its_own() -> None:
    """Up, down and through zero: exact exponentials, each with the constant of its direction."""
    command = np.concatenate([np.full(20, 1.0), np.full(20, 3.0), np.full(60, 1.0)])[:, None]
    rise, fall, step = 0.05, 0.2, 0.01
    found = respond(command, step, lag=np.array([rise]), fall=np.array([fall]), delay=0.0, parts=3)
    top = 3.0 - 2.0 * np.exp(-20 * step / rise)
    assert found[40, 0, 0] == pytest.approx(top, rel=1e-9)
    time = np.arange(180) * step / 3
    expected = 1.0 + (top - 1.0) * np.exp(-time / fall)
    assert found[40:].reshape(-1) == pytest.approx(expected, rel=1e-9)
    # turned round: falling until the speed is that of the command, rising beyond
    turned = np.concatenate([np.full(2, 1.0), np.full(300, -0.5)])[:, None]
    found = respond(turned, step, lag=np.array([rise]), fall=np.array([fall]), delay=0.0, parts=1)
    x = 1.0
    for row in found[2:60, 0, 0]:
        assert row == pytest.approx(x, rel=1e-9)
        x = -0.5 + (x + 0.5) * np.exp(-step / (fall if abs(x) > 0.5 else rise))
    assert found[-1, 0, 0] == pytest.approx(-0.5, abs=1e-9)
