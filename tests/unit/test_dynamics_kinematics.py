"""Kinematics of a random tree, joints turning, sliding and fixed, against finite differences."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.frames import exponential, matrix_of, multiply, normalised
from seals.multibody.kinematics import Kinematics, link_motion
from seals.multibody.tree import Tree, forward

Floats = NDArray[np.float64]
BATCH, H = 3, 1e-5


def random_tree(rng: np.random.Generator, *, fixed_base: bool) -> Tree:
    """Two branches of seven links: five joints, one of them sliding, and one rigid connection."""
    axis = rng.standard_normal((5, 3))
    turns = normalised(rng.standard_normal((7, 4)))
    return Tree(
        parent=(-1, 0, 1, 2, 1, 0, 5),
        joint=(-1, 0, 1, -1, 2, 3, 4),
        prismatic=(False, False, True, False, False),
        axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        origin=rng.standard_normal((7, 3)),
        rotation=matrix_of(turns),
        fixed_base=fixed_base,
    )


class Pose:
    """A batch of configurations that can be moved along a generalised velocity."""

    def __init__(self, tree: Tree, rng: np.random.Generator) -> None:
        """Draw configurations."""
        self.tree = tree
        self.position = rng.standard_normal((BATCH, 3))
        self.turn = normalised(rng.standard_normal((BATCH, 4)))
        self.joints = rng.standard_normal((BATCH, tree.joints))

    def moved(self, speed: Floats, time: float) -> Kinematics:
        """Kinematics after moving for a time at constant generalised velocity, world axes."""
        lead = 0 if self.tree.fixed_base else 6
        position, turn = self.position, self.turn
        if lead:
            position = position + time * speed[:, :3]
            turn = multiply(exponential(time * speed[:, 3:6]), turn)
        joints = self.joints + time * speed[:, lead:]
        return Kinematics(self.tree, *forward(self.tree, position, matrix_of(turn), joints))


@pytest.fixture(params=[False, True], ids=["free", "bolted"])
def case(request: pytest.FixtureRequest) -> tuple[Pose, Floats]:
    """A random pose and a random generalised velocity."""
    rng = np.random.default_rng(12)
    tree = random_tree(rng, fixed_base=request.param)
    size = tree.joints + (0 if request.param else 6)
    return Pose(tree, rng), rng.standard_normal((BATCH, size))


def numeric_twists(pose: Pose, speed: Floats) -> Floats:
    """Twists in link axes from differences of poses."""
    ahead, behind, now = (pose.moved(speed, t) for t in (H, -H, 0.0))
    back = np.swapaxes(now.rotations, 2, 3)
    linear = np.einsum("blij,blj->bli", back, (ahead.origins - behind.origins) / (2.0 * H))
    turn = np.matmul(np.swapaxes(behind.rotations, 2, 3), ahead.rotations)
    odd = (turn - np.swapaxes(turn, 2, 3)) / (4.0 * H)
    angular = np.stack([odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1)
    return np.concatenate((linear, angular), axis=2)


def test_the_jacobian_maps_speeds_to_twists(case: tuple[Pose, Floats]) -> None:
    """Every column of the Jacobian, and the sum over all, are the differences of the poses."""
    pose, speed = case
    now = pose.moved(speed, 0.0)
    np.testing.assert_allclose(now.move(speed).twists, numeric_twists(pose, speed), atol=1e-8)
    for k in range(speed.shape[1]):
        unit = np.zeros_like(speed)
        unit[:, k] = 1.0
        np.testing.assert_allclose(
            now.jacobian[..., k], numeric_twists(pose, unit), atol=1e-8, err_msg=f"column {k}"
        )


def test_the_bias_is_the_rate_of_the_twists(case: tuple[Pose, Floats]) -> None:
    """At constant generalised velocity the twists, in link axes, change at the rate of the bias."""
    pose, speed = case
    ahead, behind = (pose.moved(speed, t).move(speed).twists for t in (H, -H))
    now = pose.moved(speed, 0.0)
    np.testing.assert_allclose(now.bias(now.move(speed)), (ahead - behind) / (2.0 * H), atol=1e-8)


def test_a_turning_joint_turns_its_child_only(case: tuple[Pose, Floats]) -> None:
    """Moving one joint by an angle turns the links behind it by that angle and no other link."""
    pose, speed = case
    still = np.zeros_like(speed)
    unit = still.copy()
    unit[:, speed.shape[1] - pose.tree.joints] = 1.0
    before, after = pose.moved(still, 0.0), pose.moved(unit, 0.4)
    change = np.matmul(np.swapaxes(before.rotations, 2, 3), after.rotations)
    angle = np.arccos(np.clip((np.trace(change, axis1=2, axis2=3) - 1.0) / 2.0, -1.0, 1.0))
    behind = np.array([0, 1, 1, 1, 1, 0, 0], dtype=float)
    np.testing.assert_allclose(angle, np.tile(0.4 * behind, (BATCH, 1)), atol=1e-7)


@pytest.mark.parametrize("fixed_base", [False, True], ids=["free", "bolted"])
def test_one_robot_moves_like_a_batch(fixed_base: bool) -> None:
    """Velocities, bias and Jacobian of one robot with turning joints are those of a batch's row."""
    rng = np.random.default_rng(5)
    tree = replace(random_tree(rng, fixed_base=fixed_base), prismatic=(False,) * 5)
    pose = Pose(tree, rng)
    speed = rng.standard_normal((BATCH, tree.joints + (0 if fixed_base else 6)))
    all_rows = pose.moved(speed, 0.0)
    moving = all_rows.move(speed)
    bias = all_rows.bias(moving)
    for row in range(BATCH):
        rows = slice(row, row + 1)
        one = Kinematics(tree, all_rows.origins[rows], all_rows.rotations[rows])
        own = one.move(speed[rows])
        for a, b in zip(own, moving, strict=True):
            np.testing.assert_allclose(a, b[rows], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(one.bias(own), bias[rows], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(one.jacobian, all_rows.jacobian[rows], rtol=0.0, atol=1e-13)


def test_times_of_a_batch_repeat_for_every_link() -> None:
    """Rows run link by link: each of two links has the times of all three bodies."""
    poses: Any = SimpleNamespace(
        rotations=np.tile(np.eye(3), (3, 2, 1, 1)), origins=np.zeros((3, 2, 3))
    )
    moving: Any = SimpleNamespace(twists=np.zeros((3, 2, 6)))
    bodies: Any = None
    time = np.array([[0.1], [0.2], [0.3]])
    found = link_motion(poses, moving, time, bodies).time
    np.testing.assert_array_equal(found[:, 0], [0.1, 0.2, 0.3, 0.1, 0.2, 0.3])
    assert link_motion(poses, moving, time[:1], bodies).time.shape == (1, 1)
