"""Velocities, Jacobians and velocity-product accelerations of all links of a tree at given poses.

Arrays are ordered (batch, links, ...). The generalised velocity is [velocity of the base origin,
angular velocity of the base, joint rates], the first two in world axes; a fixed base has only the
joint rates.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, as_like, namespace
from seals.frames import cross_last, skew_last
from seals.multibody.kept_terms import KeptTerms
from seals.multibody.many import Many, is_many
from seals.multibody.tree import Tree
from seals.state_records import state_record

_EYE = np.eye(3)


@state_record
class LinkVelocities(NamedTuple):
    """Velocities of all links.

    Args:
        speed: generalised velocity, shape (B, n).
        linear: of the link origins, world axes [m/s], shape (B, L, 3).
        angular: world axes [rad/s], shape (B, L, 3).
        twists: [linear, angular] at the link origins, link axes, shape (B, L, 6).
    """

    speed: Array
    linear: Array
    angular: Array
    twists: Array


class Kinematics:
    """Velocities and accelerations of the links at given poses.

    Args:
        tree: the robot.
        origins: link origins, world [m], shape (B, L, 3).
        rotations: R_WL, shape (B, L, 3, 3).

    Attributes:
        jacobian: map from the generalised velocity to the twists of all links in link axes, shape
            (B, L, 6, n).
        many: the same poses with the batch last, where there are many on NumPy; else None.
        kept: terms of the equations of motion at these poses, where there are many.
    """

    def __init__(self, tree: Tree, origins: Array, rotations: Array) -> None:
        self.tree, self.origins, self.rotations = tree, origins, rotations
        self._lead = 0 if tree.fixed_base else 6
        self._kept_bias: tuple[LinkVelocities, Array] | None = None
        self._sliding = tree.sliding
        self.many: Many | None = None
        self.kept: KeptTerms | None = None
        if tree.joints and is_many(origins):
            self.many = Many.of(tree, origins, rotations)

    @cached_property
    def _back(self) -> Array:
        """Rotations of the world in link axes, shape (B, L, 3, 3)."""
        return namespace(self.rotations).permute_dims(self.rotations, (0, 1, 3, 2))

    @cached_property
    def _arm(self) -> Array:
        """Link origins relative to the base origin, shape (B, L, 3)."""
        return self.origins - self.origins[:, :1, :]

    @cached_property
    def axes(self) -> Array:
        """Joint axes, world [1], shape (B, J, 3)."""
        if self.many is not None:
            return self.many.axes.transpose(2, 1, 0)
        turned = self._of_links(self.rotations, self.tree.children)
        columns = as_like(self.tree.axis_columns, self.origins)
        return namespace(turned).matmul(turned, columns)[:, :, :, 0]

    @cached_property
    def _anchors(self) -> Array:
        """Places of the joints relative to the base origin, shape (B, J, 3)."""
        return self._of_links(self._arm, self.tree.children)

    def _base_blocks(self) -> tuple[Array, Array]:
        """Identity and zero for every link, (B, L, 3, 3)."""
        zero = self._arm[:, :, :, None] * as_like(np.zeros((1, 3)), self._arm)
        return zero + as_like(_EYE, self._arm), zero

    @cached_property
    def jacobian(self) -> Array:
        """Map from the generalised velocity to all twists in link axes, shape (B, L, 6, n)."""
        xp = namespace(self.origins)
        if type(self._arm) is np.ndarray and self._lead and self.tree.joints:
            return self._filled_jacobian()
        upper, lower = [], []
        if self._lead:
            eye, zero = self._base_blocks()
            upper += [eye, skew_last(-self._arm)]
            lower += [zero, eye]
        if self.tree.joints:
            linear, angular = self._joint_columns()
            upper.append(linear)
            lower.append(angular)
        if not upper:
            # a base bolted to the world, without joints, has no coordinate
            return as_like(np.zeros((*self.origins.shape[:2], 6, 0)), self.origins)
        turned = xp.matmul(self._back, xp.concat((*upper, *lower), axis=3))
        size = turned.shape[3] // 2
        return xp.concat((turned[:, :, :, :size], turned[:, :, :, size:]), axis=2)

    def _filled_jacobian(self) -> Array:
        """The same on NumPy, without products by the identity and zeros of the base."""
        if self.many is not None:
            # products of small matrices, one by one, want the batch first in memory
            self._arm, self.axes = (np.ascontiguousarray(x) for x in (self._arm, self.axes))
            self._back = np.ascontiguousarray(self.rotations).transpose(0, 1, 3, 2)
        linear, angular = self._joint_columns()
        first, joints = self._lead, self.tree.joints
        world = np.concatenate((skew_last(-self._arm), linear, angular), axis=3)
        turned = np.matmul(self._back, world)
        out = np.zeros((*self._arm.shape[:2], 6, first + joints))
        out[:, :, :3, :3] = out[:, :, 3:, 3:6] = self._back
        out[:, :, :3, 3:] = turned[:, :, :, : 3 + joints]
        out[:, :, 3:, first:] = turned[:, :, :, 3 + joints :]
        return out

    def _joint_columns(self) -> tuple[Array, Array]:
        """Linear and angular world-axes columns of the joints, each (B, L, 3, J)."""
        xp, tree = namespace(self.origins), self.tree
        arm = self._arm[:, :, None, :] - self._anchors[:, None, :, :]
        angular = self.axes[:, None] * as_like(tree.moves[:, :, None], arm)
        linear = cross_last(angular, arm)
        if self._sliding:
            slides = as_like(tree.slides, arm)
            linear, angular = linear * (1.0 - slides) + angular * slides, angular * (1.0 - slides)
        return xp.permute_dims(linear, (0, 1, 3, 2)), xp.permute_dims(angular, (0, 1, 3, 2))

    def _of_links(self, values: Array, links: NDArray[np.int64]) -> Array:
        """Values (B, L, ...) of some links."""
        if type(values) is np.ndarray:
            return values.take(links, axis=1)
        xp = namespace(values)
        return xp.take(values, xp.asarray(links, device=getattr(values, "device", None)), axis=1)

    def twists(self, speed: Array) -> Array:
        """Return the twists of all links for a generalised velocity (B, n), shape (B, L, 6).

        Order [linear, angular], link axes.
        """
        return namespace(speed).matmul(self.jacobian, speed[:, None, :, None])[:, :, :, 0]

    def move(self, speed: Array) -> LinkVelocities:
        """Return the velocities of all links for a generalised velocity (B, n).

        Equation:
            W = w + sum a_j q_j', V = v + W x r - sum (a_j q_j') x s_j over the joints between the
            base and the link; a sliding joint adds a_j q_j' to V only.
        """
        xp, tree, lead = namespace(speed), self.tree, self._lead
        if self.many is not None:
            found = (x.transpose(2, 1, 0) for x in self.many.move(speed.T))
            return LinkVelocities(speed, *found)
        base = speed[:, None, :]
        if not tree.joints:
            angular = base[:, :, 3:6] + self._arm * 0.0 if lead else self._arm * 0.0
            linear = cross_last(angular, self._arm)
        else:
            turning, slide = self.axes * speed[:, lead:, None], None
            moves = as_like(tree.moves, speed)
            if self._sliding:
                slides = as_like(tree.slides, speed)
                slide, turning = turning * slides, turning * (1.0 - slides)
            angular = xp.matmul(moves, turning)
            if lead:
                angular = angular + base[:, :, 3:6]
            linear = cross_last(angular, self._arm)
            linear = linear - xp.matmul(moves, cross_last(turning, self._anchors))
            if slide is not None:
                linear = linear + xp.matmul(moves, slide)
        if lead:
            linear = linear + base[:, :, 0:3]
        twists = self._in_links(linear[:, :, :, None], angular[:, :, :, None])
        return LinkVelocities(speed, linear, angular, twists)

    def _in_links(self, linear: Array, angular: Array) -> Array:
        """World vectors of all links (B, L, 3, 1) as [linear, angular] in link axes, (B, L, 6)."""
        xp = namespace(linear)
        both = xp.matmul(self._back, xp.concat((linear, angular), axis=3))
        return xp.concat((both[:, :, :, 0], both[:, :, :, 1]), axis=2)

    def bias(self, moving: LinkVelocities) -> Array:
        """Return the rate of the twists at zero generalised acceleration, shape (B, L, 6).

        The rate is taken in link axes.

        Equation:
            With W, V the link velocities, a_j the joint axes, s_j their anchors and
            alpha_j = W_parent x a_j q_j':
            angular = sum alpha_j;
            linear = (sum alpha_j) x r - sum (alpha_j x s_j + a_j q_j' x V_child) - w x v of the
            base; a sliding joint adds alpha_j to linear only. The term W x V of the world
            acceleration cancels against the change of the link axes.
        """
        kept = self._kept_bias
        if kept is None or kept[0] is not moving:
            kept = self._kept_bias = (moving, self._bias(moving))
        return kept[1]

    def _bias(self, moving: LinkVelocities) -> Array:
        lead = self._lead
        if self.many is not None:
            parts = (x.T for x in (moving.speed, moving.linear, moving.angular))
            return self.many.bias(*parts).transpose(2, 1, 0)
        if self.tree.joints:
            linear, angular = self._joint_bias(moving, moving.speed[:, lead:])
        elif lead:
            base = moving.speed[:, None, :]
            angular = moving.linear * 0.0
            linear = angular - cross_last(base[:, :, 3:6], base[:, :, 0:3])
        else:
            return moving.twists * 0.0
        return self._in_links(linear[:, :, :, None], angular[:, :, :, None])

    def _joint_bias(self, moving: LinkVelocities, rates: Array) -> tuple[Array, Array]:
        """Contribution of the joints to the bias accelerations, world axes, each (B, L, 3)."""
        xp, tree = namespace(rates), self.tree
        turning = self.axes * rates[:, :, None]
        change = cross_last(self._of_links(moving.angular, tree.parents), turning)
        slide = None
        if self._sliding:
            slides = as_like(tree.slides, rates)
            slide, change, turning = (
                change * slides,
                change * (1.0 - slides),
                turning * (1.0 - slides),
            )
        moves = as_like(tree.moves, rates)
        angular = xp.matmul(moves, change)
        anchors = self._anchors if change.shape[0] == 1 else self._anchors + change * 0.0
        # one cross product for three sums; the last row is w x v of the base
        spin, velocity = moving.angular[:, :1] * 0.0, moving.linear[:, :1]
        if self._lead:
            spin = moving.speed[:, None, 3:6]
        inner = cross_last(
            xp.concat((change, turning, spin), axis=1),
            xp.concat((anchors, self._of_links(moving.linear, tree.children), velocity), axis=1),
        )
        linear = cross_last(angular, self._arm) - xp.matmul(as_like(tree.moves_twice, rates), inner)
        return (linear if slide is None else linear + xp.matmul(moves, slide)), angular
