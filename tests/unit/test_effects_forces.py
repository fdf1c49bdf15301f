"""Forces on links and joints: shifted buoyancy, tether, lift, radiation damping, backlash."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from seals.arrays import Floats
from seals.effects import bind_effects
from seals.motion import Body, Inputs, Joints, Medium, Motion, Wrench
from seals.plugins.effects.centre_of_buoyancy import CentreOfBuoyancy
from seals.plugins.effects.joint_backlash import JointBacklash
from seals.plugins.effects.lift import Lift
from seals.plugins.effects.radiation_damping import DampingRadiation
from seals.plugins.effects.tether import Tether

LEFT = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
"""Yaw of a quarter turn to the left."""


def motion(
    position: Any = (0.0, 0.0, 0.0),
    velocity: Any = (0.0, 0.0, 0.0),
    spin: Any = (0.0, 0.0, 0.0),
    rotation: Floats | None = None,
) -> Motion:
    """Return one body of two litres."""
    turn = np.eye(3)[None] if rotation is None else rotation
    body = Body(np.ones((1, 1)), np.zeros((1, 3)), np.full((1, 1), 2e-3), np.ones((1, 1)))
    place, speed, rate = (np.array([x], dtype=float) for x in (position, velocity, spin))
    return Motion(np.zeros((1, 1)), place, turn, turn[:, 2, :], speed, rate, body)


def medium(
    share: float = 1.0, flow: Any = (0.0, 0.0, 0.0), acceleration: Any = (0, 0, 0)
) -> Medium:
    """Return water of 1000 kg/m^3 that covers a share of the body."""
    one, up = np.ones((1, 1)), np.array([[0.0, 0.0, 1.0]])
    moving, pushing = (np.array([x], dtype=float) for x in (flow, acceleration))
    s = share * one
    return Medium(s, moving, pushing, 1e3 * one, one, s, one, 0.0 * up, up, one, 9.81 * one)


def loads(effect: Any, moved: Motion, around: Medium) -> Wrench:
    """Return the wrench of one effect."""
    params = bind_effects({"it": effect}, ["base"]).bound[0].params
    wrench, memory = effect.loads(moved, around, Inputs(0.004, np.zeros((1, 0))), None, params)
    assert memory is None
    return wrench


def test_a_shifted_centre_of_buoyancy_turns_the_hull() -> None:
    """1 kg of displaced water lifts 10.81 N in water that rises with 1 m/s^2; no force is added."""
    effect = CentreOfBuoyancy(offset_x=0.01, offset_y=0.02, offset_z=0.5)
    force, torque = loads(effect, motion(), medium(0.5, acceleration=(0.0, 0.0, 1.0)))
    assert force is None
    assert torque is not None
    assert_allclose(torque, [[0.2162, -0.1081, 0.0]], atol=1e-14)


def test_a_taut_tether_pulls_toward_its_anchor() -> None:
    """5 m from the anchor with 2 m of cable: 1.5 N/m times 3 m, turned into link axes."""
    effect = Tether(anchor_x=1.0, anchor_y=-2.0, anchor_z=0.5, length=2.0, stiffness=1.5)
    force, torque = loads(effect, motion((4.0, 2.0, 0.5)), medium())
    assert force is not None
    assert torque is None
    assert_allclose(force, [[-2.7, -3.6, 0.0]], atol=1e-12)
    turned, _ = loads(effect, motion((4.0, 2.0, 0.5), rotation=LEFT), medium())
    assert turned is not None
    assert_allclose(turned, [[-3.6, 2.7, 0.0]], atol=1e-12)


@pytest.mark.parametrize("place", [(1.0, -2.0, 0.5), (1.5, -2.0, 0.5), (1.0, -2.0, 2.49)])
def test_a_slack_tether_does_nothing(place: tuple[float, float, float]) -> None:
    """Nearer than its length, and at the anchor itself, there is no pull."""
    effect = Tether(anchor_x=1.0, anchor_y=-2.0, anchor_z=0.5, length=2.0, stiffness=1.5)
    assert_array_equal(loads(effect, motion(place), medium())[0], 0.0)


def test_a_tether_without_length_is_a_spring_through_its_anchor() -> None:
    """F = -K d for any d, zero at the anchor."""
    effect = Tether(length=0.0, stiffness=4.0)
    for distance in (0.0, 1e-3, 1.0):
        force, _ = loads(effect, motion((0.0, 0.0, distance)), medium())
        assert force is not None
        assert_allclose(force, [[0.0, 0.0, -4.0 * distance]], atol=1e-14)


def test_lift_acts_across_the_flow() -> None:
    """Sinking 0.1 m/s at 1 m/s ahead, A_L 0.7 m^2: 34.826 N up and 3.4826 N ahead, no power."""
    velocity = np.array([1.0, 0.4, -0.1])
    force, torque = loads(Lift(coefficient=0.7), motion(velocity=velocity), medium())
    assert torque is None
    assert force is not None
    # 0.5 1000 0.7 0.1 / sqrt(1.01) = 34.82630
    assert_allclose(force, [[3.482630, 0.0, 34.82630]], rtol=1e-6)
    assert abs(float(force[0] @ velocity)) < 1e-12


def test_lift_needs_an_angle_of_attack_and_a_flow() -> None:
    """None along body x, none at rest, half in half the water, downward when rising."""
    assert_array_equal(loads(Lift(coefficient=0.7), motion(), medium())[0], 0.0)
    ahead, _ = loads(Lift(coefficient=0.7), motion(velocity=(2.0, 0.0, 0.0)), medium())
    assert_array_equal(ahead, 0.0)
    carried, _ = loads(
        Lift(coefficient=0.7), motion(velocity=(1.0, 0.0, 0.1)), medium(0.5, flow=(0.0, 0.0, 0.2))
    )
    assert carried is not None
    assert_allclose(carried, [[1.741315, 0.0, 17.41315]], rtol=1e-6)
    rising, _ = loads(Lift(coefficient=0.7), motion(velocity=(1.0, 0.0, 0.1)), medium())
    assert rising is not None
    assert rising[0, 2] < 0.0


@pytest.mark.parametrize(("share", "weight"), [(0.0, 0.0), (0.25, 0.75), (0.5, 1.0), (1.0, 0.0)])
def test_radiation_damps_a_hull_that_pierces_the_surface(share: float, weight: float) -> None:
    """Full at half submersion, none in the air and none under water."""
    effect = DampingRadiation(coefficient_x=2.0, coefficient_z=12.0, angular_y=0.5)
    moved = motion(velocity=(1.0, 5.0, 2.0), spin=(1.0, 2.0, 3.0))
    force, torque = loads(effect, moved, medium(share, flow=(0.5, 0.0, 0.0)))
    assert force is not None
    assert torque is not None
    assert_allclose(force, weight * np.array([[-1.0, 0.0, -24.0]]), atol=1e-14)
    assert_allclose(torque, weight * np.array([[0.0, -1.0, 0.0]]), atol=1e-14)


def backlash(effect: JointBacklash, error: Any) -> Floats:
    """Return the change of torque of two joints at errors between command and joint."""
    params = bind_effects({"it": effect}, ["base"]).bound[0].params
    command = np.array([[0.7, -0.4]])
    joints = Joints(command - np.asarray(error), np.ones((len(error), 2)))
    inputs = Inputs(0.004, np.zeros((1, 2)), joint_command=command)
    found: Floats
    found, _ = JointBacklash.joint_loads(joints, inputs, None, params)
    return found


def test_play_takes_its_half_width_off_the_error() -> None:
    """10 N m/rad with 0.06 rad of play: -0.3 N m beyond it, all of the servo's torque inside."""
    found = backlash(JointBacklash(width=0.06, kp=10.0), [[0.1, -0.1], [0.02, -0.02], [0.0, 0.5]])
    assert_allclose(found, [[-0.3, 0.3], [-0.2, 0.2], [0.0, -0.3]], atol=1e-12)


def test_play_of_one_joint_leaves_the_others() -> None:
    """Joint 2 has play, joint 1 has none."""
    found = backlash(JointBacklash(joint=2, width=0.06, kp=10.0), [[0.1, 0.1]])
    assert_allclose(found, [[0.0, -0.3]], atol=1e-12)


def test_the_corner_of_the_play_is_round() -> None:
    """The torque left to the link has a slope that rises without a jump from 0 to kp."""
    error = np.linspace(0.028, 0.032, 401)
    left = (
        10.0 * error
        + backlash(JointBacklash(width=0.06, kp=10.0), np.stack((error, error), 1))[:, 0]
    )
    slope = np.diff(left) / np.diff(error)
    assert_allclose(slope[[0, -1]], [0.0, 10.0], atol=1e-9)
    # over 2 mrad the slope changes by 10 N m/rad: 0.05 a sample of 10 urad
    assert float(np.diff(slope).max()) < 0.0501
    assert float(np.diff(slope).min()) > -1e-9


def test_no_play_and_no_command_change_nothing() -> None:
    """Width zero is no effect; without a servo's command there is none either."""
    assert_allclose(backlash(JointBacklash(kp=10.0), [[0.1, -0.0005]]), 0.0, atol=1e-15)
    params = bind_effects({"it": JointBacklash(width=0.06)}, ["base"]).bound[0].params
    joints = Joints(np.ones((1, 2)), np.ones((1, 2)))
    found, _ = JointBacklash.joint_loads(joints, Inputs(0.004, np.zeros((1, 2))), None, params)
    assert_array_equal(found, 0.0)
