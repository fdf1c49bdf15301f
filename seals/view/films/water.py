"""Water of a run over time: waves, a particle tank, or a moving domain in the sea."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats
from seals.errors import ConfigError
from seals.hydrostatics.meshes import load_triangles
from seals.rendering.optics import Surface, SurfaceGrid, SurfaceStill, ripples
from seals.run.settings import RunSettings
from seals.run.sight import surface_of
from seals.run.surface import FOLDER, SPACING, Mesh
from seals.untrusted_io import MOST_BYTES
from seals.view.films.frame import WaterBody
from seals.view.instants import Instants

HALF = 3.0
"""Half the edge of the place where an open sea is fine [m]."""
INSET, BLEND = 2.0, 8.0
"""Where a window of particles is cut, and over which width it passes into the sea, in spacings."""
SNAP = 1.2
"""How far from a wall the surface of the water is taken to lie on it, in spacings."""
SUNK = 0.004
"""How far water reaches into the floor under it [m]: two faces in one plane flicker."""
FINE = 0.06
"""Edge of the cells about the robot [m]."""
GROWTH = 1.025
"""Ratio of neighbouring cells outside [1]; at 1.06 ripples tore black gaps before the horizon."""
FAR = 600.0
"""How far the mesh goes [m]."""
CALM = (25.0, 60.0)
"""From where to where waves fade, because cells there are longer than they are [m]."""

Box = tuple[tuple[float, float], tuple[float, float]]


class WaterOverTime:
    """Water of a run at any time.

    Args:
        settings: of the run.
        folder: of the run.
        middle: of the robot's way [m], shape (3,).

    Attributes:
        remarks: what is not as it was, in words.
    """

    def __init__(self, settings: RunSettings, folder: Path, middle: Floats) -> None:
        self.level = settings.environment.water_level
        self.meshes = Instants(folder / FOLDER, ".ply")
        self.remarks: list[str] = []
        fluid = settings.fluid
        self._spacing = float(getattr(fluid, SPACING.split()[0], 0.0)) if fluid is not None else 0.0
        self._walled = fluid is not None and bool(fluid.solids(settings.environment))
        self._waves: Surface | None = None
        if self.level is not None:
            # away from particles: the waves, or still water for a tank
            self._waves = SurfaceStill(level=float(self.level))
            if not self._walled:
                found = surface_of(dataclasses.replace(settings, fluid=None))
                self._waves = SurfaceStill() if found is None else found
        wind = settings.sight.ripples
        self._short = ripples(wind=wind, seed=settings.seed) if wind > 0.0 else None
        self._fine: Box = (
            (float(middle[0]) - HALF, float(middle[0]) + HALF),
            (float(middle[1]) - HALF, float(middle[1]) + HALF),
        )
        if fluid is not None and not self.meshes.files:
            self.remarks.append(
                "water: the run stored no surface of its particles, so only the waves of the "
                "sea are drawn; run it with surface=0.04"
            )

    def at(self, time: float) -> WaterBody | None:
        """Return the water at a time [s]; None for a run without."""
        if self._waves is None:
            return None
        file = self.meshes.nearest(time)
        if file is None:
            vertices, triangles = sea_mesh(self._waves, time, self._fine, hole=False)
            return WaterBody(vertices, triangles, False, self._waves)
        mesh = read_mesh(file)
        return self._tank(mesh) if self._walled else self._window(mesh, time, self._waves)

    def _tank(self, mesh: Mesh) -> WaterBody:
        """Water surface between walls, with flat sides."""
        mesh = outer(mesh)
        points = mesh.vertices.copy()
        near = SNAP * self._spacing
        for axis in (0, 1, 2):
            low, high = points[:, axis].min(), points[:, axis].max()
            points[points[:, axis] < low + near, axis] = low - (SUNK if axis == 2 else 0.0)
            if axis < 2:
                points[points[:, axis] > high - near, axis] = high
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        surface = self._heights(mesh, low, high)
        return WaterBody(
            points, mesh.triangles, True, surface, (low[0], low[1]), (high[0], high[1])
        )

    def _window(self, mesh: Mesh, time: float, waves: Surface) -> WaterBody:
        """Particles of a moving domain, joined to the surface of the sea inside of the ring."""
        d = self._spacing
        # the sides lean with the waves: take where the surface itself ends
        top = mesh.vertices[mesh.vertices[:, 2] > (self.level or 0.0) - 2.0 * d]
        low, high = (np.quantile(top[:, :2], q, axis=0) for q in (0.002, 0.998))
        low, high = low + INSET * d, high - INSET * d
        box: Box = ((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))
        inside = outer(cut(mesh, (box[0][0], box[1][0]), (box[0][1], box[1][1])))
        points = inside.vertices.copy()
        rim = np.min(np.concatenate([points[:, :2] - low, high - points[:, :2]], axis=1), axis=1)
        share = np.clip(rim / (BLEND * d), 0.0, 1.0)
        share = share * share * (3.0 - 2.0 * share)
        if self._short is not None:
            # what the particles are too coarse for, as on the sea around
            points[:, 2] += self._short.height(points[:, 0], points[:, 1], time)
        sea = _calmed(waves, points[:, 0], points[:, 1], time, box)
        points[:, 2] = share * points[:, 2] + (1.0 - share) * sea
        around, faces = _tidy(Mesh(*sea_mesh(waves, time, box, hole=True)))
        surface = Patched(self._heights(Mesh(points, inside.triangles), low, high), box, waves)
        return WaterBody(
            np.concatenate([points, around]),
            np.concatenate([inside.triangles, faces + len(points)]),
            False,
            surface,
        )

    def _heights(self, mesh: Mesh, low: Floats, high: Floats) -> SurfaceGrid:
        edge = max(self._spacing, 1e-3)
        cells = np.maximum(np.ceil((high - low) / edge).astype(int), 2)
        heights = raster(mesh, low, edge, (int(cells[0]), int(cells[1])))
        return SurfaceGrid(heights, (float(low[0]), float(low[1])), (edge, edge))


class Patched:
    """Surface with another surface inside a rectangle.

    Args:
        inner: inside.
        box: the rectangle, east and north [m].
        sea: outside.
    """

    def __init__(self, inner: Surface, box: Box, sea: Surface) -> None:
        self.inner, self.box, self.sea = inner, box, sea
        self.level = sea.level
        self.reach = max(sea.reach, abs(inner.level - sea.level) + inner.reach)

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the height of the surface [m]."""
        inside = self._inside(x, y)
        return np.where(inside, self.inner.height(x, y, time), self.sea.height(x, y, time))

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return the slopes along x and y [1]."""
        inside = self._inside(x, y)
        (a, b), (c, d) = self.inner.slope(x, y, time), self.sea.slope(x, y, time)
        return np.where(inside, a, c), np.where(inside, b, d)

    def _inside(self, x: Array, y: Array) -> Array:
        (x0, x1), (y0, y1) = self.box
        return (x > x0) & (x < x1) & (y > y0) & (y < y1)


def sea_mesh(
    surface: Surface, time: float, fine: Box, *, hole: bool
) -> tuple[Floats, NDArray[np.int64]]:
    """Return vertices and triangles of the sea's surface, anticlockwise from above.

    Args:
        surface: of the sea.
        time: [s].
        fine: from where to where it is fine, east and north [m].
        hole: whether that place is left out.
    """
    x, first_x, last_x = _lines(*fine[0])
    y, first_y, last_y = _lines(*fine[1])
    east, north = np.meshgrid(x, y, indexing="ij")
    points = np.stack([east, north, _calmed(surface, east, north, time, fine)], axis=-1)
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1), indexing="ij")
    kept = np.ones(i.shape, dtype=bool)
    if hole:
        inside = (i >= first_x) & (i < last_x) & (j >= first_y) & (j < last_y)
        kept = ~inside
    a = (i * len(y) + j)[kept]
    b, c, d = a + len(y), a + len(y) + 1, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return points.reshape(-1, 3), triangles.astype(np.int64)


def _calmed(surface: Surface, x: Floats, y: Floats, time: float, fine: Box) -> Floats:
    """Return heights of the sea [m], with waves fading out where the mesh is coarse."""
    middle = [0.5 * (low + high) for low, high in fine]
    distance = np.hypot(x - middle[0], y - middle[1])
    near, far = CALM
    share = np.clip((far - distance) / (far - near), 0.0, 1.0)
    height = np.asarray(surface.height(x, y, time), dtype=float)
    return surface.level + share * (height - surface.level)


def _lines(low: float, high: float) -> tuple[Floats, int, int]:
    """Positions of the grid lines along one axis, and the indices of ``low`` and ``high``."""
    count = max(2, round((high - low) / FINE))
    inner = np.linspace(low, high, count + 1)
    steps = [(high - low) / count]
    while sum(steps) < FAR:
        steps.append(steps[-1] * GROWTH)
    away = np.cumsum(steps[1:])
    lines: Floats = np.concatenate([low - away[::-1], inner, high + away])
    return lines, len(away), len(away) + count


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
    return _tidy(Mesh(mesh.vertices, mesh.triangles[kept[labels]]))


def _tidy(mesh: Mesh) -> Mesh:
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
    return median_filter(filled, size=3, mode="nearest")
