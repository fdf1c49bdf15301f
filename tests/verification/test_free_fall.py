"""Free fall and free rotation: nothing but gravity acts, and nothing hidden damps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from tests.verification.conftest import Bench

G = 9.81
ENGINES = ["world", "twin"]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("step", [0.001, 0.004])
def test_a_thrown_body_follows_its_parabola(bench: Bench, engine: str, step: float) -> None:
    """Position and velocity of a thrown body are those of the closed form."""
    robot = bench.body(0.7, (0.002, 0.003, 0.004))
    start, throw = np.array([1.0, -2.0, 30.0]), np.array([3.0, 1.0, 2.0])
    run = bench.run(
        engine, bench.settings(robot, step=step, duration=2.0, position=start, velocity=throw)
    )
    t = run.time[:, None]
    # x = x0 + v0 t - g t^2 e_z / 2. Both schemes are exact for a constant acceleration, so what
    # remains is rounding: one unit in the last place of 30 m (2^-48 m) at each of up to 2,000
    # steps.
    tolerance = len(run.time) * 2.0**-48
    down = np.array([0.0, 0.0, G])
    np.testing.assert_allclose(
        run.position, start + throw * t - 0.5 * down * t * t, rtol=0, atol=tolerance
    )
    np.testing.assert_allclose(run.velocity, throw - down * t, rtol=0, atol=tolerance)


def test_two_seconds_of_free_fall_reach_19_62_metres_a_second(bench: Bench) -> None:
    """No hidden damping slows a falling robot, its moving links included."""
    arm = bench.link("arm", 0.2, (3e-4, 3e-4, 4e-5), centre=(0, 0, -0.1))
    joint = (
        '<joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/>'
        '<origin xyz="0 0 -0.05"/><axis xyz="0 1 0"/></joint>'
    )
    robot = bench.robot(bench.link("base", 1.0, (0.01, 0.01, 0.01)), arm, joint)
    run = bench.run("world", bench.settings(robot, step=0.004, duration=2.0))
    # v = g t, exact for a constant acceleration; rounding of 500 steps at 20 m/s (2^-48 each)
    assert run.velocity[-1, 2] == pytest.approx(-19.62, abs=500 * 2.0**-48)


def test_a_rotor_spins_on(bench: Bench) -> None:
    """A balanced rotor on a free body keeps its speed: no joint damping, no hidden motor."""
    rotor = bench.link("rotor", 0.1, (1e-4, 1e-4, 2e-4))
    joint = (
        '<joint name="axle" type="continuous"><parent link="base"/><child link="rotor"/>'
        '<origin xyz="0 0 0.05"/><axis xyz="0 0 1"/></joint>'
    )
    robot = bench.robot(bench.link("base", 1.0, (0.01, 0.01, 0.02)), rotor, joint)
    settings = bench.settings(
        robot, step=0.004, duration=2.0, joint_velocity=[40.0], angular_velocity=[0, 0, 1.5]
    )
    run = bench.run("world", settings)
    # coaxial and torque-free: both rates are constant; rounding of 500 steps at 40 rad/s (2^-47
    # each)
    np.testing.assert_allclose(run.joint_velocity[:, 0], 40.0, rtol=0, atol=500 * 2.0**-47)
    np.testing.assert_allclose(
        run.angular_velocity, np.tile([0, 0, 1.5], (501, 1)), rtol=0, atol=500 * 2.0**-47
    )
