"""Link poses: composed from the centres of mass that PyBullet reports."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.frames import matrix_of
from seals.multibody.tree import Tree
from seals.plugins.backends.pybullet.loading import Loaded


class Posing:
    """Reads the poses of all links.

    The engine tells the pose of a link's centre of mass in double precision and that of its frame
    in single precision, so frames are composed here. Asking the engine for a link costs more than
    that: links that are fixed to others (cameras, finger-tips) are not asked for.

    Args:
        engine: the pybullet module.
        client: physics client.
        tree: of the robot.
        loaded: the robot in the engine.
    """

    def __init__(self, engine: Any, client: int, tree: Tree, loaded: Loaded) -> None:
        self._p, self._client, self._body = engine, client, loaded.body
        moving = [k for k in range(1, tree.links) if tree.joint[k] >= 0]
        self._asked = [loaded.index[k] for k in moving]
        frames = [(loaded.base_centre, matrix_of(loaded.base_turn)[0].T)]
        for s in self._states():
            frames.append((np.array(s[2]), matrix_of(np.array([s[3]]))[0]))
        rows = {k: (row, *_seen(*frames[row])) for row, k in enumerate((0, *moving))}
        for k in range(1, tree.links):
            if k not in rows:
                row, offset, turn = rows[tree.parent[k]]
                rows[k] = (row, offset + turn @ tree.origin[k], turn @ tree.rotation[k])
        table = [rows[k] for k in range(tree.links)]
        self._row = np.array([row for row, _, _ in table])
        # attitude and place in the engine's axes as one matrix of four columns
        self._on = np.array([np.column_stack((turn, offset)) for _, offset, turn in table])

    def _states(self) -> Any:
        if not self._asked:
            return ()
        return self._p.getLinkStates(
            self._body, self._asked, computeForwardKinematics=1, physicsClientId=self._client
        )

    def read(self) -> tuple[Floats, Floats]:
        """Return origins (L, 3) [m] and rotations (L, 3, 3) of all links."""
        position, quaternion = self._p.getBasePositionAndOrientation(
            self._body, physicsClientId=self._client
        )
        table = np.array([position + quaternion, *(s[0] + s[1] for s in self._states())])
        both = matrix_of(table[:, 3:]).take(self._row, axis=0) @ self._on
        return table[:, :3].take(self._row, axis=0) + both[:, :, 3], both[:, :, :3]


def _seen(centre: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """Place and attitude of a link in its principal axes about its centre of mass.

    Args:
        centre: of mass, in the link [m], shape (3,).
        turn: rotation of the principal axes in the link, shape (3, 3).
    """
    return -turn.T @ centre, turn.T


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
