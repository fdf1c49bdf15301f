"""Bounds of robots that tell, without a search for contacts, that nothing in a scene can touch.

The engine tests every pair of shapes: ten robots of forty shapes are 70,000 pairs. Spheres about
the robots are ten.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Array, Floats, namespace

SPARE = 1e-6
"""Distance by which bounds are widened against rounding [m]."""


class Clearance:
    """Spheres about the robots of a scene, and their distances from each other and from solids.

    Equation:
        A shape of a robot lies within R of the origin of its root: R the largest sum of the
        distances between the origins of links on the way to a shape, the strokes of joints that
        slide, and the radius of the shape's own sphere. Nothing touches while no root moves by s,
        the least of (|p_i - p_j| - R_i - R_j) / 2 and of the distances from solids less R_i.

    Args:
        engine: the mujoco module.
        model: of the engine, compiled.
        roots: numbers of the root bodies of all robots, N of them.
    """

    def __init__(self, engine: Any, model: Any, roots: list[int]) -> None:
        self._roots = np.array(roots)
        reach, radius = self._reaches(engine, model), np.zeros(len(roots))
        mine = set(roots)
        solids = []
        for k in range(model.ngeom):
            root = int(model.geom_bodyid[k])
            while root and root not in mine:
                root = int(model.body_parentid[root])
            if not root:
                solids.append(k)
                continue
            at = roots.index(root)
            own = float(np.linalg.norm(model.geom_pos[k])) + float(model.geom_rbound[k])
            radius[at] = max(radius[at], reach[model.geom_bodyid[k]] + own + SPARE)
        self.radius = radius
        self._one, self._other = np.triu_indices(len(roots), 1)
        self._apart = radius[self._one] + radius[self._other]
        flat = [k for k in solids if model.geom_type[k] == engine.mjtGeom.mjGEOM_PLANE]
        round_ = [k for k in solids if k not in flat]
        turn = np.zeros(9)
        self._normal, self._level = np.zeros((3, len(flat))), np.zeros(len(flat))
        for k, plane in enumerate(flat):
            engine.mju_quat2Mat(turn, model.geom_quat[plane])
            self._normal[:, k] = turn[2::3]
            self._level[k] = turn[2::3] @ model.geom_pos[plane]
        self._middle = model.geom_pos[round_].reshape(1, -1, 3).copy()
        self._away = radius[:, None] + model.geom_rbound[round_][None] + SPARE

    @staticmethod
    def _reaches(engine: Any, model: Any) -> Floats:
        """Largest distances of the origins of all bodies from their roots [m], shape (bodies,)."""
        reach = np.zeros(model.nbody)
        for body in range(1, model.nbody):
            first, count = model.body_jntadr[body], model.body_jntnum[body]
            free, stroke = False, 0.0
            for j in range(first, first + count):
                kind = model.jnt_type[j]
                free |= bool(kind == engine.mjtJoint.mjJNT_FREE)
                if kind == engine.mjtJoint.mjJNT_SLIDE:
                    stroke += float(np.abs(model.jnt_range[j]).max())
                    # stops give way a little
                    stroke = np.inf if not model.jnt_limited[j] else 1.1 * stroke
            parent = int(model.body_parentid[body])
            if parent and not free:
                reach[body] = reach[parent] + float(np.linalg.norm(model.body_pos[body])) + stroke
        return reach

    def places(self, data: Any) -> Floats:
        """Return the origins of all roots [m], shape (N, 3), after `mj_kinematics`."""
        found: Floats = data.xpos[self._roots]
        return found

    def addresses(self, data: Any) -> list[int]:
        """Return where the engine keeps these origins."""
        return [data.xpos[root].ctypes.data for root in self._roots]

    def slack(self, place: Floats) -> float:
        """Return how far every robot may move before anything can touch [m]; below 0 for now.

        Args:
            place: of the roots, see `places`.
        """
        way, off = place[self._one] - place[self._other], place[:, None] - self._middle
        way, off = (np.sqrt((x * x).sum(axis=-1)) for x in (way, off))
        flat = place @ self._normal - self._level - self.radius[:, None]
        bounds = 0.5 * (way - self._apart), off - self._away, flat
        return min(float(x.min(initial=np.inf)) for x in bounds)


def strayed(place: Array, began: Array, slack: Array) -> list[Array]:
    """Return whether a robot is farther from where it began than a slack [m]; pure.

    Args:
        place: of the roots now [m], shape (N, 3).
        began: the same at the start.
        slack: see `Clearance.slack`, shape (1,).
    """
    xp, way = namespace(place), place - began
    # written so that a place that is not a number has strayed as well
    return [~xp.all(xp.sum(way * way, axis=1) < slack * slack)]
