"""What actuators really do: ground, sag, water, weakness, and the drag of rotors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from seals.arrays import Array, Floats
from seals.effects import Effect, MediumKind, bind_effects
from seals.errors import ConfigError
from seals.motion import Body, Drives, Inputs, Medium, Motion
from seals.plugins.effects.battery_sag import BatterySag
from seals.plugins.effects.ground_effect import GroundEffect, GroundForm
from seals.plugins.effects.motor_curve import MotorCurve
from seals.plugins.effects.rotor_drag import DragRotor
from seals.plugins.effects.thrust_coefficient import ThrustCoefficient
from seals.plugins.effects.thrust_in_water import ThrustInWater
from seals.plugins.effects.weak_rotor import WeakRotor

NOSE_DOWN = np.array([[[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]])
"""Pitch of a quarter turn: the nose points at the ground."""


def drives() -> Drives:
    """Return two rotors of 0.12 m with 3 and 5 N."""
    return Drives(
        position=np.array([[0.1, 0.2, 0.05], [-0.1, 0.2, 0.05]]),
        axis=np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
        radius=np.array([0.12, 0.12]),
        thrust=np.array([[3.0, 5.0]]),
        torque=np.array([[-0.03, 0.05]]),
    )


def motion(height: float = 0.0, rotation: Floats | None = None) -> Motion:
    """Return one body at a height, moving with (1, 2, 3) m/s and turning with 2 rad/s about z."""
    turn = np.eye(3)[None] if rotation is None else rotation
    body = Body(*(np.ones((1, k)) for k in (1, 3, 1, 1)))
    place = np.array([[0.3, -0.4, height]])
    velocity, spin = np.array([[1.0, 2.0, 3.0]]), np.array([[0.0, 0.0, 2.0]])
    return Motion(np.zeros((1, 1)), place, turn, turn[:, 2, :], velocity, spin, body)


def medium(share: float = 1.0) -> Medium:
    """Return air that moves with 0.5 m/s along x."""
    one, none = np.ones((1, 1)), np.zeros((1, 3))
    flow = np.array([[0.5, 0.0, 0.0]])
    up = np.array([[0.0, 0.0, 1.0]])
    dry = 1.0 - share * one
    return Medium(share * one, flow, none, one, one, dry, one, none, up, one, one)


def act(
    effect: Any, moved: Motion, *, voltage: float | None = None, values: Any = None, batch: int = 1
) -> Drives:
    """Return the two rotors after one effect."""
    bound = bind_effects({"it": effect}, ["base"])
    params = bound.with_values(values or {}, np.zeros(1), batch).bound[0].params
    volts = None if voltage is None else np.array([[voltage]])
    inputs = Inputs(0.004, np.zeros((1, 0)), None, volts)
    return effect.actuation(drives(), moved, medium(), inputs, params)


def assert_only_loads_moved(found: Drives) -> None:
    """Places, axes and radii of the drives are as they were."""
    for name in ("position", "axis", "radius"):
        assert_array_equal(getattr(found, name), getattr(drives(), name))


def test_ground_effect_is_that_of_cheeseman_and_bennett() -> None:
    """A hub 0.22 m over the ground: 1 / (1 - (0.12 / 0.88)^2) = 1.018947; torques stay."""
    found = act(GroundEffect(coefficient=1.0, ground_level=0.1), motion(0.27))
    assert_allclose(found.thrust, np.array([[3.0, 5.0]]) * 1.0189474, rtol=1e-7)
    assert_array_equal(found.torque, drives().torque)
    assert_only_loads_moved(found)


def test_ground_effect_counts_the_height_of_the_hub_itself() -> None:
    """Nose down, the hub ahead is 0.2 m lower than the one behind."""
    found = act(GroundEffect(coefficient=1.0), motion(0.3, NOSE_DOWN))
    # world heights 0.3 - 0.1 and 0.3 + 0.1
    gains = [1.0 / (1.0 - (0.12 / 0.8) ** 2), 1.0 / (1.0 - (0.12 / 1.6) ** 2)]
    assert_allclose(found.thrust, [[3.0 * gains[0], 5.0 * gains[1]]], rtol=1e-12)


def test_ground_effect_of_a_whole_vehicle_has_no_righting_moment() -> None:
    """Nose down, both hubs count the height of the middle between them, 0.3 m."""
    whole = GroundEffect(coefficient=1.0, form=GroundForm.vehicle)
    found = act(whole, motion(0.3, NOSE_DOWN))
    gain = 1.0 / (1.0 - (0.12 / 1.2) ** 2)
    assert_allclose(found.thrust, [[3.0 * gain, 5.0 * gain]], rtol=1e-12)


@pytest.mark.parametrize("height", [0.01, -0.05, -3.0])
def test_ground_effect_stays_finite_on_and_under_the_ground(height: float) -> None:
    """Below half a radius it is that of half a radius, 4/3; a drive without a disc is left."""
    found = act(GroundEffect(coefficient=1.0), motion(height - 0.05))
    assert_allclose(found.thrust, np.array([[4.0, 20.0 / 3.0]]), rtol=1e-12)
    bound = bind_effects({"it": GroundEffect(coefficient=1.0)}, ["base"]).bound[0]
    jets = drives()._replace(radius=np.zeros(2))
    inputs = Inputs(0.004, np.zeros((1, 0)))
    same = GroundEffect.actuation(jets, motion(height - 0.05), medium(), inputs, bound.params)
    assert_array_equal(same.thrust, jets.thrust)


def test_ground_effect_fades_with_height() -> None:
    """At ten radii it is below 0.1 %."""
    found = act(GroundEffect(coefficient=1.0), motion(1.2))
    assert 1.0 < found.thrust[0, 0] / 3.0 < 1.001


def test_rotor_drag_acts_at_every_hub() -> None:
    """Two hubs turning and moving in wind, by hand."""
    bound = bind_effects({"it": DragRotor(coefficient=0.02)}, ["base"]).bound[0]
    inputs = Inputs(0.004, np.zeros((1, 0)))
    # hubs move with (0.1, 2.2) and (0.1, 1.8) m/s against the air, which makes (-6, -132) and
    # (-10, -180) mN
    for share in (1.0, 0.25):
        (force, torque), _ = DragRotor.drive_loads(
            drives(), motion(), medium(share), inputs, None, bound.params
        )
        assert force is not None
        assert torque is not None
        assert_allclose(force, share * np.array([[-0.016, -0.312, 0.0]]), atol=1e-15)
        assert_allclose(torque, share * np.array([[0.0156, -0.0008, 0.008]]), atol=1e-15)
    assert DragRotor().medium is MediumKind.air


def test_drag_above_the_hubs_turns_by_its_lever() -> None:
    """The force stays, (-16, -312) mN, and turns with a lever of 0.3 m more."""
    bound = bind_effects({"it": DragRotor(coefficient=0.02, lever=0.3)}, ["base"]).bound[0]
    inputs = Inputs(0.004, np.zeros((1, 0)))
    (force, torque), _ = DragRotor.drive_loads(
        drives(), motion(), medium(1.0), inputs, None, bound.params
    )
    assert force is not None
    assert torque is not None
    assert_allclose(force, [[-0.016, -0.312, 0.0]], atol=1e-15)
    expected = [[0.0156 + 0.3 * 0.312, -0.0008 - 0.3 * 0.016, 0.008]]
    assert_allclose(torque, expected, atol=1e-15)


def test_rotor_drag_may_grow_with_another_power_of_the_thrust() -> None:
    """With a power of one half and 4 N typical, 3 and 5 N brake by sqrt(4 / T) of themselves."""
    inputs, forces = Inputs(0.004, np.zeros((1, 0))), []
    for law in (DragRotor(coefficient=0.02), DragRotor(coefficient=0.02, exponent=0.5, typical=4)):
        bound = bind_effects({"it": law}, ["base"]).bound[0]
        alone = [drives()._replace(thrust=np.array([t])) for t in ([3.0, 0.0], [0.0, 5.0])]
        forces.append(
            [
                DragRotor.drive_loads(d, motion(), medium(1.0), inputs, None, bound.params)[0].force
                for d in alone
            ]
        )
    expected = [f * np.sqrt(4.0 / t) for f, t in zip(forces[0], (3.0, 5.0), strict=True)]
    assert_allclose(forces[1], expected, rtol=1e-12)


def test_thrust_coefficient_changes_thrust_and_torque() -> None:
    """A loss of 10 % in one row of a batch and none in the other."""
    values: dict[str, Array] = {"it.relative_change": np.array([0.0, -0.1])}
    found = act(ThrustCoefficient(), motion(), values=values, batch=2)
    assert_allclose(found.thrust, [[3.0, 5.0], [2.7, 4.5]], rtol=1e-14)
    assert_allclose(found.torque, [[-0.03, 0.05], [-0.027, 0.045]], rtol=1e-14)
    assert_only_loads_moved(found)


def test_a_weak_rotor_loses_its_own_thrust_alone() -> None:
    """The second loses a fifth; the first and both torques stay."""
    found = act(WeakRotor(rotor=2, relative_loss=0.2), motion())
    assert_allclose(found.thrust, [[3.0, 4.0]], rtol=1e-14)
    assert_array_equal(found.torque, drives().torque)
    assert_only_loads_moved(found)


def test_a_weak_rotor_counts_from_one() -> None:
    """Rotor 0 is refused."""
    with pytest.raises(ConfigError, match=r"weak_rotor\.rotor=0"):
        WeakRotor(rotor=0)


def test_sag_takes_thrust_with_the_voltage() -> None:
    """At nine tenths of the voltage a sensitivity of 0.5 leaves 95 %."""
    found = act(BatterySag(sensitivity=0.5, full_voltage=16.4), motion(), voltage=14.76)
    assert_allclose(found.thrust, [[2.85, 4.75]], rtol=1e-12)
    assert_allclose(found.torque, [[-0.0285, 0.0475]], rtol=1e-12)
    assert_only_loads_moved(found)


def test_sag_does_nothing_while_the_voltage_is_unknown() -> None:
    """Without a voltage the drives come back as given."""
    assert_array_equal(act(BatterySag(sensitivity=0.5), motion()).thrust, drives().thrust)


@pytest.mark.parametrize(
    ("depth", "gain"),
    [(-0.031, 1.0), (0.0, 0.85), (0.015, 0.746875), (0.031, 0.7), (2.0, 0.7)],
)
def test_thrust_in_water_follows_the_depth_of_the_hub(depth: float, gain: float) -> None:
    """1 + s (0.8 - 0.1 - 1) with s = u^2 (3 - 2 u) over 6 cm: 1/2 at the level, 27/32 at 1.5 cm."""
    effect = ThrustInWater(ratio=0.8, ratio_change=-0.1, water_level=0.4)
    found = act(effect, motion(0.4 - 0.05 - depth))
    assert_allclose(found.thrust, gain * drives().thrust, rtol=1e-12)
    assert_allclose(found.torque, gain * drives().torque, rtol=1e-12)
    assert_only_loads_moved(found)


def test_thrust_in_water_sees_each_hub_by_itself() -> None:
    """Nose down at the level, the hub ahead is wet and the one behind is dry."""
    found = act(ThrustInWater(ratio=0.5), motion(0.0, NOSE_DOWN))
    assert_allclose(found.thrust, [[1.5, 5.0]], rtol=1e-12)


@pytest.mark.parametrize(
    "effect",
    [GroundEffect(), ThrustCoefficient(), WeakRotor(), BatterySag(), ThrustInWater()],
    ids=lambda effect: type(effect).__name__,
)
def test_an_effect_of_size_zero_changes_nothing(effect: Effect) -> None:
    """Defaults leave thrust and torque as they are, bit for bit."""
    found = act(effect, motion(0.05), voltage=12.0)
    assert_array_equal(found.thrust, drives().thrust)
    assert_array_equal(found.torque, drives().torque)


def test_a_propeller_that_slips_loses_torque_with_its_thrust() -> None:
    """A fifth of both; the other rotor keeps all."""
    after = act(WeakRotor(rotor=2, relative_loss=0.2, torque_share=1.0), motion())
    assert_allclose(after.thrust, [[3.0, 4.0]])
    assert_allclose(after.torque, [[-0.03, 0.04]])


def test_a_motor_curve_moves_speeds_and_their_squares() -> None:
    """By w = 50 sign(w_0) + 0.9 w_0 400 becomes 410, -200 becomes -230; one at rest stays."""
    at = drives()._replace(
        speed=np.array([[400.0, -200.0, 0.0]]),
        thrust=np.array([[4.0, 1.0, 0.0]]),
        torque=np.array([[0.4, 0.1, 0.0]]),
    )
    bound = bind_effects({"it": MotorCurve(offset=50.0, slope_change=-0.1)}, ["base"])
    params = bound.with_values({}, np.zeros(1), 1).bound[0].params
    after = MotorCurve.actuation(at, motion(), medium(), Inputs(0.0, np.zeros((1, 0))), params)
    assert after.speed is not None
    assert_allclose(after.speed, [[410.0, -230.0, 0.0]])
    assert_allclose(after.thrust, [[4.0 * (410 / 400) ** 2, (230 / 200) ** 2, 0.0]])
    assert_allclose(after.torque, [[0.4 * (410 / 400) ** 2, 0.1 * (230 / 200) ** 2, 0.0]])
    still = MotorCurve.actuation(
        drives(), motion(), medium(), Inputs(0.0, np.zeros((1, 0))), params
    )
    assert_array_equal(still.thrust, drives().thrust)
