"""What thrusters lose about zero and at speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.effects import Effect, bind_effects
from seals.motion import Drives, Inputs
from seals.plugins.effects.thruster_dead_zone import DeadZoneForm, ThrusterDeadZone
from seals.plugins.effects.thruster_inflow import ThrusterInflow
from seals.testing.instants import random_instant

THRUST = np.array([[-8.0, -2.0, -0.5, 0.0, 1.0, 2.5, 8.0]])


def pushed(effect: Effect, thrust: Any = THRUST, **motion: Any) -> Any:
    """Return the thrust that is left of one along x, all hubs at the origin."""
    count = thrust.shape[1]
    now = random_instant(np.random.default_rng(0), 1)
    still = {name: np.zeros((1, 3)) for name in ("velocity", "angular_velocity")}
    moving = now.motion._replace(**still | motion)
    medium = now.medium._replace(velocity=np.zeros((1, 3)))
    axis = np.tile([1.0, 0.0, 0.0], (count, 1))
    drives = Drives(np.zeros((count, 3)), axis, np.zeros(count), thrust, 0.0 * thrust)
    bound = bind_effects({"it": effect}, ["base"]).with_values({}, np.zeros(1), 1).bound[0]
    given = (drives, moving, medium, Inputs(0.0, np.zeros((1, 0))))
    return bound.hooks.actuation(*given, bound.params).thrust


def test_a_shifted_thruster_is_weaker_by_its_dead_zone() -> None:
    """Below 2 N nothing, beyond it 2 N less, in both directions."""
    found = pushed(ThrusterDeadZone(force=2.0))
    assert_allclose(found, [[-6.0, 0.0, 0.0, 0.0, 0.0, 0.5, 6.0]], atol=1e-12)


def test_a_thruster_that_jumps_is_as_commanded_beyond_its_dead_zone() -> None:
    """Half at the dead zone itself, all a tenth beyond it, nothing a tenth before."""
    found = pushed(ThrusterDeadZone(force=2.0, form=DeadZoneForm.jump))
    assert_allclose(found, [[-8.0, -1.0, 0.0, 0.0, 0.0, 2.5, 8.0]], atol=1e-9)


@pytest.mark.parametrize("form", list(DeadZoneForm))
def test_no_dead_zone_changes_nothing(form: DeadZoneForm) -> None:
    """The nominal value is neutral."""
    assert_allclose(pushed(ThrusterDeadZone(force=0.0, form=form)), THRUST, atol=1e-12)


def test_water_that_flows_in_takes_thrust_away() -> None:
    """T_0 - k sqrt(|T_0|) u: ahead it is less, astern more, and none at rest."""
    ahead = np.array([[0.5, 3.0, -2.0]])
    found = pushed(ThrusterInflow(coefficient=1.2), velocity=ahead)
    assert_allclose(found, THRUST - 1.2 * np.sqrt(abs(THRUST)) * 0.5, atol=1e-3)
    assert_allclose(pushed(ThrusterInflow(coefficient=1.2)), THRUST, atol=1e-12)


def test_a_turn_moves_the_hubs() -> None:
    """A hub 0.4 m to the left of a vehicle that turns left at 2 rad/s moves astern at 0.8 m/s."""
    effect = ThrusterInflow(coefficient=1.0)
    bound = bind_effects({"it": effect}, ["base"]).with_values({}, np.zeros(1), 1).bound[0]
    now = random_instant(np.random.default_rng(0), 1)
    turning = now.motion._replace(
        velocity=np.zeros((1, 3)), angular_velocity=np.array([[0.0, 0.0, 2.0]])
    )
    place, axis = np.array([[0.0, 0.4, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    drives = Drives(place, axis, np.zeros(1), np.array([[9.0]]), np.zeros((1, 1)))
    medium = now.medium._replace(velocity=np.zeros((1, 3)))
    given = (drives, turning, medium, Inputs(0.0, np.zeros((1, 0))))
    found = bound.hooks.actuation(*given, bound.params).thrust
    assert_allclose(found, [[9.0 + 1.0 * 3.0 * 0.8]], atol=1e-5)
