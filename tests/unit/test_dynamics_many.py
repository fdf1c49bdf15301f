"""Many robots in one array against the same robots one by one."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from seals.frames import MANY, matrix_of, normalised
from seals.motion import Wrench
from seals.multibody.equations import Assembly
from seals.multibody.kinematics import Kinematics, link_motion
from seals.multibody.linear import Factors, LeadFactors
from seals.multibody.spatial import rigid_inertia
from seals.multibody.tree import Tree, forward
from tests.unit.test_dynamics_kinematics import Floats, random_tree

SHOWN = (0, 7, MANY - 1)
"""Robots that are compared."""


class Fleet:
    """Many robots of one tree at random places and speeds."""

    def __init__(self, tree: Tree, rng: np.random.Generator) -> None:
        """Draw them."""
        self.tree, size = tree, tree.joints + (0 if tree.fixed_base else 6)
        self.place = rng.standard_normal((MANY, 3))
        self.turn = matrix_of(normalised(rng.standard_normal((MANY, 4))))
        self.joints = rng.standard_normal((MANY, tree.joints))
        self.speed = rng.standard_normal((MANY, size))

    def kinematics(self, rows: slice) -> Kinematics:
        """Kinematics of some of them."""
        poses = forward(self.tree, self.place[rows], self.turn[rows], self.joints[rows])
        return Kinematics(self.tree, *poses)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers of each test."""
    return np.random.default_rng(5)


@pytest.fixture(params=[False, True], ids=["free", "bolted"])
def fleet(request: pytest.FixtureRequest, rng: np.random.Generator) -> Fleet:
    """Robots of two branches, joints turning, sliding and rigid."""
    return Fleet(random_tree(rng, fixed_base=request.param), rng)


def test_many_robots_move_like_each_of_them(fleet: Fleet) -> None:
    """Poses, velocities, bias and Jacobian are those of the robot alone."""
    together = fleet.kinematics(slice(None))
    moving = together.move(fleet.speed)
    assert together.many
    for k in SHOWN:
        alone = fleet.kinematics(slice(k, k + 1))
        assert not alone.many
        moved = alone.move(fleet.speed[k : k + 1])
        pairs = (
            (together.origins, alone.origins),
            (together.rotations, alone.rotations),
            (together.axes, alone.axes),
            (moving.linear, moved.linear),
            (moving.angular, moved.angular),
            (moving.twists, moved.twists),
            (together.bias(moving), alone.bias(moved)),
            (together.jacobian, alone.jacobian),
        )
        for many, one in pairs:
            np.testing.assert_allclose(many[k], one[0], atol=1e-12)


@pytest.mark.parametrize("each", [False, True], ids=["equal", "own inertias"])
def test_composite_bodies_give_the_equations_of_the_jacobian(
    fleet: Fleet, rng: np.random.Generator, *, each: bool
) -> None:
    """Generalised inertia and force are those of the robot alone, drives included."""
    links, joints = fleet.tree.links, fleet.tree.joints
    inertia = np.array([_inertias(rng, links) for _ in range(MANY if each else 1)])
    drives, torque = rng.uniform(0.1, 1.0, joints), rng.standard_normal((MANY, joints))
    force, lift = rng.standard_normal((links, MANY, 3)), rng.standard_normal((MANY, 3))

    def equations(rows: slice) -> tuple[Floats, Floats]:
        own = inertia[rows] if each else inertia
        kinematics = fleet.kinematics(rows)
        moving = kinematics.move(fleet.speed[rows])
        motion = link_motion(kinematics, moving, np.zeros((1, 1)), SimpleNamespace())
        count = len(fleet.speed[rows])
        everywhere = Wrench(force[:, rows].reshape(-1, 3), 0.5 * force[:, rows].reshape(-1, 3))
        second = slice(2 * count, 3 * count)
        loads = [(None, None, everywhere), (None, second, Wrench(lift[rows], None))]
        found = SimpleNamespace(loads=loads, inertias=[])
        return Assembly(own, drives).equations(kinematics, moving, motion, found, torque[rows])

    matrix, right = equations(slice(None))
    for k in SHOWN:
        one, alone = equations(slice(k, k + 1))
        np.testing.assert_allclose(matrix[k], one[0], rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(right[k], alone[0], rtol=1e-11, atol=1e-10)


@pytest.mark.parametrize("link", [0, 2], ids=["base", "another link"])
@pytest.mark.parametrize("moved", [False, True], ids=["same speed", "other speed"])
def test_terms_kept_at_known_poses_give_what_is_computed_afresh(
    fleet: Fleet, rng: np.random.Generator, *, link: int, moved: bool
) -> None:
    """One inertia after another at the same poses: each gives its own equations."""
    links, joints = fleet.tree.links, fleet.tree.joints
    inertia = np.array([_inertias(rng, links)])
    heavier = inertia.copy()
    heavier[0, link] += _inertias(rng, 1)[0]
    drives, torque = rng.uniform(0.1, 1.0, joints), rng.standard_normal((MANY, joints))
    found = SimpleNamespace(loads=[], inertias=[])
    known = fleet.kinematics(slice(None))

    def equations(own: Floats, kinematics: Kinematics, speed: Floats) -> tuple[Floats, Floats]:
        moving = moving_at if speed is fleet.speed and kinematics is known else None
        moving = kinematics.move(speed) if moving is None else moving
        motion = link_motion(kinematics, moving, np.zeros((1, 1)), SimpleNamespace())
        return Assembly(own, drives).equations(kinematics, moving, motion, found, torque)

    moving_at = known.move(fleet.speed)
    speed = 2.0 * fleet.speed if moved else fleet.speed
    first = equations(inertia, known, fleet.speed)
    second, third = equations(heavier, known, speed), equations(inertia, known, fleet.speed)
    fresh = equations(heavier, fleet.kinematics(slice(None)), speed)
    for one, other in zip(second, fresh, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-10)
    for one, other in zip(first, third, strict=True):
        np.testing.assert_array_equal(one, other)
    # a base that is bolted down weighs on nothing
    assert (np.abs(second[0] - first[0]).max() > 1e-3) == (link > 0 or not fleet.tree.fixed_base)


def test_inertias_of_no_rigid_body_are_left_to_the_jacobian(rng: np.random.Generator) -> None:
    """A matrix with unequal masses along its axes gives the equations of the robot alone, too."""
    fleet = Fleet(random_tree(rng, fixed_base=False), rng)
    inertia = np.array([_inertias(rng, fleet.tree.links)])
    inertia[0, 3, 1, 1] *= 2.0
    found = SimpleNamespace(loads=[], inertias=[])

    def matrix(rows: slice) -> Floats:
        kinematics, still = fleet.kinematics(rows), np.zeros_like(fleet.joints[rows])
        moving = kinematics.move(fleet.speed[rows])
        motion = link_motion(kinematics, moving, np.zeros((1, 1)), SimpleNamespace())
        return Assembly(inertia).equations(kinematics, moving, motion, found, still)[0]

    np.testing.assert_allclose(matrix(slice(None))[7], matrix(slice(7, 8))[0], atol=1e-11)


@pytest.mark.parametrize("definite", [True, False])
def test_factors_solve_like_numpy(rng: np.random.Generator, *, definite: bool) -> None:
    """One right side or several, also where a matrix is not positive definite."""
    root = rng.standard_normal((40, 6, 6))
    matrix = np.matmul(root, root.transpose(0, 2, 1)) + np.eye(6)
    matrix[3] *= 1.0 if definite else -1.0
    factors, right = Factors(matrix), rng.standard_normal((40, 6, 3))
    np.testing.assert_allclose(factors.solve(right), np.linalg.solve(matrix, right), rtol=1e-9)
    one = np.linalg.solve(matrix, right[:, :, :1])[:, :, 0]
    np.testing.assert_allclose(factors.solve(right[:, :, 0]), one, rtol=1e-9)


def test_factors_outlast_a_change_of_the_leading_block(rng: np.random.Generator) -> None:
    """Right sides of one column or several are solved as by the whole matrix afresh."""
    root, own = rng.standard_normal((40, 9, 9)), rng.standard_normal((40, 6, 6))
    matrix = np.matmul(root, root.transpose(0, 2, 1)) + np.eye(9)
    change = np.matmul(own, own.transpose(0, 2, 1))
    whole, right = matrix.copy(), rng.standard_normal((40, 9, 3))
    whole[:, :6, :6] += change
    factors = LeadFactors(matrix, 6).changed(change)
    np.testing.assert_allclose(factors.solve(right), np.linalg.solve(whole, right), rtol=1e-8)
    one = np.linalg.solve(whole, right[:, :, :1])[:, :, 0]
    np.testing.assert_allclose(factors.solve(right[:, :, 0]), one, rtol=1e-8)
    with pytest.raises(np.linalg.LinAlgError):
        LeadFactors(-matrix, 6)


def _inertias(rng: np.random.Generator, links: int) -> list[Floats]:
    """Inertias of rigid links with their centres beside their origins."""
    roots = rng.standard_normal((links, 3, 3))
    return [rigid_inertia(rng.uniform(0.1, 2.0), rng.standard_normal(3), a @ a.T) for a in roots]
