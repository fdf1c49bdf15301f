"""Closed surfaces of hulls, meshed with panels of about equal size for boundary elements."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import RobotError
from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSphere,
)

LEAST_PANELS, MOST_PANELS = 60, 4000
"""Numbers of panels that may be asked for; time and memory grow with their square."""
_LEAST_SECTIONS = 8
"""Sides of a polygon that stands for a circle."""
_DENSE = 5.0
"""Triangles of a square as wide as a panel's edge above which a surface is thinned out."""
_LOST = 0.15
"""Share of the volume that thinning out may cost before it is scaled back [1]."""
_TRIALS = 6
"""Sizes of panel that are tried for a number of them."""


class Panels(NamedTuple):
    """Closed triangulated surface of a hull in link axes, with outward normals.

    Args:
        vertices: [m], shape (V, 3).
        faces: vertex numbers of each triangle, shape (F, 3).
    """

    vertices: Floats
    faces: NDArray[np.int64]

    @property
    def corners(self) -> Floats:
        """Corners of the triangles [m], shape (F, 3, 3)."""
        return self.vertices[self.faces]

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        a, b, c = (self.corners[:, k] for k in range(3))
        return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)

    @property
    def area(self) -> float:
        """Area [m^2]."""
        a, b, c = (self.corners[:, k] for k in range(3))
        return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    def moments(self) -> tuple[Floats, Floats]:
        """Return centroid [m], shape (3,), and second moments about it by volume [m^2], (3, 3)."""
        mesh = HullMesh(vertices=self.vertices, faces=self.faces)
        return np.asarray(mesh.centroid), np.asarray(mesh.spread())


def panels_of(hull: Hull, count: int) -> Panels:
    """Return the surface of a hull with about a given number of panels.

    Overlapping parts are united, round ones are polygons of equal area; the volume is that of the
    hull's shapes. A stated ``displaced_volume`` does not change them.

    Args:
        hull: a primitive, a closed mesh, or a compound of these.
        count: wanted number of triangles.

    Raises:
        RobotError: the count is out of bounds, or the hull has no closed surface.
    """
    if not LEAST_PANELS <= count <= MOST_PANELS:
        raise RobotError(
            f"{count} panels are not allowed.\nAllowed: {LEAST_PANELS} to {MOST_PANELS}."
        )
    size = math.sqrt(2.3 * _surface(hull, None).area / count)
    for _ in range(_TRIALS):
        found = _surface(hull, size)
        ratio = len(found.faces) / count
        if 0.8 <= ratio <= 1.25:
            break
        size *= math.sqrt(ratio)
    return found


def _surface(hull: Hull, size: float | None) -> Panels:
    """Surface with panels of a given edge length [m]; None for the coarsest one."""
    if not isinstance(hull, HullCompound):
        made = _primitive(hull, size)
        if isinstance(hull, HullMesh):
            return _resized(made, size)
        return made
    solid = _solid(_primitive(hull.parts[0], size))
    for part in hull.parts[1:]:
        solid = solid + _solid(_primitive(part, size))
    united = _panels(solid)
    # thinning would glue thin parts together
    return united if size is None else _panels(_solid(united).refine_to_length(1.5 * size))


def _primitive(hull: Hull, size: float | None) -> Panels:
    """Panels of a single shape in link axes that enclose its exact volume."""
    if isinstance(hull, HullMesh):
        corners = hull.faces.corners
        points, numbers = np.unique(
            np.round(corners.reshape(-1, 3), 9), axis=0, return_inverse=True
        )
        return Panels(points, numbers.reshape(-1, 3))
    if isinstance(hull, HullBox):
        own = _box(np.array(hull.size), size)
        axes = np.array(hull.axes)
    elif isinstance(hull, HullCylinder | HullCapsule):
        round_ends = isinstance(hull, HullCapsule)
        own = _turned(_profile(hull.radius, hull.length, size, round_ends), hull.radius, size)
        axes = np.array(hull.axes)
    elif isinstance(hull, HullSphere):
        own = _turned(_profile(hull.radius, 0.0, size, True), hull.radius, size)
        axes = np.eye(3)
    else:
        raise RobotError(
            f"a hull of the kind {type(hull).__name__} has no closed surface.\n"
            "Close the mesh, or use method=ellipsoid."
        )
    if not own.volume > 0.0:
        # corners nearer than the resolution of numbers fell together
        raise RobotError(
            f"a hull of {hull.volume:.3g} m^3 is too thin for panels.\n"
            "Give it the size of the link, or use method=ellipsoid."
        )
    scale = (hull.volume / own.volume) ** (1.0 / 3.0)
    return Panels(scale * own.vertices @ axes + np.asarray(hull.position), own.faces)


def _steps(length: float, size: float | None, least: int) -> int:
    return least if size is None else max(least, round(length / size))


def _box(edges: Floats, size: float | None) -> Panels:
    """A box about its centre, each face a grid of squares."""
    points: list[Floats] = []
    faces: list[Floats] = []
    start = 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        counts = [_steps(edges[k], size, 1) for k in (u, v)]
        grid = _grid(counts[0], counts[1])
        lines = [
            np.linspace(-0.5, 0.5, n + 1) * edges[k] for n, k in zip(counts, (u, v), strict=True)
        ]
        across, along = np.meshgrid(*lines, indexing="ij")
        for side in (-0.5, 0.5):
            flat = np.empty((across.size, 3))
            flat[:, axis], flat[:, u], flat[:, v] = (
                side * edges[axis],
                across.ravel(),
                along.ravel(),
            )
            points.append(flat)
            faces.append((grid if side > 0.0 else grid[:, ::-1]) + start)
            start += len(flat)
    return _welded(np.concatenate(points), np.concatenate(faces))


def _grid(rows: int, columns: int) -> Any:
    """Triangles of a grid of (rows + 1) x (columns + 1) points."""
    a, b = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    at = (a * (columns + 1) + b).ravel()
    right, up = at + columns + 1, at + 1
    return np.concatenate(
        (np.stack((at, right, right + 1), axis=1), np.stack((at, right + 1, up), axis=1))
    )


def _profile(radius: float, length: float, size: float | None, round_ends: bool) -> Floats:
    """Half section of a body of revolution, radius and height, from the lower pole up."""
    bow = _steps(0.5 * math.pi * radius, size, 4 if round_ends else 1)
    if round_ends:
        angle = np.linspace(0.0, 0.5 * math.pi, bow + 1)
        end = np.stack((radius * np.sin(angle), -radius * np.cos(angle) - 0.5 * length), axis=1)
    else:
        rings = _steps(radius, size, 1)
        span = np.linspace(0.0, radius, rings + 1)
        end = np.stack((span, np.full(rings + 1, -0.5 * length)), axis=1)
    steps = _steps(length, size, 1) if length > 0.0 else 0
    heights = np.linspace(-0.5 * length, 0.5 * length, steps + 1)[1:-1]
    side = np.stack((np.full(len(heights), radius), heights), axis=1)
    other = end[::-1] * np.array([1.0, -1.0])
    return np.concatenate((end, side, other if length > 0.0 else other[1:]))


def _turned(profile: Floats, radius: float, size: float | None) -> Panels:
    """Body of revolution about z; its polygons have the same area as the circles."""
    sections = _steps(2.0 * math.pi * radius, size, _LEAST_SECTIONS)
    step = 2.0 * math.pi / sections
    wider = math.sqrt(step / math.sin(step))
    angle = step * np.arange(sections + 1)
    out = profile[:, 0, None] * wider
    points = np.stack(
        (out * np.cos(angle), out * np.sin(angle), profile[:, 1, None] + 0.0 * angle), axis=-1
    )
    faces = _grid(len(profile) - 1, sections)
    return _welded(points.reshape(-1, 3), faces[:, ::-1])


def _welded(points: Floats, faces: Any) -> Panels:
    """Merge equal points, and remove triangles without area."""
    unit = 1e-7 * float(np.ptp(points, axis=0).max())
    _, first, numbers = np.unique(
        np.round(points / unit).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    faces = numbers.reshape(-1)[faces]
    a, b, c = faces.T
    return Panels(points[first], faces[(a != b) & (b != c) & (c != a)])


def _solid(panels: Panels) -> Any:
    import manifold3d

    mesh = manifold3d.Mesh64(
        vert_properties=np.array(panels.vertices, dtype=np.float64, order="C"),
        tri_verts=np.array(panels.faces, dtype=np.uint64, order="C"),
    )
    solid = manifold3d.Manifold(mesh)
    if solid.is_empty() or solid.status() != manifold3d.Error.NoError:
        raise RobotError(
            f"a hull's surface is not closed: {solid.status().name}.\n"
            "Close the mesh, or use method=ellipsoid."
        )
    return solid


def _panels(solid: Any) -> Panels:
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
    return Panels(vertices, np.asarray(mesh.tri_verts, dtype=np.int64))


def _resized(panels: Panels, size: float | None) -> Panels:
    """Remesh to an edge length: split long edges; merge near points if there are too many panels.

    Raises:
        RobotError: parts of the hull are thinner than the panels.
    """
    if size is None:
        return panels
    split = _panels(_solid(panels).refine_to_length(1.5 * size))
    if len(split.faces) <= _DENSE * panels.area / size**2:
        return split
    fine = _panels(_solid(panels).refine_to_length(0.5 * size))
    cells = np.floor(fine.vertices / size + 0.5).astype(np.int64)
    _, numbers = np.unique(cells, axis=0, return_inverse=True)
    numbers = numbers.reshape(-1)
    weight = np.bincount(numbers)
    points = np.stack([np.bincount(numbers, fine.vertices[:, k]) / weight for k in range(3)], 1)
    faces = np.unique(numbers[fine.faces], axis=0)
    a, b, c = faces.T
    corners = faces[(a != b) & (b != c) & (c != a)]
    sorted_corners = np.sort(corners, axis=1)
    _, number, count = np.unique(sorted_corners, axis=0, return_inverse=True, return_counts=True)
    kept: NDArray[np.int64] = corners[count[number.reshape(-1)] == 1]
    found = Panels(points, kept)
    lost = 1.0 - found.volume / panels.volume if len(found.faces) else 1.0
    if abs(lost) > _LOST:
        raise RobotError(
            f"{len(found.faces)} panels lose {lost:.0%} of a hull of {panels.volume:.3g} m^3: it "
            "has parts thinner than a panel.\nUse more panels, up to "
            f"panels={MOST_PANELS}, or method=ellipsoid."
        )
    middle = points.mean(axis=0)
    scale = (panels.volume / found.volume) ** (1.0 / 3.0)
    return found._replace(vertices=middle + scale * (points - middle))
