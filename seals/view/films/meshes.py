"""Surface meshes of particle water, cleaned for rendering."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.hydrostatics.meshes import load_triangles
from seals.run.surface import Mesh
from seals.untrusted_io import MOST_BYTES

LEAST_AREA = 1e-10
"""Twice the area of a triangle that is left out [m^2]."""
LEAST = 0.25
"""Share of a component's area that its summed normals must have for it to be an open sheet [1]."""


def read_mesh(path: Path) -> Mesh:
    """Read a surface.

    Raises:
        ConfigError: the file is damaged.
    """
    try:
        loaded = load_triangles(path, where="surface", most=MOST_BYTES)
        return Mesh(np.array(loaded.vertices, dtype=float), np.array(loaded.faces, dtype=np.int64))
    except (OSError, ValueError, AttributeError, KeyError, IndexError) as cause:
        raise ConfigError(
            f"the surface {path} cannot be read: {cause}.\nRun again with surface=SECONDS"
        ) from cause


def cut(mesh: Mesh, low: tuple[float, float], high: tuple[float, float]) -> Mesh:
    """Clip a mesh by a rectangle seen from above.

    Args:
        mesh: closed.
        low: corner, east and north [m].
        high: opposite corner [m].
    """
    from trimesh import intersections

    slicing: Any = intersections.slice_faces_plane

    vertices, faces = mesh.vertices, mesh.triangles
    for axis in (0, 1):
        for edge, sign in ((low[axis], 1.0), (high[axis], -1.0)):
            normal, origin = np.zeros(3), np.zeros(3)
            normal[axis], origin[axis] = sign, edge
            vertices, faces, *_ = slicing(vertices, faces, normal, origin)
    return Mesh(np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64))


def outer(mesh: Mesh) -> Mesh:
    """Return the outer surface, without cavities and faces that point down.

    Voids are what bodies take, and air that the particles enclose; the sheet that looks down is the
    floor of water that was cut at its sides.
    """
    labels = _components(mesh)
    corners = mesh.vertices[mesh.triangles]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle = mesh.vertices.mean(axis=0) if len(mesh.vertices) else np.zeros(3)
    # signed volume of the cone from the middle over each triangle
    volume = np.einsum("ij,ij->i", corners.mean(axis=1) - middle, area) / 3.0
    count = int(labels.max()) + 1 if len(labels) else 0
    up = np.bincount(labels, area[:, 2], count)
    total = np.bincount(labels, np.linalg.norm(area, axis=1), count)
    open_sheet = np.abs(up) > LEAST * total
    kept = np.where(open_sheet, up > 0.0, np.bincount(labels, volume, count) > 0.0)
    return tidy(Mesh(mesh.vertices, mesh.triangles[kept[labels]]))


def tidy(mesh: Mesh) -> Mesh:
    """Return a mesh without degenerate triangles and unused vertices."""
    corners = mesh.vertices[mesh.triangles]
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    mesh = Mesh(mesh.vertices, mesh.triangles[np.linalg.norm(twice, axis=1) > LEAST_AREA])
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    return Mesh(mesh.vertices[used], triangles.reshape(-1, 3).astype(np.int64))


def _components(mesh: Mesh) -> NDArray[np.int64]:
    """Index of the connected component of every triangle."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    a, b, c = mesh.triangles.T
    n = len(mesh.vertices)
    ones = np.ones(2 * len(a), dtype=bool)
    links = coo_array((ones, (np.concatenate([a, b]), np.concatenate([b, c]))), shape=(n, n))
    _, labels = connected_components(links, directed=False)
    _, dense = np.unique(labels[a], return_inverse=True)
    return np.asarray(dense, dtype=np.int64)


def raster(mesh: Mesh, low: Floats, edge: float, cells: tuple[int, int]) -> Floats:
    """Return the height of the top vertex over every cell; empty cells take their neighbour's.

    Args:
        mesh: a surface.
        low: corner of the grid, east and north [m], shape (2,).
        edge: of a cell [m].
        cells: along x and y.
    """
    from scipy.ndimage import distance_transform_edt, median_filter

    grid = np.full(cells, -np.inf)
    place = np.floor((mesh.vertices[:, :2] - low) / edge).astype(int)
    good = np.all((place >= 0) & (place < cells), axis=1)
    np.maximum.at(grid, (place[good, 0], place[good, 1]), mesh.vertices[good, 2])
    empty = ~np.isfinite(grid)
    if empty.all():
        return np.zeros(cells)
    nearest = distance_transform_edt(empty, return_distances=False, return_indices=True)
    filled = grid[tuple(nearest)]
    # single drops in the air are not a surface
    found: Floats = median_filter(filled, size=3, mode="nearest")
    return found
