"""What inertial sensors report, and when; commands and drives that come late."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import seals
from seals.effects import Effect, bind_effects
from seals.frames import matrix_of, quaternion_of_rpy
from seals.motion import Reading, Timing
from seals.plugins.actuators.rotors import Rotors
from seals.plugins.effects.accelerometer_bias import AccelerometerBias
from seals.plugins.effects.accelerometer_scale import AccelerometerScale
from seals.plugins.effects.command_delay import CommandDelay
from seals.plugins.effects.gyroscope_bias import GyroscopeBias
from seals.plugins.effects.rotor_lag import RotorLag
from seals.plugins.effects.sensor_delay import SensorDelay
from seals.plugins.effects.sensor_misalignment import SensorMisalignment
from seals.plugins.effects.sensor_place import SensorPlace
from seals.world.drivetrain import response_of

SPIN, FORCE = np.array([[0.1, 0.2, 0.3]] * 2), np.array([[1.0, -2.0, 9.0]] * 2)


def params(effect: Effect, batch: int = 1, **values: Any) -> Any:
    """Return the parameter arrays of one effect."""
    given = {f"it.{name}": value for name, value in values.items()}
    bound = bind_effects({"it": effect}, ["base"]).with_values(given, np.zeros(1), batch)
    return bound.bound[0].params


def measured(effect: Any, batch: int = 1, **values: Any) -> Reading:
    """Return the reading of two rows after one effect."""
    return effect.measure(Reading(SPIN, FORCE), params(effect, batch, **values))


def test_a_biased_accelerometer_adds_its_bias() -> None:
    """The specific force moves by the bias, the angular velocity stays."""
    found = measured(AccelerometerBias(bias_x=0.5, bias_y=-0.25, bias_z=0.125))
    assert_array_equal(found.specific_force, [[1.5, -2.25, 9.125]] * 2)
    assert_array_equal(found.angular_velocity, SPIN)


def test_a_wrong_scale_multiplies_each_axis() -> None:
    """(1 + k) times the true value, axis by axis; the angular velocity stays."""
    found = measured(AccelerometerScale(scale_x=0.5, scale_z=-0.25))
    assert_array_equal(found.specific_force, [[1.5, -2.0, 6.75]] * 2)
    assert_array_equal(found.angular_velocity, SPIN)


def test_a_biased_gyroscope_adds_its_bias() -> None:
    """The angular velocity moves by the bias of its row, the specific force stays."""
    found = measured(GyroscopeBias(), 2, bias_y=np.array([0.0, 0.5]))
    assert_allclose(found.angular_velocity, [[0.1, 0.2, 0.3], [0.1, 0.7, 0.3]], rtol=1e-14)
    assert_array_equal(found.specific_force, FORCE)


def test_a_sensor_beside_its_place_reads_the_point_that_carries_it() -> None:
    """On a steady turn about z the arm along x pulls inwards; spinning up, it pushes along y."""
    still, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 3.0]])
    effect = SensorPlace(offset_x=0.1)
    steady = effect.measure(Reading(up, still, still, up), params(effect)).specific_force
    assert_allclose(steady, [[-0.1 * 3.0**2, 0.0, 0.0]], rtol=1e-14)
    rising = effect.measure(Reading(still, still, up, still), params(effect))
    assert_allclose(rising.specific_force, [[0.0, 0.1 * 3.0, 0.0]], rtol=1e-14)
    assert_array_equal(rising.angular_velocity, still)


def test_the_effect_and_a_sensor_that_sits_there_read_the_same() -> None:
    """In a run, 0.1 m beside the stated place is a sensor whose place is 0.1 m away."""
    common = ["robot=box", "initial.angular_velocity=[2,3,-1]", "time.step=0.001"]
    silent = ["accelerometer_noise", "gyroscope_noise", "accelerometer_walk", "gyroscope_walk"]
    silent += ["accelerometer_step", "gyroscope_step"]
    common += [f"sensors.imu.{name}=0" for name in silent]
    common += ["+sensors.imu.rpy=[0.3,-0.2,0.5]"]
    turn = matrix_of(quaternion_of_rpy(np.array([[0.3, -0.2, 0.5]])))[0]
    place = turn @ np.array([0.1, -0.05, 0.02])
    there = seals.make([*common, f"+sensors.imu.position={place.tolist()}"])
    hidden = ["+effect@effects.place=sensor_place"]
    hidden += [
        f"effects.place.offset_{a}={v}" for a, v in zip("xyz", (0.1, -0.05, 0.02), strict=True)
    ]
    beside = seals.make([*common, *hidden])
    for world in (there, beside):
        for _ in range(40):
            world.step()
    one, other = (w.actors["robot"].sensor_suite.readings["imu"] for w in (there, beside))
    assert np.abs(one["specific_force"] - [0.0, 0.0, 0.0]).max() > 0.3
    for channel in ("specific_force", "angular_velocity"):
        assert_allclose(one[channel], other[channel], atol=1e-12)


def test_a_turned_sensor_sees_the_world_turned_back() -> None:
    """A sensor turned by a quarter about z reads body x as -y, in both readings."""
    found = measured(SensorMisalignment(rotation_z=0.5 * math.pi))
    # Exp(r)^T (x, y, z) = (y, -x, z)
    assert_allclose(found.specific_force, [[-2.0, -1.0, 9.0]] * 2, atol=1e-14)
    assert_allclose(found.angular_velocity, [[0.2, -0.1, 0.3]] * 2, atol=1e-14)


def test_a_small_turn_adds_a_cross_product() -> None:
    """To first order measured = true - r x true."""
    turn = np.array([1e-4, -2e-4, 3e-4])
    effect = SensorMisalignment(rotation_x=turn[0], rotation_y=turn[1], rotation_z=turn[2])
    found = measured(effect).specific_force
    assert_allclose(found, FORCE - np.cross(turn, FORCE), atol=1e-6)
    assert_allclose(np.linalg.norm(found, axis=1), np.linalg.norm(FORCE, axis=1), rtol=1e-14)


def test_a_large_turn_is_exact() -> None:
    """A third of a circle about the diagonal swaps the axes in a ring."""
    angle = 2.0 * math.pi / 3.0 / math.sqrt(3.0)
    found = measured(SensorMisalignment(rotation_x=angle, rotation_y=angle, rotation_z=angle))
    # Exp(r) sends x to y to z to x, its transpose (x, y, z) to (y, z, x)
    assert_allclose(found.specific_force, [[-2.0, 9.0, 1.0]] * 2, atol=1e-14)


def test_the_order_of_the_chain_is_stated() -> None:
    """Misalignment, then scale, then bias."""
    assert SensorMisalignment.order < AccelerometerScale.order < AccelerometerBias.order
    assert GyroscopeBias.order == AccelerometerBias.order


@pytest.mark.parametrize(
    ("effect", "field"),
    [
        (RotorLag(time_constant_change=0.03), "lag"),
        (CommandDelay(delay=0.03), "command_delay"),
        (SensorDelay(delay=0.03), "sensor_delay"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_late_thing_changes_its_own_timing_alone(effect: Any, field: str) -> None:
    """Each effect of timing sets one of the changes."""
    found: Timing = effect.timing(params(effect))
    assert_array_equal(getattr(found, field), [[0.03]])
    others = [name for name in Timing._fields if name != field]
    assert [float(np.ravel(getattr(found, name))[0]) for name in others] == [0.0, 0.0, 0.0]


def test_an_asymmetric_lag_delays_the_fall_and_hastens_the_rise() -> None:
    """Rotors of 40 ms with 10 ms more, uneven by 0.4: 46 ms up, 54 ms down."""
    late = RotorLag(time_constant_change=0.01, asymmetry=0.4)
    rotors = Rotors(position=[[0, 0, 0]], time_constant=[0.04])
    found = response_of(bind_effects({"rotors": rotors, "late": late}, ["base"]))
    assert_allclose([found.lag[0], found.fall[0]], [0.046, 0.054], rtol=1e-12)


def test_a_lag_whose_mean_keeps_has_no_asymmetry() -> None:
    """Nothing but a change of the time constant itself can be called a rotor lag."""
    found: Timing = RotorLag.timing(params(RotorLag(asymmetry=0.5)))
    assert [float(np.ravel(x)[0]) for x in found] == [0.0] * len(found)


def test_delays_of_a_batch_are_columns() -> None:
    """One delay a row."""
    found = SensorDelay.timing(params(SensorDelay(), 2, delay=np.array([0.0, 0.02])))
    assert_array_equal(found.sensor_delay, [[0.0], [0.02]])
