"""Rotations: algebra of quaternions and matrices, against SciPy and against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from seals.frames import (
    conjugate,
    cross,
    exponential,
    matrix_of,
    multiply,
    normalised,
    quaternion_of_rpy,
    quaternion_rate,
    rotate,
    rotation_vector,
    rpy_of,
    skew_last,
    unrotate,
)

ROWS = 50


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded random state."""
    return np.random.default_rng(4)


@pytest.fixture
def quaternions(rng: np.random.Generator) -> NDArray[np.float64]:
    """Random unit quaternions."""
    return normalised(rng.standard_normal((ROWS, 4)))


def test_matrices_match_an_independent_library(quaternions: NDArray[np.float64]) -> None:
    """Matrices of quaternions in the order x, y, z, w are those of SciPy."""
    expected = Rotation.from_quat(quaternions).as_matrix()
    np.testing.assert_allclose(matrix_of(quaternions), expected, atol=1e-14)


def test_products_compose_rotations(quaternions: NDArray[np.float64]) -> None:
    """The product p q turns by q first, then by p; the conjugate turns back."""
    p, q = quaternions, quaternions[::-1]
    both = np.matmul(matrix_of(p), matrix_of(q))
    np.testing.assert_allclose(matrix_of(multiply(p, q)), both, atol=1e-14)
    one = multiply(conjugate(p), p)
    np.testing.assert_allclose(one, np.tile([0.0, 0.0, 0.0, 1.0], (ROWS, 1)), atol=1e-15)


def test_vectors_turn_and_turn_back(
    quaternions: NDArray[np.float64], rng: np.random.Generator
) -> None:
    """R v is the matrix product, and R^T undoes it."""
    v, turn = rng.standard_normal((ROWS, 3)), matrix_of(quaternions)
    np.testing.assert_allclose(rotate(turn, v), np.einsum("nij,nj->ni", turn, v), atol=1e-14)
    np.testing.assert_allclose(unrotate(turn, rotate(turn, v)), v, atol=1e-14)


def test_cross_products(rng: np.random.Generator) -> None:
    """Cross products and their matrices are those of NumPy."""
    a, b = rng.standard_normal((2, ROWS, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-15)
    np.testing.assert_allclose(rotate(skew_last(a), b), np.cross(a, b), atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 4.9e-4, 5.1e-4, 1e-3, 0.3, 3.1])
def test_rotation_vectors_round_trip(angle: float, rng: np.random.Generator) -> None:
    """A rotation vector survives its quaternion, down to angles where a quotient loses digits."""
    axis = rng.standard_normal((ROWS, 3))
    vector = angle * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    turn = exponential(vector)
    np.testing.assert_allclose(np.linalg.norm(turn, axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(rotation_vector(turn), vector, atol=1e-14, rtol=1e-12)
    np.testing.assert_allclose(rotation_vector(-turn), vector, atol=1e-14, rtol=1e-12)


def test_roll_pitch_yaw_is_that_of_urdf(rng: np.random.Generator) -> None:
    """Roll, pitch, yaw turn about the fixed axes x, then y, then z."""
    rpy = rng.uniform(-3.0, 3.0, (ROWS, 3))
    expected = Rotation.from_euler("xyz", rpy).as_matrix()
    np.testing.assert_allclose(matrix_of(quaternion_of_rpy(rpy)), expected, atol=1e-14)


def test_roll_pitch_yaw_of_a_matrix_lead_back_to_it(rng: np.random.Generator) -> None:
    """Any rotation, those with a pitch of a right angle among them."""
    upright = np.array([[0.3, 0.5 * np.pi, 0.7], [0.3, -0.5 * np.pi, 0.7]])
    for turn in Rotation.from_euler("xyz", [*rng.uniform(-3.0, 3.0, (ROWS, 3)), *upright]):
        again = Rotation.from_euler("xyz", rpy_of(turn.as_matrix())).as_matrix()
        np.testing.assert_allclose(again, turn.as_matrix(), atol=1e-9)


def test_quaternion_rate_is_the_derivative(
    quaternions: NDArray[np.float64], rng: np.random.Generator
) -> None:
    """The rate for a body-axes angular velocity is the derivative of q exp(w t)."""
    w, h = rng.standard_normal((ROWS, 3)), 1e-6
    ahead, behind = (multiply(quaternions, exponential(s * h * w)) for s in (1.0, -1.0))
    slope = (ahead - behind) / (2.0 * h)
    np.testing.assert_allclose(quaternion_rate(quaternions, w), slope, atol=1e-9)
