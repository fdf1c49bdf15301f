"""A tree of links joined by revolute and prismatic joints: structure and poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats, as_like, namespace
from seals.multibody.many import is_many, poses


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
        drive_inertia: inertia of each joint's drive about the joint [kg m^2 or kg], shape (J,);
            empty for none.
    """

    parent: tuple[int, ...]
    joint: tuple[int, ...]
    prismatic: tuple[bool, ...]
    axis: Floats
    origin: Floats
    rotation: Floats
    fixed_base: bool
    drive_inertia: tuple[float, ...] = ()

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
    def children(self) -> NDArray[np.int64]:
        """`child` as an array, shape (J,)."""
        return np.array(self.child, dtype=np.int64)

    @cached_property
    def axis_columns(self) -> Floats:
        """Joint axes as columns, shape (J, 3, 1)."""
        return np.ascontiguousarray(self.axis[:, :, None])

    @cached_property
    def moves(self) -> Floats:
        """1 where a joint lies between the base and a link, shape (L, J)."""
        table = np.zeros((self.links, self.joints))
        for link in range(1, self.links):
            table[link] = table[self.parent[link]]
            if self.joint[link] >= 0:
                table[link, self.joint[link]] = 1.0
        return table

    @cached_property
    def moves_twice(self) -> Floats:
        """Matrix [moves, moves, base], base column 1 for a free base, shape (L, 2 J + 1)."""
        base = np.full((self.links, 1), 0.0 if self.fixed_base else 1.0)
        return np.concatenate((self.moves, self.moves, base), axis=1)

    @cached_property
    def parents(self) -> NDArray[np.int64]:
        """Link above each joint, shape (J,)."""
        return np.array([self.parent[link] for link in self.child], dtype=np.int64)

    @cached_property
    def sliding(self) -> bool:
        """Return whether any joint is prismatic."""
        return any(self.prismatic)

    @cached_property
    def slides(self) -> Floats:
        """1 for a prismatic joint, 0 for a revolute one, shape (J, 1)."""
        return np.asarray(self.prismatic, dtype=float).reshape(-1, 1)


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
    if is_many(position):
        return poses(tree, position, rotation, joints)
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
