"""The ROV of the BlueROV2 Heavy kind: published figures from its files, and its course."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from seals.control.plant import build_plant
from seals.effects import bind_effects
from seals.run import build_twin
from seals.run.build import run_settings
from seals.run.simulation import simulate

MASS = np.array([13.5, 13.5, 13.5, 0.26, 0.23, 0.37])
ADDED = np.array([6.36, 7.12, 18.68, 0.189, 0.135, 0.222])
LINEAR = np.array([13.7, 0.0, 33.0, 0.0, 0.8, 0.0])
SQUARE = np.array([141.0, 217.0, 190.0, 1.19, 0.47, 1.5])
"""Table A1 of von Benzon et al. 2022, J. Mar. Sci. Eng. 10(12), 1898, as robots/rov/README.md."""
G, RHO, VOLUME, RISE, FULL = 9.81, 1000.0, 0.0134, 0.01, 30.4


def start(*options: str) -> np.ndarray:
    """Return the acceleration at the start, 3 m under water, body axes [m/s^2, rad/s^2]."""
    overrides = ["robot=rov", "water=fossen", "initial.position=[0,0,-3]"]
    run = run_settings([*overrides, f"environment.water_density={RHO}", *options])
    twin, state = build_twin(run)
    rates = twin.rates(state, 0.0)
    return np.concatenate((rates.velocity[0], rates.angular_velocity[0]))


@pytest.mark.parametrize("axis", range(6))
def test_drag_and_masses_are_the_published_ones(axis: int) -> None:
    """(M + M_A) a = -(D_l + D_n |v|) v along each axis, at two speeds, beside the trim at rest."""
    rest = start()
    for speed in (0.3, -1.1):
        given = [0.0] * 3
        given[axis % 3] = speed
        key = "velocity" if axis < 3 else "angular_velocity"
        found = start(f"initial.{key}=[{given[0]},{given[1]},{given[2]}]") - rest
        drag = -(LINEAR[axis] + SQUARE[axis] * abs(speed)) * speed
        assert found[axis] == pytest.approx(drag / (MASS[axis] + ADDED[axis]), rel=1e-9)
        others = np.delete(found, axis)
        np.testing.assert_allclose(others, 0.0, atol=1e-9)


def test_it_sinks_slowly_and_rights_itself() -> None:
    """(rho V - m) g along z; -rho V g z_b sin a about x and y, z_b 10 mm."""
    assert start()[2] == pytest.approx((RHO * VOLUME - 13.5) * G / (13.5 + 18.68), rel=1e-9)
    for axis, lean in ((3, "[0.2,0,0]"), (4, "[0,0.2,0]")):
        righting = -RHO * VOLUME * G * RISE * math.sin(0.2) / (MASS[axis] + ADDED[axis])
        assert start(f"initial.rpy={lean}")[axis] == pytest.approx(righting, rel=1e-9)


def test_the_thrusters_push_and_turn_with_the_published_forces() -> None:
    """Rank 6; 86 N ahead and aside, 122 N up, and the arms of 0.189, 0.218 and 0.12 m."""
    run = run_settings(["robot=rov", "water=fossen"])
    twin, _ = build_twin(run)
    effects = bind_effects({**run.effects, **run.actuators}, twin.robot.links)
    layout = build_plant(twin.robot, effects, run.environment).layout
    np.testing.assert_allclose(layout.limit, FULL)
    b = np.concatenate((layout.axis.T, np.cross(layout.position, layout.axis).T))
    assert np.linalg.matrix_rank(b) == 6
    most = FULL * np.abs(b).sum(axis=1)
    slant = math.sqrt(0.5)
    lying = 4.0 * FULL * slant
    # thrusters aslant lie 85 mm below the middle, and so push and turn at once
    roll, pitch = 4.0 * FULL * 0.218 + lying * 0.085, 4.0 * FULL * 0.12 + lying * 0.085
    yaw = 4.0 * FULL * slant * (0.156 + 0.111)
    np.testing.assert_allclose(most, [lying, lying, 4.0 * FULL, roll, pitch, yaw], rtol=1e-6)
    # thrusters ahead on both sides alone turn nothing but pitch
    ahead = b[:, 2] + b[:, 3] - b[:, 0] - b[:, 1]
    np.testing.assert_allclose(ahead, [4.0 * slant, 0, 0, 0, -0.34 * slant, 0], atol=1e-7)


def off_the_square(position: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distances of points from the legs between corners [m]."""
    found = np.full(len(position), np.inf)
    for a, b in itertools.pairwise(corners):
        share = np.clip((position - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        foot = a + share[:, None] * (b - a)
        found = np.minimum(found, np.linalg.norm(position - foot, axis=1))
    return found


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["pybullet", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_the_course_in_a_gusty_current_is_held_within_ten_centimetres(engine: str) -> None:
    """A square at 0.15 m/s in 0.5 m/s with gusts, by a noisy odometry, from a start at rest."""
    run = run_settings(["experiment=rov_course", f"backend={engine}", "time.step=0.01",
                        "controller.rate=100", "guide.rate=100"])  # fmt: skip
    record = simulate(run)
    assert record.error is None
    corners = np.array([[0.0, 0.0, -5.0], *run.guide.places])
    away = off_the_square(record.log.channel("position"), corners)
    print(f"{engine}: off the course by at most {100 * away.max():.1f} cm")
    assert away.max() < 0.1
