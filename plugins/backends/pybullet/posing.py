"""Link poses: read from PyBullet for moving links, composed from the parent's for fixed ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import matrix_of
from seals.multibody.tree import Tree
from seals.plugins.backends.pybullet.loading import Loaded


class Posing:
    """Reads the poses of all links.

    Asking the engine for a link costs more than composing its pose, so links that are fixed to
    others (cameras, finger-tips) are not asked for.

    Args:
        engine: the pybullet module.
        client: physics client.
        tree: of the robot.
        loaded: the robot in the engine.
    """

    def __init__(self, engine: Any, client: int, tree: Tree, loaded: Loaded) -> None:
        """Find the moving link that carries each link, and the link's pose on it."""
        self._p, self._client, self._body = engine, client, loaded.body
        moving = [k for k in range(1, tree.links) if tree.joint[k] >= 0]
        self._asked = [loaded.index[k] for k in moving]
        rows = {k: (row, np.zeros(3), np.eye(3)) for row, k in enumerate((0, *moving))}
        for k in range(1, tree.links):
            if k not in rows:
                row, offset, turn = rows[tree.parent[k]]
                rows[k] = (row, offset + turn @ tree.origin[k], turn @ tree.rotation[k])
        table = [rows[k] for k in range(tree.links)]
        self._row = np.array([row for row, _, _ in table])
        # attitude and place on the carrier as one matrix of four columns
        self._on = np.array([np.column_stack((turn, offset)) for _, offset, turn in table])
        self._all = len(moving) + 1 == tree.links
        self._centre, self._base_turn = loaded.base_centre, matrix_of(loaded.base_turn)[0]
        self._turned = bool(np.any(loaded.base_turn[0, :3]))

    def read(self) -> tuple[Floats, Floats]:
        """Return origins (L, 3) [m] and rotations (L, 3, 3) of all links."""
        p, client = self._p, self._client
        position, quaternion = p.getBasePositionAndOrientation(self._body, physicsClientId=client)
        table = [position + quaternion]
        if self._asked:
            states = p.getLinkStates(
                self._body, self._asked, computeForwardKinematics=1, physicsClientId=client
            )
            table += [s[4] + s[5] for s in states]
        both = np.array(table)
        places, turns = both[:, :3], matrix_of(both[:, 3:])
        # the engine tells centre and principal axes of the base
        if self._turned:
            turns[0] = turns[0] @ self._base_turn
        places[0] -= turns[0] @ self._centre
        if self._all:
            return places, turns
        both = turns.take(self._row, axis=0) @ self._on
        return places.take(self._row, axis=0) + both[:, :, 3], both[:, :, :3]


def turned(quaternion: tuple[float, ...], vector: list[float]) -> list[float]:
    """Return a quaternion (x y z w) rotated by a small rotation vector in world axes [rad]."""
    x, y, z, w = quaternion
    a, b, c = (0.5 * v for v in vector)
    # cos and sin(h)/h of the half angle h to fourth order: h is about 1e-5
    square = a * a + b * b + c * c
    d, scale = 1.0 - 0.5 * square, 1.0 - square / 6.0
    a, b, c = scale * a, scale * b, scale * c
    return [
        d * x + a * w + b * z - c * y,
        d * y + b * w + c * x - a * z,
        d * z + c * w + a * y - b * x,
        d * w - a * x - b * y - c * z,
    ]
