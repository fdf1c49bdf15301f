"""Rotors in their medium and a battery under load: laws by hand, double counting, limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.effects import bind_effects
from seals.environment.disc import hub_depth
from seals.environment.seawater import FRESH_WATER
from seals.errors import ConfigError
from seals.motion import Body, Drives, Inputs, Joints, Medium, Motion
from seals.plugins.actuators.rotors import Rotors
from seals.plugins.actuators.servos import Servos
from seals.plugins.actuators.thrusters import Thrusters
from seals.plugins.effects.battery import Battery, cell_voltage
from seals.plugins.effects.battery_sag import BatterySag
from seals.plugins.effects.rotor_medium import RotorMedium
from seals.plugins.effects.thrust_in_water import ThrustInWater
from seals.plugins.effects.thruster_medium import ThrusterMedium
from seals.world import Drivetrain

INPUTS = Inputs(0.004, np.zeros((1, 0)))


def params(effect: Any) -> Any:
    """Return the parameter arrays of one effect."""
    return bind_effects({"it": effect}, ["base"]).bound[0].params


def rotors(thrust: float = 3.0, torque: float = 0.03) -> Drives:
    """Return a rotor of 0.1 m half a metre over the origin, and a thruster without a disc."""
    places = np.array([[0.0, 0.0, 0.5], [0.2, 0.0, 0.5]])
    axes = np.tile([0.0, 0.0, 1.0], (2, 1))
    pull, reaction = np.array([[thrust, 5.0]]), np.array([[-torque, 0.0]])
    return Drives(places, axes, np.array([0.1, 0.0]), pull, reaction, np.array([[400.0, 0.0]]))


def placed(depth: float | None, air: float = 1.0) -> tuple[Motion, Medium]:
    """Return a body whose hubs are at a depth [m] in fresh water of 1000 kg/m^3."""
    one, none = np.ones((1, 1)), np.zeros((1, 3))
    up = np.array([[0.0, 0.0, 1.0]])
    body = Body(*(np.ones((1, k)) for k in (1, 3, 1, 1)))
    moved = Motion(np.zeros((1, 1)), none, np.eye(3)[None], up, none, none, body)
    level = None if depth is None else (depth + 0.5) * one
    own = (one, none, none, one, one, one, one, none, up, one, one)
    return moved, Medium(*own, level, 1e3 * one, air * one)


def submerged(depth: float | None, efficiency: float = 0.7, limit: float = 0.1) -> Drives:
    """Return what a rotor gives with its hub at a depth [m]."""
    effect = RotorMedium(efficiency=efficiency, torque_limit=limit, reference_density=1.0)
    return RotorMedium.actuation(rotors(), *placed(depth), INPUTS, params(effect))


@pytest.mark.parametrize(
    ("depth", "share"),
    [
        (None, 1.2 / FRESH_WATER),
        (-0.11, 0.0012),
        (-0.1, 0.0012),
        (0.0, 0.5006),
        (0.1, 1.0),
        (3.0, 1.0),
    ],
)
def test_a_thruster_pushes_with_the_density_around_it(depth: float | None, share: float) -> None:
    """All of its force a radius under water, 1.2 of 1000 parts a radius above; rotors stay."""
    effect = ThrusterMedium(radius=0.1)
    found = ThrusterMedium.actuation(rotors(), *placed(depth, air=1.2), INPUTS, params(effect))
    assert_allclose(found.thrust, [[3.0, 5.0 * share]], rtol=1e-12)


@pytest.mark.parametrize("depth", [-0.11, None])
def test_a_rotor_in_air_is_left_alone(depth: float | None) -> None:
    """More than a radius above the water, or without water, nothing changes."""
    found = submerged(depth)
    for name in ("thrust", "torque", "speed"):
        assert_allclose(getattr(found, name), getattr(rotors(), name), rtol=1e-12)


def test_a_slow_rotor_in_water_pushes_with_the_density() -> None:
    """A thousand times the density: a thousand times the torque, 700 times the thrust."""
    found = submerged(0.2, limit=1e3)
    assert_allclose(found.torque, [[-30.0, 0.0]])
    assert_allclose(found.thrust, [[2100.0, 5.0]])
    assert_allclose(found.speed, [[400.0, 0.0]])


@pytest.mark.parametrize("waves", [False, True])
def test_the_rotor_at_the_lower_end_of_a_tilted_body_is_in_the_water(*, waves: bool) -> None:
    """30 degrees nose down, 0.3 m before and behind the origin: one rotor 0.15 m deep, one dry."""
    angle = math.radians(30.0)
    up = np.array([[-math.sin(angle), 0.0, math.cos(angle)]])
    turn = np.array([[up[0, 2], 0.0, -up[0, 0]], [0.0, 1.0, 0.0], [up[0, 0], 0.0, up[0, 2]]])
    moved, medium = placed(-0.5)
    moved = moved._replace(rotation=turn[None], up=up)
    medium = medium._replace(depth=np.zeros((1, 1)), normal=up if waves else None)
    ends = np.array([[0.3, 0.0, 0.0], [-0.3, 0.0, 0.0]])
    drives = rotors()._replace(
        position=ends, radius=np.array([0.1, 0.1]), thrust=np.full((1, 2), 3.0)
    )
    effect = RotorMedium(efficiency=0.7, torque_limit=1e3, reference_density=1.0)
    found = RotorMedium.actuation(drives, moved, medium, INPUTS, params(effect))
    assert_allclose(found.thrust, [[2100.0, 3.0]])


def test_a_fast_rotor_in_water_runs_at_the_torque_of_its_motor() -> None:
    """k_Q g w^2 is the limit, and the thrust is that of the limit: 0.7 * 100 * 0.1 N."""
    found = submerged(0.2)
    assert_allclose(found.torque, [[-0.1, 0.0]])
    assert_allclose(found.thrust, [[7.0, 5.0]])
    # 0.03 N m at 400 rad/s in air: 0.1 N m in water at 400 sqrt(0.1 / 30)
    assert_allclose(found.speed, [[400.0 * np.sqrt(0.1 / 30.0), 0.0]])


def test_a_disc_gets_wet_over_its_own_radius() -> None:
    """At the level half of it is wet, at half a radius 27/32 of it."""
    at_level, deeper = submerged(0.0, 1.0, 1e3), submerged(0.05, 1.0, 1e3)
    assert_allclose(at_level.torque[0, 0], -0.03 * 500.5)
    assert_allclose(deeper.torque[0, 0], -0.03 * (5.0 + 27.0 * 1000.0) / 32.0)


def test_two_laws_of_thrust_in_water_are_refused_on_one_link() -> None:
    """So are a battery and a sag; the words name both."""
    for pair in ((RotorMedium(), ThrustInWater()), (Battery(), BatterySag())):
        with pytest.raises(ConfigError, match="'first' and 'second' both account for"):
            bind_effects(dict(zip(("first", "second"), pair, strict=True)), ["base"])


def test_a_sag_with_another_exponent_agrees_at_the_typical_shortfall() -> None:
    """10 % short is typical: there the exponent changes nothing, at 5 % it halves the loss once."""
    for short, exponent, loss in ((0.1, 2.0, 0.3), (0.05, 2.0, 0.075), (0.05, 1.0, 0.15)):
        law = BatterySag(sensitivity=3.0, full_voltage=10.0, exponent=exponent, typical=0.1)
        inputs = Inputs(0.004, np.zeros((1, 0)), voltage=np.array([[10.0 * (1.0 - short)]]))
        left = BatterySag.actuation(rotors(), *placed(None), inputs, params(law))
        assert_allclose(left.thrust, [[3.0 * (1.0 - loss), 5.0 * (1.0 - loss)]], rtol=1e-12)


def test_the_power_of_a_rotor_is_torque_times_speed_and_losses() -> None:
    """0.03 N m at 400 rad/s, 0.005 N m of friction, 600 W/(N m)^2 of copper."""
    one = Rotors(position=[[0, 0, 0]], friction_torque=[0.005], copper_loss=[600.0])
    running = rotors()._replace(torque=np.array([[-0.03]]), speed=np.array([[400.0]]))
    assert_allclose(Rotors.power(running, params(one)), [[12.0 + 2.0 + 0.54]])
    jets = running._replace(thrust=np.array([[-4.0]]), speed=None)
    assert_allclose(Thrusters.power(jets, params(Thrusters(power_coefficient=[0.5]))), [[4.0]])


def test_a_battery_gives_the_power_that_is_asked_for() -> None:
    """V I is drives plus electronics, V is E - R I, and the charge is the current's integral."""
    battery = Battery(cells=4.0, capacity=100.0, resistance=0.05, charge=0.9, electronics=10.0)
    memory, values = np.array([[20.0, 0.0]]), params(battery)
    new = Battery.battery_update(np.array([[190.0]]), Inputs(0.1, np.zeros((1, 0))), memory, values)
    voltage, current, charge = Battery.state(new, values)
    assert_allclose(voltage, 4.0 * cell_voltage(charge) - 0.05 * current, rtol=1e-12)
    # the voltage belongs to the charge before the step: 0.7
    before = 4.0 * cell_voltage(np.array([[0.7]])) - 0.05 * current
    assert_allclose(before * current, [[200.0]], rtol=1e-12)
    assert_allclose(charge, 0.9 - (20.0 + 0.1 * current) / 100.0, rtol=1e-12)


def test_a_battery_gives_no_more_than_it_can() -> None:
    """Beyond E^2 / 4 R the current is that of the largest power; an empty cell stays finite."""
    battery = params(Battery(resistance=0.1, cells=1.0))
    new = Battery.battery_update(np.array([[1e6]]), INPUTS, np.zeros((1, 2)), battery)
    assert_allclose(new[0, 1], cell_voltage(np.array(1.0)) / 0.2)
    empty, _, charge = Battery.state(np.array([[1e9, 0.0]]), battery)
    assert charge[0, 0] == 0.0
    assert_allclose(empty, 2.654, rtol=1e-9)


def test_a_low_battery_weakens_held_thrust_by_its_sensitivity() -> None:
    """At 90 % of the full voltage and a sensitivity of two, 80 % of thrust and torque are left."""
    battery = Battery(cells=4.0, sensitivity=2.0)
    full = 4.0 * float(cell_voltage(np.array(1.0)))
    # the full cell of the law leaves out a term of e^-35
    low = INPUTS._replace(voltage=np.array([[0.9 * full]]))
    given: Any = (None, None)
    found = Battery.actuation(rotors(), *given, low, params(battery))
    assert_allclose(found.thrust, [[0.8 * 3.0, 0.8 * 5.0]], rtol=1e-9)
    assert_allclose(found.torque, [[-0.8 * 0.03, 0.0]], rtol=1e-9)
    assert_allclose(found.speed, [[400.0 * 0.8**0.5, 0.0]], rtol=1e-9)


def train(*effects: Any, joints: int = 0) -> Drivetrain:
    """Return the drivetrain of some actuators."""
    named = {f"effect_{k}": effect for k, effect in enumerate(effects)}
    return Drivetrain(bind_effects(named, ["base"]), joints)


def test_rotors_slow_down_with_a_time_constant_of_their_own() -> None:
    """Up within 0.05 s, down within 0.2 s, each an exact exponential whatever the step."""
    line = train(Rotors(time_constant=[0.05], spin_down=[0.2]))
    line.drive(0.0, np.array([[800.0]]), None)
    up = line.drive(0.05, np.array([[0.0]]), np.zeros((1, 1)))
    assert up is not None
    assert_allclose(up, 800.0 * (1.0 - np.exp(-1.0)))
    half = line.drive(0.15, np.array([[0.0]]), up)
    down = line.drive(0.25, np.array([[0.0]]), half)
    assert_allclose(down, up * np.exp(-1.0))


def test_the_voltage_limits_speeds_and_the_square_of_it_forces() -> None:
    """At nine tenths of the voltage 900 rad/s and 81 % of the force are left."""
    pair = Rotors(time_constant=[0.0], max_speed=[1000.0])
    jet = Thrusters(time_constant=[0.0], max_force=[10.0], first=1)
    line = train(pair, jet)
    full = np.array([[1000.0, -10.0]])
    assert_allclose(line.drive(0.0, full, None), full)
    assert_allclose(line.drive(0.1, full, full, 0.9), [[900.0, -8.1]])
    assert_allclose(line.drive(0.2, np.array([[700.0, -5.0]]), full, 0.9), [[700.0, -5.0]])


def test_a_servo_moves_its_place_no_faster_than_its_speed() -> None:
    """From where the joint is, by 2 rad/s at the first and at once at the second joint."""
    line = train(Servos(speed_limit=[2.0, 1e6]), joints=2)
    at, asked = np.array([[0.1, 0.0]]), np.array([[1.0, 1.0]])
    assert line.position(0.0, None, at, 0.1) is None
    assert_allclose(line.position(0.1, asked, at, 0.1), [[0.3, 1.0]])
    kept = line.snapshot()
    assert_allclose(line.position(0.2, asked, at, 0.1), [[0.5, 1.0]])
    line.restore(kept)
    assert_allclose(line.position(0.2, asked, at, 0.1), [[0.5, 1.0]])


def test_gains_of_a_servo_may_be_given_joint_by_joint() -> None:
    """A list rules over its number; the commanded rate counts; other lengths are refused."""
    servo = Servos(kp=1.0, kd_each=[0.5, 0.0], torque_limit_each=[0.3])
    joints = Joints(np.array([[0.2, 0.2]]), np.array([[1.0, 1.0]]))
    moving = Inputs(0.004, np.zeros((1, 2)), joint_command=np.array([[0.3, 0.3]]))
    given = params(servo)
    assert_allclose(Servos.joint_loads(joints, moving, None, given)[0], [[-0.3, 0.1]])
    ahead = moving._replace(joint_rate=np.array([[1.2, 0.0]]))
    assert_allclose(Servos.joint_loads(joints, ahead, None, given)[0], [[0.2, 0.1]])
    assert_allclose(servo.of_joints("kp", 2), [1.0, 1.0])
    with pytest.raises(ConfigError, match=r"servos\.kd_each=.*\n.*one per joint"):
        servo.of_joints("kd", 3)
    with pytest.raises(ConfigError, match=r"servos\.speed_limit"):
        Servos(speed_limit=[0.0])


def test_hubs_on_a_sloping_surface_are_at_no_depth() -> None:
    """A plane that rises by 0.3 a metre, a link 0.1 m straight below it, hubs where it is met."""
    slope, under = 0.3, 0.1
    moved, around = placed(0.0)
    normal = np.array([[-slope, 0.0, 1.0]]) / math.hypot(1.0, slope)
    around = around._replace(normal=normal, depth=np.array([[under]]))
    places = np.array([[x, 0.2, under + slope * x] for x in (-0.5, 0.0, 0.5)])
    found = hub_depth(rotors()._replace(position=places), moved, around)
    assert_allclose(found, np.zeros((1, 3)), atol=1e-15)
    lower = hub_depth(rotors()._replace(position=places - 0.05 * normal), moved, around)
    assert_allclose(lower, np.full((1, 3), 0.05), atol=1e-15)
