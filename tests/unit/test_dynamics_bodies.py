"""Equations of motion: conservation laws, closed forms, and the solver they use."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from seals.frames import cross, matrix_of, rotate
from seals.multibody.linear import solve_symmetric
from seals.multibody.spatial import kirchhoff, momentum, rigid_inertia
from seals.run import build_twin
from seals.run.build import run_settings


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded random state."""
    return np.random.default_rng(8)


def positive(rng: np.random.Generator, rows: int, size: int = 6) -> np.ndarray:
    """Random symmetric positive definite matrices."""
    half = rng.standard_normal((rows, size, size))
    square: np.ndarray = np.matmul(half, np.swapaxes(half, 1, 2))
    return square + size * np.eye(size)


def test_the_solver_is_that_of_numpy(rng: np.random.Generator) -> None:
    """Full symmetric systems have the solution of numpy.linalg.solve."""
    matrix, right = positive(rng, 20), rng.standard_normal((20, 6))
    lower = [[matrix[:, i, j] for j in range(i + 1)] for i in range(6)]
    found = np.stack(solve_symmetric(lower, list(right.T)), axis=1)
    expected = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_the_solver_understands_zeros_and_shared_entries(rng: np.random.Generator) -> None:
    """None stands for zero, a vector of one entry for the whole batch."""
    matrix, right = positive(rng, 5), rng.standard_normal((5, 6))
    matrix[:] = matrix[:1]
    for i, j in itertools.product((0, 1, 2), (4, 5)):
        matrix[:, i, j] = matrix[:, j, i] = 0.0
    lower = [
        [None if matrix[0, i, j] == 0.0 else matrix[:1, i, j] for j in range(i + 1)]
        for i in range(6)
    ]
    found = np.stack(solve_symmetric(lower, list(right.T)), axis=1)
    expected = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_velocity_terms_do_no_work(rng: np.random.Generator) -> None:
    """For any symmetric inertia the Kirchhoff terms leave kinetic energy unchanged."""
    matrix, (v, w) = positive(rng, 30), rng.standard_normal((2, 30, 3))
    force, torque = kirchhoff(matrix, v, w)
    power = np.sum(force * v + torque * w, axis=1)
    size = np.abs(force * v).sum(axis=1) + np.abs(torque * w).sum(axis=1)
    assert np.abs(power / size).max() < 1e-14


def test_kirchhoff_terms_of_a_rigid_body(rng: np.random.Generator) -> None:
    """They are those of Newton and Euler: m w x (v + w x c) about an origin off the centre."""
    centre, (v, w) = np.array([0.1, -0.2, 0.05]), rng.standard_normal((2, 4, 3))
    inertia = np.diag([0.2, 0.3, 0.4])
    force, torque = kirchhoff(rigid_inertia(2.0, centre, inertia)[None], v, w)
    arm = np.tile(centre, (4, 1))
    newton = 2.0 * np.cross(w, v + np.cross(w, arm))
    euler = np.cross(w, w @ inertia) + np.cross(arm, newton)
    np.testing.assert_allclose(force, newton, atol=1e-13)
    np.testing.assert_allclose(torque, euler, atol=1e-13)


def test_free_motion_keeps_energy_and_momentum() -> None:
    """1 s of a turning body with added inertia in still water conserves energy; RK4 at 2 ms."""
    options = ["robot=box", "water=fossen", "environment.gravity=0", "initial.position=[0,0,-30]"]
    quiet = ["water_drag", "spin_drag"]
    zeros = [f"effects.{e}.coefficient_{a}=0" for e in quiet for a in "xyz"]
    moving = ["initial.velocity=[0.8,0.3,-0.2]", "initial.angular_velocity=[2,1,-3]"]
    twin, state = build_twin(run_settings([*options, *zeros, *moving]))
    added = np.diag([1.1, 1.9, 5.0, 0.01, 0.025, 0.008])
    inertia = (twin.robot.spatial_inertia[0] + added)[None]

    def invariants(s: object) -> tuple[float, np.ndarray]:
        linear, angular = momentum(inertia, s.velocity, s.angular_velocity)  # type: ignore[attr-defined]
        energy = 0.5 * np.sum(linear * s.velocity + angular * s.angular_velocity)  # type: ignore[attr-defined]
        return float(energy), rotate(matrix_of(s.quaternion), linear)  # type: ignore[attr-defined]

    before = invariants(state)
    for k in range(500):
        state, _ = twin.step(state, 0.002 * k, 0.002)
    after = invariants(state)
    assert after[0] == pytest.approx(before[0], rel=1e-9)
    np.testing.assert_allclose(after[1], before[1], rtol=1e-8, atol=1e-8)


@pytest.mark.thorough
def test_a_pendulum_swings_at_the_period_of_the_closed_form() -> None:
    """T = 2 pi sqrt((I + m l^2) / (m g l)) (1 + a^2 / 16) for the amplitude a = 0.02 rad."""
    run = run_settings(["robot=pendulum", "initial.joint_position=[0.02]"])
    twin, state = build_twin(run)
    length, mass, inertia = 0.153153, 0.1, 1e-6
    square = (inertia + mass * length**2) / (mass * 9.81 * length)
    expected = 2.0 * math.pi * math.sqrt(square) * (1.0 + 0.02**2 / 16.0)
    step, times, before = 0.002, [], 0.02
    for k in range(2000):
        state, _ = twin.step(state, k * step, step)
        angle = float(state.joints[0, 0])
        if before > 0.0 >= angle:
            times.append(step * (k + before / (before - angle)))
        before = angle
    found = (times[-1] - times[0]) / (len(times) - 1)
    # the crossing is interpolated linearly: within (w h)^2 / 8 of a step
    assert found == pytest.approx(expected, rel=1e-6)


def test_a_twin_in_torch_is_the_twin_in_numpy() -> None:
    """The arm with all its effects moves alike in both libraries, within 1e-10 in 0.1 s."""
    torch = pytest.importorskip("torch")
    options = ["robot=free_arm", "water=fossen", "initial.position=[0,0,0.02]"]
    moving = ["initial.velocity=[0.5,0.2,-0.1]", "initial.joint_velocity=[1,-2]"]
    run = run_settings([*options, *moving])
    ends = []
    for like in (np.zeros(1), torch.zeros(1, dtype=torch.float64)):
        twin, state = build_twin(run, batch=2, like=like)
        for k in range(25):
            state, _ = twin.step(state, k * 0.004, 0.004)
        ends.append([np.asarray(x) for x in state])
    for a, b in zip(*ends, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-10)


def test_cross_terms_vanish_at_the_centre(rng: np.random.Generator) -> None:
    """About the centre of mass linear and angular momentum are uncoupled."""
    v, w = rng.standard_normal((2, 3, 3))
    matrix = rigid_inertia(2.0, np.zeros(3), np.diag([0.2, 0.3, 0.4]))[None]
    linear, angular = momentum(matrix, v, w)
    np.testing.assert_allclose(linear, 2.0 * v, atol=1e-15)
    np.testing.assert_allclose(cross(w, angular), np.cross(w, w * [0.2, 0.3, 0.4]), atol=1e-14)
