"""Samples of triangle meshes: closed ones as filled cells, open ones as sheets.

A closed mesh is cut into cubic cells. Vertical lines through the mesh, several for each cell, give
the length inside it, so that every cell knows how much of it is solid and where the middle of that
lies. No cell is lost, however thin the mesh: the volumes add up to that of the mesh.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.sampling.samples import Samples
from seals.plugins.fluids.sampling.shapes import SEEN

LINES = 6
"""Vertical lines through a cell along each side."""
LEAST = 1e-3
"""Share of a cell below which it is given to its neighbours [1]."""


def is_closed(faces: Any) -> bool:
    """Return whether a mesh is closed: every edge has two faces of consistent orientation.

    Example:
        >>> is_closed([[0, 1, 2]])
        False
    """
    table = np.asarray(faces)
    edges = np.concatenate([table[:, [0, 1]], table[:, [1, 2]], table[:, [2, 0]]])
    there, counts = np.unique(edges, axis=0, return_counts=True)
    back = np.unique(edges[:, ::-1], axis=0)
    return bool((counts == 1).all() and there.shape == back.shape and (there == back).all())


def volume_of(vertices: Floats, faces: Any) -> float:
    """Return the volume that a closed mesh encloses [m^3]."""
    a, b, c = (vertices[np.asarray(faces)[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def sample_closed(vertices: Floats, faces: Any, spacing: float, layers: int = SEEN) -> Samples:
    """Sample a closed mesh by filled cells, aligned with its axes.

    Args:
        vertices: [m], shape (V, 3).
        faces: wound outwards, shape (F, 3).
        spacing: edge of the cells [m].
        layers: under the surface; deeper cells are left out.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    shape = np.maximum(np.ceil((high - low) / spacing - 1e-9).astype(int), 1)
    start = 0.5 * (low + high - shape * spacing)
    fine = spacing / LINES
    columns, heights = _crossings(vertices, np.asarray(faces), start, fine, shape[:2] * LINES)
    filled, moment = _filled(columns, heights, start, spacing, shape)
    cell = filled > LEAST * spacing**3
    index = np.argwhere(cell)
    volume = filled[cell]
    points = moment[cell] / volume[:, None]
    kept = _near_surface(filled >= (1.0 - 1e-6) * spacing**3, index, layers)
    exact = volume_of(vertices, faces)
    volume = volume * (exact / volume.sum())
    return Samples(points[kept], volume[kept])


def _crossings(
    vertices: Floats, faces: Any, start: Floats, fine: float, counts: Any
) -> tuple[Any, Floats]:
    """Columns (n, 2) and heights (n,) at which vertical lines pass through triangles."""
    columns, heights = [], []
    # a hair beside the regular places, so that no line runs along an edge
    middle = start[:2] + fine * (0.5 + np.array([1.3e-5, 2.7e-5]))
    for a, b, c in vertices[faces]:
        flat = np.stack([a, b, c])[:, :2]
        first = np.maximum(np.floor((flat.min(axis=0) - middle) / fine).astype(int), 0)
        last = np.minimum(np.ceil((flat.max(axis=0) - middle) / fine).astype(int), counts - 1)
        if (last < first).any():
            continue
        grid = np.stack(
            np.meshgrid(
                *(np.arange(f, g + 1) for f, g in zip(first, last, strict=True)), indexing="ij"
            ),
            -1,
        ).reshape(-1, 2)
        place = middle + fine * grid
        double = _turn(flat[0], flat[1], flat[2])
        if abs(double) < 1e-18:
            continue
        weights = (
            np.stack(
                [
                    _turn(flat[1], flat[2], place),
                    _turn(flat[2], flat[0], place),
                    _turn(flat[0], flat[1], place),
                ],
                1,
            )
            / double
        )
        inside = (weights >= 0.0).all(axis=1)
        columns.append(grid[inside])
        heights.append(weights[inside] @ np.array([a[2], b[2], c[2]]))
    if not columns:
        return np.zeros((0, 2), dtype=int), np.zeros(0)
    return np.concatenate(columns), np.concatenate(heights)


def _turn(a: Floats, b: Floats, p: Floats) -> Any:
    """Twice the signed area of the triangle a, b, p."""
    return (b[0] - a[0]) * (p[..., 1] - a[1]) - (b[1] - a[1]) * (p[..., 0] - a[0])


def _filled(
    columns: Any, heights: Floats, start: Floats, spacing: float, shape: Any
) -> tuple[Floats, Floats]:
    """Solid volume of every cell [m^3] and its first moment [m^4]."""
    filled, moment = np.zeros(shape), np.zeros((*shape, 3))
    fine = spacing / LINES
    order = np.lexsort((heights, columns[:, 1], columns[:, 0]))
    columns, heights = columns[order], heights[order]
    new = np.ones(len(columns), dtype=bool)
    new[1:] = (columns[1:] != columns[:-1]).any(axis=1)
    rank = np.arange(len(columns)) - np.maximum.accumulate(
        np.where(new, np.arange(len(columns)), 0)
    )
    follows = np.append(~new[1:], False) & (rank % 2 == 0)
    enter = np.flatnonzero(follows)
    low, high = heights[enter], heights[enter + 1]
    place = start[:2] + fine * (columns[enter] + 0.5)
    cells = columns[enter] // LINES
    for k in range(shape[2]):
        floor = start[2] + k * spacing
        a, b = np.clip(low, floor, floor + spacing), np.clip(high, floor, floor + spacing)
        part = (b - a) * fine * fine
        np.add.at(filled, (cells[:, 0], cells[:, 1], k), part)
        first = np.concatenate([place, 0.5 * (a + b)[:, None]], axis=1) * part[:, None]
        np.add.at(moment, (cells[:, 0], cells[:, 1], k), first)
    return filled, moment


def _near_surface(full: Any, index: Any, layers: int) -> Any:
    """Return a mask of the cells within some layers of a cell not full, diagonals included."""
    if layers >= max(full.shape):
        return np.ones(len(index), dtype=bool)
    deep = np.pad(full, layers)
    for _ in range(layers):
        inner = deep
        for axis in range(3):
            inner = inner & np.roll(inner, 1, axis) & np.roll(inner, -1, axis)
        deep = inner
    inside: Any = deep[tuple((index + layers).T)]
    return ~inside


def sample_sheet(vertices: Floats, faces: Any, spacing: float) -> Samples:
    """Sample an open mesh by one impermeable layer, one spacing thick.

    Args:
        vertices: [m], shape (V, 3).
        faces: shape (F, 3).
        spacing: [m].
    """
    from scipy.spatial import cKDTree

    corners = vertices[np.asarray(faces)]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    cloud, weight = _dense(corners, area, 0.25 * spacing)
    chosen = _thinned(cloud, 0.75 * spacing)
    owner = cKDTree(cloud[chosen]).query(cloud)[1]
    share = np.bincount(owner, weights=weight, minlength=len(chosen))
    return Samples(cloud[chosen], np.asarray(share * spacing, dtype=np.float64))


def _dense(corners: Floats, area: Floats, fine: float) -> tuple[Floats, Floats]:
    """Return oversampled points on the faces, and the area of each."""
    points, weights = [], []
    for (a, b, c), whole in zip(corners, area, strict=True):
        sides = (np.linalg.norm(b - a), np.linalg.norm(c - a), np.linalg.norm(c - b))
        n = max(1, int(np.ceil(max(sides) / fine)))
        i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
        # the middles of the n^2 small triangles, upright and turned over
        up = np.stack([i, j], -1)[(i + j) < n] + 1.0 / 3.0
        down = np.stack([i, j], -1)[(i + j) < n - 1] + 2.0 / 3.0
        u, v = (np.concatenate([up, down]) / n).T
        points.append(a + u[:, None] * (b - a) + v[:, None] * (c - a))
        weights.append(np.full(len(u), whole / len(u)))
    return np.concatenate(points), np.concatenate(weights)


def _thinned(cloud: Floats, apart: float) -> Any:
    """Indices of points of a cloud that are at least ``apart`` from each other, in order."""
    from scipy.spatial import cKDTree

    near = cKDTree(cloud)
    taken, gone = [], np.zeros(len(cloud), dtype=bool)
    for k in range(len(cloud)):
        if not gone[k]:
            taken.append(k)
            gone[near.query_ball_point(cloud[k], apart)] = True
    return np.array(taken)
