"""Velocities, Jacobians and velocity-product accelerations of all links of a tree at given poses.

Arrays are ordered (batch, links, ...) outside. Inside the batch comes last: a component over the
whole batch is one contiguous vector, so that no time goes into thousands of products of three rows
each. The generalised velocity is [velocity of the base origin,
angular velocity of the base, joint rates], the first two in world axes; a fixed base has only the
joint rates. Effects order rows link by link, the equations of motion (batch, links).
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, as_like, index_on, namespace
from seals.frames import CROSS, MANY, cross_last, skew_last
from seals.motion import Body, Motion
from seals.multibody.tree import Tree
from seals.state_records import state_record

if TYPE_CHECKING:
    from seals.multibody.equations import KeptTerms


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
        turn: R_WL, shape (3, 3, L, B).
        arm: link origins relative to that of the base, world [m], shape (3, L, B).
        hinges: joint axes, world [1], shape (3, J, B).
        anchors: places of the joints relative to the base origin, world [m], shape (3, J, B).
        many: whether there are so many robots on NumPy that composite bodies are worth it.
        kept: terms of the equations of motion at these poses, where there are many.
    """

    tree: Tree
    origins: Array
    rotations: Array
    many: bool

    def __init__(self, tree: Tree, origins: Array, rotations: Array) -> None:
        self.tree, self.origins, self.rotations = tree, origins, rotations
        self._lead = 0 if tree.fixed_base else 6
        self._kept_bias: tuple[LinkVelocities, Array] | None = None
        self._sliding = tree.sliding
        self.many = bool(tree.joints) and type(origins) is np.ndarray and len(origins) >= MANY
        self.kept: KeptTerms | None = None

    @cached_property
    def turn(self) -> Array:
        """Rotations of the links, shape (3, 3, L, B)."""
        return _contiguous(namespace(self.rotations).permute_dims(self.rotations, (2, 3, 1, 0)))

    @cached_property
    def arm(self) -> Array:
        """Link origins relative to that of the base, shape (3, L, B)."""
        return _contiguous(_turned_over(self.origins - self.origins[:, :1]))

    @cached_property
    def hinges(self) -> Array:
        """Joint axes, shape (3, J, B)."""
        axis = as_like(self.tree.axis.T[:, :, None], self.origins)
        return turned(_taken(self.turn, self.tree.children, 2), axis)

    @cached_property
    def anchors(self) -> Array:
        """Places of the joints, shape (3, J, B)."""
        return _taken(self.arm, self.tree.children, 1)

    @cached_property
    def axes(self) -> Array:
        """Joint axes, world [1], shape (B, J, 3)."""
        return _turned_over(self.hinges)

    @cached_property
    def _back(self) -> Array:
        """Rotations of the world in link axes, shape (B, L, 3, 3)."""
        return namespace(self.rotations).permute_dims(_contiguous(self.rotations), (0, 1, 3, 2))

    @cached_property
    def _arm(self) -> Array:
        """Link origins relative to the base origin, shape (B, L, 3)."""
        return _contiguous(_turned_over(self.arm))

    @cached_property
    def jacobian(self) -> Array:
        """Map from the generalised velocity to all twists in link axes, shape (B, L, 6, n)."""
        xp = namespace(self.origins)
        if type(self._arm) is np.ndarray and self._lead and self.tree.joints:
            return self._filled_jacobian()
        upper, lower = [], []
        if self._lead:
            zero = self._arm[:, :, :, None] * as_like(np.zeros((1, 3)), self._arm)
            eye = zero + as_like(_EYE, self._arm)
            # of the base: V = v + w x r = v - r x w, W = w
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
        # products of small matrices, one by one, want the batch first in memory
        axes, anchors = (_contiguous(_turned_over(x)) for x in (self.hinges, self.anchors))
        arm = self._arm[:, :, None, :] - anchors[:, None, :, :]
        angular = axes[:, None] * as_like(tree.moves[:, :, None], arm)
        # a hinge gives V = a x (p - s) and W = a to all links beyond it, a slide V = a alone
        linear = cross_last(angular, arm)
        if self._sliding:
            slides = as_like(tree.slides, arm)
            linear, angular = linear * (1.0 - slides) + angular * slides, angular * (1.0 - slides)
        return xp.permute_dims(linear, (0, 1, 3, 2)), xp.permute_dims(angular, (0, 1, 3, 2))

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
        xp, tree = namespace(speed), self.tree
        rates = xp.permute_dims(speed, (1, 0))
        slide, angular = None, self.arm * 0.0
        if tree.joints:
            moves = as_like(tree.moves, speed)
            turning, slide = self._split(self.hinges * rates[self._lead :])
            angular = xp.matmul(moves, turning)
        if self._lead:
            angular += rates[3:6, None]
        linear = crossed(angular, self.arm)
        if tree.joints:
            linear -= xp.matmul(moves, crossed(turning, self.anchors))
        if slide is not None:
            linear += xp.matmul(moves, slide)
        if self._lead:
            linear += rates[0:3, None]
        found = (_turned_over(x) for x in (linear, angular, self._in_links(linear, angular)))
        return LinkVelocities(speed, *found)

    def _split(self, rates: Array) -> tuple[Array, Array | None]:
        """Split vectors along the joints into revolute and prismatic parts, (3, J, B)."""
        if not self._sliding:
            return rates, None
        slides = as_like(self.tree.slides, rates)
        return rates * (1.0 - slides), rates * slides

    def _in_links(self, linear: Array, angular: Array) -> Array:
        """World vectors of all links, each (3, L, B), as [linear, angular] in link axes."""
        xp = namespace(linear)
        back = xp.permute_dims(self.turn, (1, 0, 2, 3))
        return xp.concat((turned(back, linear), turned(back, angular)), axis=0)

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
        xp, tree = namespace(moving.speed), self.tree
        rates = xp.permute_dims(moving.speed, (1, 0))
        linear = angular = self.arm * 0.0
        if tree.joints:
            moves = as_like(tree.moves, rates)
            velocity, spin = _turned_over(moving.linear), _turned_over(moving.angular)
            turning = self.hinges * rates[self._lead :]
            # the child's rate differs by a q' along the axis itself, which crosses to zero
            change, slide = self._split(crossed(_taken(spin, tree.parents, 1), turning))
            inner = crossed(change, self.anchors)
            turning, _ = self._split(turning)
            # d/dt of a q' x s: the joint itself moves, with the link that it carries
            inner += crossed(turning, _taken(velocity, tree.children, 1))
            angular = xp.matmul(moves, change)
            linear = crossed(angular, self.arm)
            linear -= xp.matmul(moves, inner)
            if slide is not None:
                linear += xp.matmul(moves, slide)
        if self._lead:
            # the base's own acceleration is taken in world axes, the twist in those of the link
            linear = linear - crossed(rates[3:6], rates[0:3])[:, None]
        return _turned_over(self._in_links(linear, angular))


def turned(turn: Array, vectors: Array) -> Array:
    """Products of matrices (3, 3, L, B) and vectors (3, L, 1 or B), shape (3, L, B)."""
    out = turn[:, 0] * vectors[0]
    out += turn[:, 1] * vectors[1]
    out += turn[:, 2] * vectors[2]
    return out


def crossed(a: Array, b: Array) -> Array:
    """Cross product over the first axis, shapes (3, ...) that broadcast."""
    if type(a) is np.ndarray and max(a.size, b.size) >= 3 * MANY:
        out = np.empty(np.broadcast_shapes(a.shape, b.shape))
        for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            np.multiply(a[i], b[j], out=out[k])
            out[k] -= a[j] * b[i]
        return out
    outer = a[:, None] * b[None]
    if type(outer) is np.ndarray:
        # few robots: all nine products at once, then one small matrix product
        return (CROSS.T @ outer.reshape(9, -1)).reshape(3, *outer.shape[2:])
    parts = [a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return namespace(a).stack(parts, axis=0)


def _turned_over(x: Array) -> Array:
    """Return an array of three axes with their order reversed."""
    return namespace(x).permute_dims(x, (2, 1, 0))


def _contiguous(x: Array) -> Array:
    return np.ascontiguousarray(x) if type(x) is np.ndarray else x


def _taken(x: Array, index: NDArray[np.int64], axis: int) -> Array:
    """Entries of some links along an axis."""
    if type(x) is np.ndarray:
        return x.take(index, axis=axis)
    xp = namespace(x)
    return xp.take(x, xp.asarray(index, device=getattr(x, "device", None)), axis=axis)


Bundle = TypeVar("Bundle", bound=NamedTuple)
"""Arrays of rows that belong together."""


def link_motion(
    kinematics: Kinematics, moving: LinkVelocities, time: Array, bodies: Body
) -> Motion:
    """Motion of all links, rows link by link.

    Args:
        kinematics: poses (B, L, ...).
        moving: velocities of the links.
        time: [s], shape (1, 1) or (B, 1).
        bodies: constant properties, rows link by link.
    """
    rotation = by_link(kinematics.rotations)
    rows = by_link(moving.twists)
    # one instant for all, or one for each robot: then once for each link
    if time.shape[0] > 1:
        time = namespace(time).concat([time] * (rows.shape[0] // time.shape[0]), axis=0)
    return Motion(
        time=time,
        position=by_link(kinematics.origins),
        rotation=rotation,
        up=rotation[:, 2, :],
        velocity=rows[:, :3],
        angular_velocity=rows[:, 3:],
        body=bodies,
    )


def by_link(x: Array) -> Array:
    """Reorder (B, L, ...) into rows link by link, (L B, ...)."""
    if x.shape[0] == 1:
        return x[0]
    xp = namespace(x)
    order = (1, 0, *range(2, x.ndim))
    return xp.reshape(xp.permute_dims(x, order), (x.shape[0] * x.shape[1], *x.shape[2:]))


def by_batch(x: Array, links: int) -> Array:
    """Reorder rows link by link (L B, ...) into (B, L, ...)."""
    if x.shape[0] == links:
        # as many rows as links are one robot, whatever the batch that it came from
        return x[None]
    xp = namespace(x)
    shaped = xp.reshape(x, (links, x.shape[0] // links, *x.shape[1:]))
    return xp.permute_dims(shaped, (1, 0, *range(2, shaped.ndim)))


def take(bundle: Bundle, rows: Any) -> Bundle:
    """Select rows of every field; fields with a single row are kept."""
    if rows is None:
        return bundle
    return type(bundle)._make(picked(bundle, rows))


def take_motion(motion: Motion, rows: Any) -> Motion:
    """Select rows of a motion and of its body."""
    if rows is None:
        return motion
    return Motion._make((*picked(motion[:-1], rows), take(motion.body, rows)))


def picked(fields: tuple[Array, ...], rows: Any) -> list[Array]:
    """Select rows of several fields; fields with a single row are kept."""
    if type(fields[0]) is np.ndarray:
        return [x if x is None or x.shape[0] == 1 else x[rows] for x in fields]
    return [_pick(x, rows) for x in fields]


def _pick(x: Array, rows: Any) -> Array:
    if x is None or x.shape[0] == 1:
        return x
    if isinstance(rows, slice):
        return x[rows]
    return namespace(x).take(x, index_on(rows, x), axis=0)
