"""Surface layer of a convex mesh: one layer of samples, half a spacing under its faces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.sampling.samples import Samples

SAME = 1e-6
"""Relative difference of volumes within which a mesh is its own convex hull."""
SHARP = math.cos(math.radians(30.0))
"""Cosine between the normals of two faces below which their edge has samples of its own [1]."""
DENSE, ROUNDS = 5, 12
"""Places tried for each sample along each side, and how often samples move to their middle."""


def hull_of(vertices: Floats, volume: float) -> Any:
    """Return the convex hull of a closed mesh that is its own hull; None for another mesh.

    Args:
        vertices: [m], shape (V, 3).
        volume: that the mesh encloses [m^3].

    Example:
        >>> corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), -1).reshape(-1, 3)
        >>> hull_of(corners, 1.0) is None, hull_of(corners, 0.9) is None
        (False, True)
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except QhullError:
        return None
    return hull if abs(hull.volume - volume) <= SAME * volume else None


def inscribed(hull: Any) -> tuple[Floats, float]:
    """Return middle, shape (3,), and radius of the largest ball in a convex hull [m]."""
    from scipy.optimize import linprog

    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    table = np.column_stack((normals, np.ones(len(normals))))
    ways = [(None, None)] * 3 + [(0.0, None)]
    found: Any = linprog([0.0, 0.0, 0.0, -1.0], A_ub=table, b_ub=-offsets, bounds=ways)
    return found.x[:3], float(found.x[3])


def convex_face(hull: Any, spacing: float, pitch: float) -> Samples:
    """Sample the surface layer of a convex solid.

    The samples lie on the solid whose faces are half a spacing further in, along its sharp edges
    first. The volume of the layer, one spacing thick, is shared by the area that each stands for.

    Args:
        hull: of `hull_of`; the largest ball in it is more than a spacing in radius.
        spacing: of the fluid [m].
        pitch: distance of the samples [m].
    """
    from scipy.spatial import cKDTree

    inner = _shrunken(hull, 0.5 * spacing)
    volume = hull.volume - _shrunken(hull, spacing).volume
    places, areas = _spread(inner, pitch / DENSE)
    fixed = _edges(inner, pitch)
    order = np.random.default_rng(0).permutation(len(places))
    # so far apart, places that leave no gap are as many as a square lattice of the pitch has
    free = _apart(places[order], fixed, 0.835 * pitch)
    for _ in range(ROUNDS):
        near = cKDTree(np.concatenate((fixed, free))).query(places)[1] - len(fixed)
        own = near >= 0
        middle = np.zeros_like(free)
        np.add.at(middle, near[own], areas[own, None] * places[own])
        weight = np.bincount(near[own], areas[own], minlength=len(free))
        middle = middle / np.maximum(weight, 1e-300)[:, None]
        free = places[cKDTree(places).query(middle[weight > 0.0])[1]]
    points = np.concatenate((fixed, free))
    share = np.bincount(cKDTree(points).query(places)[1], areas, minlength=len(points))
    return Samples(points, volume * share / share.sum())


def _shrunken(hull: Any, depth: float) -> Any:
    """Return the convex hull of a solid whose faces are moved inwards [m]."""
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    planes = np.unique(np.round(hull.equations, 12), axis=0)
    planes[:, 3] += depth
    return ConvexHull(HalfspaceIntersection(planes, inscribed(hull)[0]).intersections)


def _spread(hull: Any, fine: float) -> tuple[Floats, Floats]:
    """Return places all over a surface, shape (N, 3), and the area of each [m^2], shape (N,)."""
    places, areas = [], []
    for a, b, c in hull.points[hull.simplices]:
        u, v = b - a, c - a
        counts = [max(1, math.ceil(float(np.linalg.norm(x)) / fine)) for x in (u, v)]
        s, t = ((np.arange(n) + 0.5) / n for n in counts)
        s, t = (x.ravel() for x in np.meshgrid(s, t, indexing="ij"))
        # a parallelogram folded on its diagonal
        over = s + t > 1.0
        s, t = np.where(over, 1.0 - s, s), np.where(over, 1.0 - t, t)
        places.append(a + s[:, None] * u + t[:, None] * v)
        area = 0.5 * float(np.linalg.norm(np.cross(u, v)))
        areas.append(np.full(len(s), area / len(s)))
    return np.concatenate(places), np.concatenate(areas)


def _edges(hull: Any, pitch: float) -> Floats:
    """Return places along the sharp edges of a surface, shape (N, 3)."""
    found = []
    for k, others in enumerate(hull.neighbors):
        for m in others:
            if m <= k or hull.equations[k, :3] @ hull.equations[m, :3] > SHARP:
                continue
            first, last = hull.points[sorted(set(hull.simplices[k]) & set(hull.simplices[m]))]
            count = max(1, math.ceil(float(np.linalg.norm(last - first)) / (0.5 * pitch)))
            found.append(first + np.linspace(0.0, 1.0, count + 1)[:, None] * (last - first))
    if not found:
        return np.zeros((0, 3))
    # corners of many short edges lie closer than a pitch
    return _apart(np.concatenate(found), np.zeros((0, 3)), 0.75 * pitch)


def _apart(places: Floats, fixed: Floats, least: float) -> Floats:
    """Return those of some places, in their order, that keep a distance from all before them."""
    from scipy.spatial import cKDTree

    open_ = np.ones(len(places), dtype=bool)
    tree = cKDTree(places)
    for near in tree.query_ball_point(fixed, least):
        open_[near] = False
    kept = []
    for k in range(len(places)):
        if open_[k]:
            kept.append(k)
            open_[tree.query_ball_point(places[k], least)] = False
    return places[kept]
