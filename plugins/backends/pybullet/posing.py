"""Poses of the links: from the engine for those that move, by composition for those that do not."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.dynamics.tree import Tree
from seals.frames import matrix_of
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
        """Find the fixed links and the link that carries each."""
        self._p, self._client, self._body = engine, client, loaded.body
        self._moving = [k for k in range(1, tree.links) if tree.joint[k] >= 0]
        self._asked = [loaded.index[k] for k in self._moving]
        self._fixed = [k for k in range(1, tree.links) if tree.joint[k] < 0]
        self._rows = np.array([0, *self._moving])
        self._count = tree.links
        place = {k: (k, np.zeros(3), np.eye(3)) for k in (0, *self._moving)}
        for k in self._fixed:
            carrier, offset, turn = place[tree.parent[k]]
            place[k] = (carrier, offset + turn @ tree.origin[k], turn @ tree.rotation[k])
        self._carriers = [place[k][0] for k in self._fixed]
        self._offsets = np.array([place[k][1] for k in self._fixed]).reshape(-1, 3, 1)
        self._turns = np.array([place[k][2] for k in self._fixed]).reshape(-1, 3, 3)

    def read(self, position: Floats, quaternion: Floats, centre: Floats) -> tuple[Floats, Floats]:
        """Return origins (L, 3) [m] and rotations (L, 3, 3) of all links.

        Args:
            position: centre of mass of the base, world [m], shape (3,).
            quaternion: of the base link's frame, xyzw, shape (4,).
            centre: centre of mass of the base in its frame [m], shape (3,).
        """
        table = [(*position, *quaternion)]
        if self._asked:
            states = self._p.getLinkStates(
                self._body, self._asked, computeForwardKinematics=1, physicsClientId=self._client
            )
            table += [s[4] + s[5] for s in states]
        both = np.array(table)
        places, turns = both[:, :3], matrix_of(both[:, 3:])
        places[0] -= turns[0] @ centre
        if not self._fixed:
            return places, turns
        origins, rotations = np.empty((self._count, 3)), np.empty((self._count, 3, 3))
        origins[self._rows], rotations[self._rows] = places, turns
        under = rotations[self._carriers]
        origins[self._fixed] = origins[self._carriers] + (under @ self._offsets)[:, :, 0]
        rotations[self._fixed] = under @ self._turns
        return origins, rotations
