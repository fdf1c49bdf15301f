"""Velocities, Jacobian and bias of a single robot with revolute joints, optimised for speed.

The equations are those of `seals.multibody.kinematics`. A robot of ten links is so small that
a call of NumPy costs more than its arithmetic; here the cross products of all links and joints are
one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.frames import CROSS, SKEW
from seals.multibody.tree import Tree


class Single(NamedTuple):
    """Kinematics of a single robot, without the batch axis.

    Args:
        tree: the robot.
        rotations: R_WL, shape (L, 3, 3).
        axes: of the joints, world [1], shape (J, 3).
        levers: of the links, then of the joints, from the base origin, world [m], shape (L + J, 3).
    """

    tree: Tree
    rotations: Floats
    axes: Floats
    levers: Floats

    def move(self, speed: Floats) -> tuple[Floats, Floats]:
        """Return velocities in world axes, shape (L, 2, 3), and twists in link axes, (L, 6).

        Args:
            speed: generalised velocity, shape (n,).
        """
        tree, count = self.tree, self.tree.joints
        # spins of the joints and of the base; velocity of the base
        turning = np.zeros((count + 2, 3))
        np.multiply(self.axes, speed[-count:, None], out=turning[:count])
        if not tree.fixed_base:
            turning[count], turning[count + 1] = speed[3:6], speed[0:3]
        both = np.empty((tree.links, 2, 3))
        np.matmul(tree.spins, turning[: count + 1], out=both[:, 1])
        products = cross_rows(np.concatenate((both[:, 1], turning[:count])), self.levers)
        np.matmul(tree.sweep, np.concatenate((products, turning[count + 1 :])), out=both[:, 0])
        return both, self._in_links(both)

    def bias(self, speed: Floats, linear: Floats, angular: Floats) -> Floats:
        """Return the rate of the twists at zero generalised acceleration, shape (L, 6).

        Args:
            speed: generalised velocity, shape (n,).
            linear: velocities of the link origins, world axes [m/s], shape (L, 3).
            angular: world axes [rad/s], shape (L, 3).
        """
        tree, count = self.tree, self.tree.joints
        turning = self.axes * speed[-count:, None]
        change = cross_rows(angular.take(tree.parents, axis=0), turning)
        both = np.empty((tree.links, 2, 3))
        np.matmul(tree.moves, change, out=both[:, 1])
        products = cross_rows(
            np.concatenate((both[:, 1], change, turning, angular[:1])),
            np.concatenate((self.levers, linear.take(tree.children, axis=0), linear[:1])),
        )
        np.matmul(tree.drift, products, out=both[:, 0])
        return self._in_links(both)

    def jacobian(self) -> Floats:
        """Return the map from the generalised velocity to all twists, shape (L, 6, n)."""
        tree, lead = self.tree, 0 if self.tree.fixed_base else 6
        size = lead + tree.joints
        out = np.zeros((tree.links, 2, 3, size))
        upper, lower = out[:, 0], out[:, 1]
        # skew(-r) a = a x r
        across = (self.levers[: tree.links] @ -SKEW).reshape(-1, 3, 3)
        if lead:
            upper[:, :, :3] = lower[:, :, 3:6] = _EYE
            upper[:, :, 3:6] = across
        moves = tree.moves[:, None, :]
        np.multiply(self.axes.T, moves, out=lower[:, :, lead:])
        own = cross_rows(self.axes, self.levers[tree.links :]).T
        np.multiply(np.matmul(across, self.axes.T) - own, moves, out=upper[:, :, lead:])
        back = self.rotations.transpose(0, 2, 1)[:, None]
        turned: Floats = np.matmul(back, out).reshape(tree.links, 6, size)
        return turned

    def _in_links(self, both: Floats) -> Floats:
        """World vectors (L, 2, 3) in link axes, (L, 6)."""
        # a row times a rotation is the vector turned back into the link
        turned: Floats = np.matmul(both, self.rotations).reshape(-1, 6)
        return turned


_EYE = np.eye(3)


def cross_rows(a: Floats, b: Floats) -> Floats:
    """Return the cross products of rows, both (N, 3)."""
    product: Floats = (a[:, :, None] * b[:, None, :]).reshape(-1, 9) @ CROSS
    return product
