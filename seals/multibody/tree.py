"""A tree of links joined by revolute and prismatic joints: structure and poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats, as_like, namespace
from seals.frames import SKEW


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
    def moves(self) -> Floats:
        """1 where a joint lies between the base and a link, shape (L, J)."""
        table = np.zeros((self.links, self.joints))
        for link in range(1, self.links):
            table[link] = table[self.parent[link]]
            if self.joint[link] >= 0:
                table[link, self.joint[link]] = 1.0
        return table

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
    xp = namespace(position)
    # the batch comes last in memory: a component over all robots is one contiguous vector
    places, turns = [xp.permute_dims(position, (1, 0))], [xp.permute_dims(rotation, (1, 2, 0))]
    for link in range(1, tree.links):
        up, j = tree.parent[link], tree.joint[link]
        offset, back = (
            as_like(x[link], position) for x in (tree.origin, tree.rotation.transpose(0, 2, 1))
        )
        place = places[up] + xp.matmul(offset, turns[up])
        # row i of R_up R is R^T times row i of R_up
        turn = xp.matmul(back, turns[up])
        if j >= 0 and tree.prismatic[j]:
            place = place + xp.matmul(as_like(tree.axis[j], position), turn) * joints[:, j]
        elif j >= 0:
            # Rodrigues' formula: R + sin(q) R K + (1 - cos(q)) R K K
            across = tree.axis[j] / np.linalg.norm(tree.axis[j]) @ SKEW
            across = as_like(across.reshape(3, 3).T, position)
            first = xp.matmul(across, turn)
            turn = turn + xp.sin(joints[:, j]) * first
            turn = turn + (1.0 - xp.cos(joints[:, j])) * xp.matmul(across, first)
        places.append(place)
        turns.append(turn)
    origins, rotations = xp.stack(places, axis=1), xp.stack(turns, axis=2)
    return xp.permute_dims(origins, (2, 1, 0)), xp.permute_dims(rotations, (3, 2, 0, 1))


def poses_in_base(tree: Tree, joints: Floats | None = None) -> tuple[Floats, Floats]:
    """Return origins (L, 3) [m] and rotations (L, 3, 3) of all links in base axes.

    Args:
        tree: the robot.
        joints: positions [rad or m], shape (J,); zero when left out.
    """
    at = np.zeros(tree.joints) if joints is None else joints
    origins, turns = forward(tree, np.zeros((1, 3)), np.eye(3)[None], at[None])
    return origins[0], turns[0]
