"""Poses, velocities and bias of many robots of one tree on NumPy, the batch last.

The equations are those of `seals.multibody.kinematics`. A component over the whole batch is one
contiguous vector here, so that no time goes into thousands of products of three rows each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from seals.arrays import Array, Floats
from seals.frames import MANY, SKEW

if TYPE_CHECKING:
    from seals.multibody.tree import Tree


class Many(NamedTuple):
    """Poses of many robots.

    Args:
        tree: the robot.
        turn: R_WL, shape (3, 3, L, B).
        arm: link origins relative to that of the base, world [m], shape (3, L, B).
        axes: of the joints, world [1], shape (3, J, B).
    """

    tree: Tree
    turn: Floats
    arm: Floats
    axes: Floats

    @classmethod
    def of(cls, tree: Tree, origins: Floats, rotations: Floats) -> Many:
        """Return the form of poses with the batch first, (B, L, 3) and (B, L, 3, 3)."""
        turn = np.ascontiguousarray(rotations.transpose(2, 3, 1, 0))
        arm = np.ascontiguousarray((origins - origins[:, :1]).transpose(2, 1, 0))
        axes = [tree.axis[j] @ turn[:, :, link] for j, link in enumerate(tree.child)]
        return cls(tree, turn, arm, np.stack(axes, axis=1))

    @property
    def anchors(self) -> Floats:
        """Places of the joints relative to the base origin, world [m], shape (3, J, B)."""
        return self.arm[:, self.tree.children]

    def turned(self, vectors: Floats) -> Floats:
        """Vectors in link axes, (3, L, 1 or B), in world axes, (3, L, B)."""
        turn = self.turn
        out: Floats = turn[:, 0] * vectors[0]
        out += turn[:, 1] * vectors[1]
        out += turn[:, 2] * vectors[2]
        return out

    def in_links(self, linear: Floats, angular: Floats) -> Floats:
        """World vectors of all links, each (3, L, B), as [linear, angular] in link axes."""
        turn, out = self.turn, np.empty((6, *linear.shape[1:]))
        for vectors, at in ((linear, slice(3)), (angular, slice(3, 6))):
            np.multiply(turn[0], vectors[0], out=out[at])
            out[at] += turn[1] * vectors[1]
            out[at] += turn[2] * vectors[2]
        return out

    def move(self, speed: Floats) -> tuple[Floats, Floats, Floats]:
        """Velocities of the links in world axes, each (3, L, B), and twists in link axes.

        Args:
            speed: generalised velocity, shape (n, B).
        """
        tree = self.tree
        turning, slide = self._split(self.axes * speed[-tree.joints :])
        angular = np.matmul(tree.moves, turning)
        if not tree.fixed_base:
            angular += speed[3:6, None]
        linear = crossed(angular, self.arm)
        linear -= np.matmul(tree.moves, crossed(turning, self.anchors))
        if slide is not None:
            linear += np.matmul(tree.moves, slide)
        if not tree.fixed_base:
            linear += speed[0:3, None]
        return linear, angular, self.in_links(linear, angular)

    def bias(self, speed: Floats, linear: Floats, angular: Floats) -> Floats:
        """Rate of the twists at zero generalised acceleration, link axes, shape (6, L, B).

        Args:
            speed: generalised velocity, shape (n, B).
            linear: velocities of the link origins, world axes [m/s], shape (3, L, B).
            angular: world axes [rad/s], shape (3, L, B).
        """
        tree = self.tree
        turning = self.axes * speed[-tree.joints :]
        change, slide = self._split(crossed(angular[:, tree.parents], turning))
        turning, _ = self._split(turning)
        inner = crossed(change, self.anchors)
        inner += crossed(turning, linear[:, tree.children])
        spin = np.matmul(tree.moves, change)
        rise = crossed(spin, self.arm)
        rise -= np.matmul(tree.moves, inner)
        if not tree.fixed_base:
            rise -= crossed(speed[3:6], speed[0:3])[:, None]
        if slide is not None:
            rise += np.matmul(tree.moves, slide)
        return self.in_links(rise, spin)

    def _split(self, rates: Floats) -> tuple[Floats, Floats | None]:
        """Split vectors along the joints into revolute and prismatic parts, (3, J, B)."""
        if not self.tree.sliding:
            return rates, None
        return rates * (1.0 - self.tree.slides), rates * self.tree.slides


def is_many(values: Array) -> bool:
    """Return true for NumPy arrays with so many rows that the batch is best last."""
    return type(values) is np.ndarray and len(values) >= MANY


def poses(tree: Tree, position: Floats, rotation: Floats, joints: Floats) -> tuple[Floats, Floats]:
    """Poses of all links, see `seals.multibody.tree.forward`; in memory the batch comes last."""
    turn = np.empty((3, 3, tree.links, len(position)))
    place = np.empty((3, tree.links, len(position)))
    turn[:, :, 0], place[:, 0] = rotation.transpose(1, 2, 0), position.T
    for link in range(1, tree.links):
        up, j = tree.parent[link], tree.joint[link]
        place[:, link] = place[:, up] + tree.origin[link] @ turn[:, :, up]
        own = np.matmul(tree.rotation[link].T, turn[:, :, up])
        if j >= 0 and tree.prismatic[j]:
            place[:, link] += (tree.axis[j] @ own) * joints[:, j]
        elif j >= 0:
            across = (tree.axis[j] / np.linalg.norm(tree.axis[j]) @ SKEW).reshape(3, 3)
            first = np.matmul(across.T, own)
            second = np.matmul(across.T, first)
            own += np.sin(joints[:, j]) * first
            own += (1.0 - np.cos(joints[:, j])) * second
        turn[:, :, link] = own
    return place.transpose(2, 1, 0), turn.transpose(3, 2, 0, 1)


def crossed(a: Floats, b: Floats) -> Floats:
    """Cross product over the first axis, shapes (3, ...) that broadcast."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.multiply(a[i], b[j], out=out[k])
        out[k] -= a[j] * b[i]
    return out
