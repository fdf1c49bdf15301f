"""Bounds of robots that tell, without a search for contacts, that nothing in a scene can touch.

The engine tests every pair of shapes: ten robots of forty shapes are 70,000 pairs. Spheres about
the robots are ten.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats

SPARE = 1e-6
"""Distance by which bounds are widened against rounding [m]."""


class Clearance:
    """Spheres about the robots of a scene, and their distances from each other and from solids.

    Equation:
        A shape of a robot lies within R of the origin of its root: R the largest sum of the
        distances between the origins of links on the way to a shape, the strokes of joints that
        slide, and the radius of the shape's own sphere. Nothing touches where all
        |p_i - p_j| > R_i + R_j, and R_i is less than the distance from every solid.

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
        self._apart = (radius[self._one] + radius[self._other]) ** 2
        flat = [k for k in solids if model.geom_type[k] == engine.mjtGeom.mjGEOM_PLANE]
        round_ = [k for k in solids if k not in flat]
        turn = np.zeros(9)
        self._normal, self._level = np.zeros((3, len(flat))), np.zeros(len(flat))
        for k, plane in enumerate(flat):
            engine.mju_quat2Mat(turn, model.geom_quat[plane])
            self._normal[:, k] = turn[2::3]
            self._level[k] = turn[2::3] @ model.geom_pos[plane]
        self._middle = model.geom_pos[round_].reshape(1, -1, 3).copy()
        self._away = (radius[:, None] + model.geom_rbound[round_][None] + SPARE) ** 2

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

    def clear(self, data: Any) -> bool:
        """Return whether nothing can touch at the present places, after `mj_kinematics`."""
        place = data.xpos[self._roots]
        way = place[self._one] - place[self._other]
        if not ((way * way).sum(axis=1) > self._apart).all():
            return False
        if not (place @ self._normal - self._level > self.radius[:, None]).all():
            return False
        off = place[:, None] - self._middle
        return bool(((off * off).sum(axis=2) > self._away).all())
