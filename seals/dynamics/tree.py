"""A tree of links joined by revolute and prismatic joints: structure, kinematics, equations of motion.

Arrays are ordered (batch, links, ...). The generalised velocity is [velocity of the base origin, angular velocity
of the base, joint rates], the first two in world axes; a fixed base has only the joint rates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace


@dataclass(frozen=True, kw_only=True)
class Tree:
    """Structure of a robot: links in an order in which parents come first; link 0 is the base.

    Args:
        parent: parent of each link, -1 for the base, shape (L,).
        joint: index of the movable joint above each link, -1 for none, shape (L,).
        prismatic: whether each joint slides, shape (J,).
        axis: joint axes in the frame of the child link [1], shape (J, 3).
        origin: of each link in its parent at joint zero [m], shape (L, 3).
        rotation: of each link in its parent at joint zero, shape (L, 3, 3).
        fixed_base: whether the base is bolted to the world.
    """

    parent: tuple[int, ...]
    joint: tuple[int, ...]
    prismatic: tuple[bool, ...]
    axis: Floats
    origin: Floats
    rotation: Floats
    fixed_base: bool

    @property
    def links(self) -> int:
        """Number of links."""
        return len(self.parent)

    @property
    def joints(self) -> int:
        """Number of movable joints."""
        return len(self.prismatic)

    @cached_property
    def child(self) -> tuple[int, ...]:
        """Link below each joint."""
        return tuple(self.joint.index(j) for j in range(self.joints))

    @cached_property
    def moves(self) -> Floats:
        """1 where a joint lies between the base and a link, shape (L, J)."""
        table = np.zeros((self.links, self.joints))
        for link in range(1, self.links):
            table[link] = table[self.parent[link]]
            if self.joint[link] >= 0:
                table[link, self.joint[link]] = 1.0
        return table


def forward(tree: Tree, position: Array, rotation: Array, joints: Array) -> tuple[Array, Array]:
    """Poses of all links from the base pose and the joint coordinates.

    Args:
        tree: the robot.
        position: base origin, world [m], shape (B, 3).
        rotation: R_WB of the base, shape (B, 3, 3).
        joints: joint coordinates [rad or m], shape (B, J).

    Returns:
        Origins (B, L, 3) [m] and rotations (B, L, 3, 3) of all links.
    """
    xp = namespace(position)
    origins, rotations = [position], [rotation]
    for link in range(1, tree.links):
        up, j = tree.parent[link], tree.joint[link]
        offset = as_like(tree.origin[link], position)
        turn = xp.matmul(rotations[up], as_like(tree.rotation[link], position))
        place = origins[up] + xp.matmul(rotations[up], offset[:, None])[:, :, 0]
        if j >= 0:
            axis = as_like(tree.axis[j], position)
            q = joints[:, j : j + 1]
            if tree.prismatic[j]:
                place = place + xp.matmul(turn, axis[:, None])[:, :, 0] * q
            else:
                turn = xp.matmul(turn, _axis_rotation(tree.axis[j], q))
        origins.append(place)
        rotations.append(turn)
    return xp.stack(origins, axis=1), xp.stack(rotations, axis=1)


def _axis_rotation(axis: Floats, angle: Array) -> Array:
    """Rodrigues' formula about a fixed axis, angle (B, 1), result (B, 3, 3)."""
    xp = namespace(angle)
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    eye, first, second = (as_like(m, angle)[None] for m in (np.eye(3), k, k @ k))
    a = angle[:, :, None]
    return eye + xp.sin(a) * first + (1.0 - xp.cos(a)) * second


class Kinematics:
    """Jacobians of all links at given poses, and the accelerations that come from velocity alone.

    Args:
        tree: the robot.
        origins: link origins, world [m], shape (B, L, 3).
        rotations: R_WL, shape (B, L, 3, 3).

    Attributes:
        jacobian: maps the generalised velocity to the twist [linear, angular] of every link at its origin in link
            axes, shape (B, L, 6, n).
    """

    def __init__(self, tree: Tree, origins: Array, rotations: Array) -> None:
        """Assemble the Jacobian."""
        xp = namespace(origins)
        self.tree, self.origins, self.rotations = tree, origins, rotations
        batch = origins.shape[0]
        self._transposed = xp.permute_dims(rotations, (0, 1, 3, 2))
        blocks = []
        if not tree.fixed_base:
            arm = origins - origins[:, :1, :]
            eye = xp.broadcast_to(as_like(np.eye(3), origins), (batch, tree.links, 3, 3))
            zero = as_like(np.zeros((1, 1, 3, 3)), origins) * rotations
            blocks.append(xp.concat((eye, zero), axis=2))
            blocks.append(xp.concat((-_skew(arm), eye), axis=2))
        if tree.joints:
            blocks.append(self._joint_columns())
        world = xp.concat(blocks, axis=3) if len(blocks) > 1 else blocks[0]
        linear = xp.matmul(self._transposed, world[:, :, :3, :])
        angular = xp.matmul(self._transposed, world[:, :, 3:, :])
        self.jacobian = xp.concat((linear, angular), axis=2)

    def _joint_columns(self) -> Array:
        """World-axes columns of the joints, shape (B, L, 6, J)."""
        xp, tree, like = namespace(self.origins), self.tree, self.origins
        children = xp.asarray(np.asarray(tree.child), device=getattr(like, "device", None))
        turned = xp.take(self.rotations, children, axis=1)
        self.axes = xp.matmul(turned, as_like(tree.axis, like)[None, :, :, None])[:, :, :, 0]
        self.anchors = xp.take(self.origins, children, axis=1)
        self._moves = as_like(tree.moves, like)[None, :, :, None]
        slides = np.asarray(tree.prismatic, dtype=float)[None, None, :, None]
        self._slides, self._turns = as_like(slides, like), as_like(1.0 - slides, like)
        arm = self.origins[:, :, None, :] - self.anchors[:, None, :, :]
        linear = (_cross(self.axes[:, None], arm) * self._turns + self.axes[:, None] * self._slides) * self._moves
        angular = self.axes[:, None] * self._turns * self._moves
        return xp.permute_dims(xp.concat((linear, angular), axis=3), (0, 1, 3, 2))

    def twists(self, velocity: Array) -> Array:
        """Twists [linear, angular] of all links in link axes for a generalised velocity (B, n): (B, L, 6)."""
        xp = namespace(velocity)
        return xp.matmul(self.jacobian, velocity[:, None, :, None])[:, :, :, 0]

    def bias(self, velocity: Array, twists: Array) -> Array:
        """Link-axes rate of the twists when the generalised acceleration is zero, shape (B, L, 6).

        Args:
            velocity: generalised velocity, shape (B, n).
            twists: of the links at that velocity, shape (B, L, 6).
        """
        xp, tree = namespace(velocity), self.tree
        v, w = twists[:, :, :3], twists[:, :, 3:]
        lead = 0 if tree.fixed_base else 6
        linear, angular = None, None
        if tree.joints:
            world_v = xp.matmul(self.rotations, v[:, :, :, None])[:, :, :, 0]
            world_w = xp.matmul(self.rotations, w[:, :, :, None])[:, :, :, 0]
            linear, angular = self._joint_bias(velocity[:, lead:], world_v, world_w)
            if lead:
                linear = linear + _cross(velocity[:, None, 3:6], world_v - velocity[:, None, :3])
            linear = xp.matmul(self._transposed, linear[:, :, :, None])[:, :, :, 0] - _cross(w, v)
            angular = xp.matmul(self._transposed, angular[:, :, :, None])[:, :, :, 0]
        else:
            linear, angular = -_cross(w, v), v * 0.0
        return xp.concat((linear, angular), axis=2)

    def _joint_bias(self, rates: Array, world_v: Array, world_w: Array) -> tuple[Array, Array]:
        """Joint part of the velocity-product accelerations, world axes, each (B, L, 3)."""
        xp, tree = namespace(rates), self.tree
        device = getattr(rates, "device", None)
        children = xp.asarray(np.asarray(tree.child), device=device)
        parents = xp.asarray(np.asarray([tree.parent[c] for c in tree.child]), device=device)
        speed = rates[:, :, None]
        turning = _cross(xp.take(world_w, parents, axis=1), self.axes) * speed
        anchor_v = xp.take(world_v, children, axis=1)
        arm = self.origins[:, :, None, :] - self.anchors[:, None, :, :]
        drift = world_v[:, :, None, :] - anchor_v[:, None, :, :]
        swing = _cross(turning[:, None], arm) + _cross((self.axes * speed)[:, None], drift)
        linear = swing * self._turns + turning[:, None] * self._slides
        angular = turning[:, None] * self._turns * self._moves
        return xp.sum(linear * self._moves, axis=2), xp.sum(angular, axis=2)


def _skew(v: Array) -> Array:
    """Cross-product matrices over the last axis."""
    xp = namespace(v)
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    o = x * 0.0
    return xp.stack((xp.stack((o, -z, y), axis=-1), xp.stack((z, o, -x), axis=-1), xp.stack((-y, x, o), axis=-1)), axis=-2)


def _cross(a: Array, b: Array) -> Array:
    """Cross product over the last axis."""
    xp = namespace(a)
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return xp.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)
