"""Rotors that can be turned back push backwards; those that cannot are as before."""

from __future__ import annotations

import numpy as np
import pytest

from seals.effects.binding import bind_effects
from seals.errors import ConfigError
from seals.motion import Inputs
from seals.plugins.actuators.rotors import Rotors

POSITION = [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]]


def thrust(rotors: Rotors, *speeds: float) -> tuple[np.ndarray, np.ndarray]:
    """Thrusts and torques at some speeds."""
    (bound,) = bind_effects({"rotors": rotors}, ["body"]).actuators
    inputs = Inputs(0.0, np.zeros((1, 0)), np.array([speeds]))
    drives = bound.hooks.drives(inputs, bound.params)
    return drives.thrust[0], drives.torque[0]


def test_a_rotor_turned_back_pushes_backwards_with_its_share() -> None:
    """Thrust is -reverse k w^2 for a negative speed, and the reaction torque changes its sign."""
    rotors = Rotors(
        position=POSITION,
        direction=[1.0, -1.0],
        thrust_coefficient=[2e-5],
        torque_coefficient=[3e-7],
        reverse=[0.7],
    )
    ahead, ahead_torque = thrust(rotors, 100.0, 100.0)
    back, back_torque = thrust(rotors, -100.0, -100.0)
    np.testing.assert_allclose(ahead, 0.2)
    np.testing.assert_allclose(back, -0.14)
    np.testing.assert_allclose(back_torque, -ahead_torque)
    np.testing.assert_allclose(rotors.low, -rotors.limit)


def test_a_rotor_that_turns_one_way_is_as_before() -> None:
    """Without a reverse the sign of the speed means nothing, and the lowest speed is zero."""
    rotors = Rotors(position=POSITION, direction=[1.0, -1.0])
    np.testing.assert_allclose(thrust(rotors, -50.0, 50.0)[0], thrust(rotors, 50.0, 50.0)[0])
    np.testing.assert_allclose(rotors.low, 0.0)


def test_a_negative_share_is_refused() -> None:
    """A share below zero is named."""
    with pytest.raises(ConfigError, match="reverse"):
        Rotors(position=POSITION, direction=[1.0, -1.0], reverse=[-0.5])
