"""Closed forms of weight, lift, drags, added mass, slamming, flows, friction and the formula."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from seals.effects import bind_effects
from seals.motion import AddedInertia, Body, Drives, Inputs, Joints, Medium, Motion, Wrench
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.angular_drag import DragAngular
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.centre_of_buoyancy import CentreOfBuoyancy
from seals.plugins.effects.current import Current
from seals.plugins.effects.formula import EffectFormula
from seals.plugins.effects.gravity import Gravity
from seals.plugins.effects.joint_friction import JointFriction
from seals.plugins.effects.linear_drag import DragLinear
from seals.plugins.effects.quadratic_drag import DragQuadratic
from seals.plugins.effects.slamming import Slamming
from seals.plugins.effects.wind import Wind

RING = np.array([[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
"""Body x points along world y, y along z (up), z along x: unlike its transpose in every axis."""
INPUTS = Inputs(0.004, np.zeros((1, 0)))


def motion() -> Motion:
    """Return 2 kg and 2 litres that move with (1, -2, 0.5) m/s and turn with (1, -2, 3) rad/s."""
    body = Body(
        np.array([[2.0]]), np.array([[0.1, 0.2, 0.3]]), np.array([[2e-3]]), np.array([[0.05]])
    )
    speed, spin = np.array([[1.0, -2.0, 0.5]]), np.array([[1.0, -2.0, 3.0]])
    return Motion(np.zeros((1, 1)), np.zeros((1, 3)), RING, RING[:, 2, :], speed, spin, body)


def medium(share: float = 0.5, *, wetting: float = 4.0, sinking: float = 2.0) -> Medium:
    """Return water that flows with 0.5 m/s along body x and rises with 2 m/s^2 along body z."""

    def row(*x: float) -> Any:
        return np.array([x])

    return Medium(
        medium_fraction=row(share),
        velocity=row(0.5, 0.0, 0.0),
        acceleration=row(0.0, 0.0, 2.0),
        density=row(1000.0),
        viscosity=row(1e-3),
        submersion=row(share),
        submersion_rate=row(wetting),
        buoyancy_centre=row(0.1, 0.0, 0.2),
        normal=row(0.0, 1.0, 0.0),
        sinking_speed=row(sinking),
        gravity=row(10.0),
    )


def called(effect: Any, around: Medium | None = None, *, hook: str = "loads") -> Any:
    """Return the output of one hook."""
    params = bind_effects({"it": effect}, ["base"]).bound[0].params
    law = getattr(effect, hook)
    found, memory = law(motion(), around or medium(), INPUTS, None, params)
    assert memory is None
    return found


def assert_wrench(found: Wrench, force: Any, torque: Any) -> None:
    """Compare with three numbers each; None stands for none."""
    for part, expected in zip(found, (force, torque), strict=True):
        if expected is None:
            assert part is None
        else:
            assert_allclose(part, [expected], rtol=1e-13, atol=1e-13)


def test_weight_pulls_down_at_the_centre_of_mass() -> None:
    """2 kg under 10 m/s^2, up along body y: 20 N, and (0.1, 0.2, 0.3) m x (0, -20, 0) N."""
    assert_wrench(called(Gravity()), (0.0, -20.0, 0.0), (6.0, 0.0, -2.0))


def test_lift_is_that_of_the_displaced_water() -> None:
    """1.5 kg of water under 10 m/s^2 up and 2 m/s^2 along z, at (0.1, 0, 0.2) m."""
    assert_wrench(called(Buoyancy(volume_change=1e-3)), (0.0, 15.0, 3.0), (-3.0, -0.3, 1.5))


def test_a_shifted_lift_is_up_in_the_world() -> None:
    """1 kg of water, its lift of (0, 10, 2) N moved by (0.01, 0.02, 0.5) m."""
    effect = CentreOfBuoyancy(offset_x=0.01, offset_y=0.02, offset_z=0.5)
    assert_wrench(called(effect), None, (-4.96, -0.02, 0.1))


def test_linear_drag_is_proportional_to_the_relative_speed() -> None:
    """(1, 2, 3) N s/m at (0.5, -2, 0.5) m/s, half in the medium."""
    effect = DragLinear(coefficient_x=1.0, coefficient_y=2.0, coefficient_z=3.0)
    assert_wrench(called(effect), (-0.25, 2.0, -0.75), None)


def test_quadratic_drag_grows_with_the_square_and_keeps_the_sign() -> None:
    """(1, 2, 3) N s^2/m^2 at (0.5, -2, 0.5) m/s, half in the medium."""
    effect = DragQuadratic(coefficient_x=1.0, coefficient_y=2.0, coefficient_z=3.0)
    assert_wrench(called(effect), (-0.125, 4.0, -0.375), None)


def test_angular_drag_has_a_linear_and_a_quadratic_part() -> None:
    """(0.11, 0.24, 0.39) N m s/rad at (1, -2, 3) rad/s, half in the medium."""
    linear = {f"coefficient_{a}": 0.1 * (k + 1) for k, a in enumerate("xyz")}
    square = {f"quadratic_{a}": 0.01 * (k + 1) for k, a in enumerate("xyz")}
    assert_wrench(called(DragAngular(**linear, **square)), None, (-0.055, 0.24, -0.585))


COUPLING = np.zeros((6, 6))
COUPLING[0, 4] = COUPLING[4, 0] = 0.05
MASSES = {"mass_x": 1.0, "mass_y": 2.0, "mass_z": 3.0}
MOMENTS = {"inertia_x": 0.1, "inertia_y": 0.2, "inertia_z": 0.3}


def test_added_mass_is_a_matrix_with_the_wet_share() -> None:
    """Diagonal and coupling, half wet."""
    effect = AddedMass(**MASSES, **MOMENTS, coupling=COUPLING.tolist())
    found: AddedInertia = called(effect, hook="inertia")
    assert_allclose(
        found.matrix * found.weight[:, :, None],
        [0.5 * (np.diag([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]) + COUPLING)],
        rtol=1e-14,
    )


def test_wetting_takes_the_momentum_of_the_added_mass() -> None:
    """4 a second of (1, 2, 3) kg at (0.5, -2, 0.5) m/s while s rises, nothing while it falls."""
    effect = AddedMass(**MASSES, **MOMENTS)
    assert_wrench(called(effect), (-2.0, 16.0, -6.0), (-0.4, 1.6, -3.6))
    assert_wrench(called(effect, medium(wetting=-4.0)), (0.0,) * 3, (0.0,) * 3)


def test_slamming_pushes_along_the_water_normal_while_entering() -> None:
    """0.5 1000 1.2 0.05 m^2 (2 m/s)^2 4 (1/4) (3/4) = 90 N; nothing while leaving."""
    effect = Slamming(coefficient=1.2)
    assert_wrench(called(effect, medium(0.25)), (0.0, 90.0, 0.0), None)
    assert_wrench(called(effect, medium(0.25, sinking=-2.0)), (0.0, 0.0, 0.0), None)


@pytest.mark.parametrize("cls", [Wind, Current])
def test_a_flow_is_its_velocity_in_the_world(cls: Any) -> None:
    """Whatever the attitude, the parameters are world axes."""
    found = called(cls(velocity_x=1.0, velocity_y=-2.0, velocity_z=3.0), hook="flow")
    assert_array_equal(found, [[1.0, -2.0, 3.0]])


@pytest.mark.parametrize(("joint", "chosen"), [(0, (1.0, 1.0)), (1, (1.0, 0.0)), (2, (0.0, 1.0))])
def test_joint_friction_has_a_dry_and_a_viscous_part(
    joint: int, chosen: tuple[float, float]
) -> None:
    """-0.2 - 0.05 2 at 2 rad/s; at the threshold of 0.1 rad/s tanh(1) of the dry part."""
    effect = JointFriction(coulomb=0.2, viscous=0.05, threshold=0.1, joint=joint)
    params = bind_effects({"it": effect}, ["base"]).bound[0].params
    joints = Joints(np.zeros((1, 2)), np.array([[2.0, -0.1]]))
    found, _ = JointFriction.joint_loads(joints, INPUTS, np.zeros((1, 0)), params)
    expected = [-0.3 * chosen[0], (0.2 * math.tanh(1.0) + 0.005) * chosen[1]]
    assert_allclose(found, [expected], rtol=1e-13, atol=1e-15)


def test_a_formula_adds_its_terms() -> None:
    """Push in the body and hold in the world; twist, spin and wheel; half in the medium."""
    force = EffectFormula(push_x=1.0, hold_x=1.0, hold_y=2.0, hold_z=3.0)
    assert_wrench(called(force), (1.5, 1.5, 0.5), (0.0, 0.0, 0.0))
    # twist (0.1, 0, 0), spin (0, 0, -0.2 3), wheel (0.5, 0, 0) x (1, -2, 3) = (0, -1.5, -1)
    torque = EffectFormula(twist_x=0.1, spin_z=0.2, wheel_x=0.5)
    assert_wrench(called(torque), (0.0, 0.0, 0.0), (0.05, -0.75, -0.8))


def test_a_formula_adds_a_share_of_the_thrust() -> None:
    """A fifth more in the medium, half of it here: 1.1 of thrust and torque."""
    params = bind_effects({"it": EffectFormula(thrust=0.2)}, ["base"]).bound[0].params
    drives = Drives(
        np.zeros((2, 3)),
        np.array([[0.0, 0.0, 1.0]] * 2),
        np.full(2, 0.1),
        np.array([[3.0, 5.0]]),
        np.array([[0.3, -0.5]]),
    )
    found = EffectFormula.actuation(drives, motion(), medium(), INPUTS, params)
    assert_allclose(found.thrust, [[3.3, 5.5]], rtol=1e-14)
    assert_allclose(found.torque, [[0.33, -0.55]], rtol=1e-14)
