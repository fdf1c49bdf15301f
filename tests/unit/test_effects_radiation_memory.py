"""Radiation memory of one resonator against its convolution in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from seals.effects import bind_effects
from seals.motion import Body, Inputs, Medium, Motion
from seals.plugins.effects.radiation_memory import RadiationMemory

ONE = np.ones((1, 1))
UP = np.array([[0.0, 0.0, 1.0]])


@pytest.mark.parametrize(("axis", "gain"), [(0, 2.0), (2, 5.0)])
def test_a_hull_in_steady_motion_feels_the_integral_of_its_retardation(
    axis: int, gain: float
) -> None:
    """K has the transform s G^2 / (s^2 + s D + W^2): moved with v, -v G^2 e^(-2 t) sin(b t) / b."""
    coupling = [0.0] * 6
    coupling[axis] = gain
    effect = RadiationMemory(frequency=[3.0], damping=[[4.0]], coupling=[coupling])
    params = bind_effects({"it": effect}, ["base"]).bound[0].params
    moving = np.zeros((1, 3))
    moving[0, axis] = 0.5
    turn = np.eye(3)[None]
    body = Body(ONE, np.zeros((1, 3)), 2e-3 * ONE, ONE)
    motion = Motion(0.0 * ONE, 0.0 * UP, turn, turn[:, 2, :], moving, 0.0 * UP, body)
    wet, still = 0.5 * ONE, 0.0 * UP
    medium = Medium(wet, still, still, 1e3 * ONE, ONE, wet, ONE, still, UP, ONE, 9.81 * ONE)
    step, memory, found = 0.01, np.zeros((1, effect.memory_size)), []
    for _ in range(150):
        wrench, memory = RadiationMemory.loads(
            motion, medium, Inputs(step, np.zeros((1, 0))), memory, params
        )
        found.append(wrench.force[0])
    middle, b = step * (np.arange(150) + 0.5), np.sqrt(5.0)
    wanted = np.zeros((150, 3))
    wanted[:, axis] = -0.5 * gain**2 * np.exp(-2.0 * middle) * np.sin(b * middle) / b
    # the trapezoidal rule is of second order: (W step)^2 / 12 of the peak, and the mean of a step
    assert np.abs(np.array(found) - wanted).max() < (3.0 * step) ** 2 * np.abs(wanted).max()
