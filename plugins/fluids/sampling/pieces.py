"""Samples of bodies, and the check that the spacing resolves them.

A convex mesh has one layer of samples, half a spacing under its faces. A closed mesh is cut into
cubic cells: vertical lines through the mesh, several for each cell, give the length inside it, so
that every cell knows how much of it is solid and where the middle of that lies. No cell is lost,
however thin the mesh: the volumes add up to that of the mesh. Open meshes are sheets.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import PhysicsError
from seals.plugins.fluids.sampling.shapes import (
    PITCH,
    SEEN,
    THICK,
    Samples,
    fine_face,
    joined,
    sample_shape,
)
from seals.robot.pieces import Piece

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


def _volume_of(vertices: Floats, faces: Any) -> float:
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
    exact = _volume_of(vertices, faces)
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
    chosen = _apart(cloud, _NONE, 0.75 * spacing)
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


SAME = 1e-6
"""Relative difference of volumes within which a mesh is its own convex hull."""
SHARP = math.cos(math.radians(30.0))
"""Cosine between the normals of two faces below which their edge has samples of its own [1]."""
DENSE, ROUNDS = 5, 12
"""Places tried for each sample along each side, and how often samples move to their middle."""


def _hull_of(vertices: Floats, volume: float) -> Any:
    """Return the convex hull of a closed mesh that is its own hull; None for another mesh.

    Args:
        vertices: [m], shape (V, 3).
        volume: that the mesh encloses [m^3].

    Example:
        >>> corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), -1).reshape(-1, 3)
        >>> _hull_of(corners, 1.0) is None, _hull_of(corners, 0.9) is None
        (False, True)
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except QhullError:
        return None
    return hull if abs(hull.volume - volume) <= SAME * volume else None


def _inscribed(hull: Any) -> tuple[Floats, float]:
    """Return middle, shape (3,), and radius of the largest ball in a convex hull [m]."""
    from scipy.optimize import linprog

    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    table = np.column_stack((normals, np.ones(len(normals))))
    ways = [(None, None)] * 3 + [(0.0, None)]
    found: Any = linprog([0.0, 0.0, 0.0, -1.0], A_ub=table, b_ub=-offsets, bounds=ways)
    return found.x[:3], float(found.x[3])


def _convex_face(hull: Any, spacing: float, pitch: float) -> Samples:
    """Sample the surface layer of a convex solid.

    The samples lie on the solid whose faces are half a spacing further in, along its sharp edges
    first. The volume of the layer, one spacing thick, is shared by the area that each stands for.

    Args:
        hull: of `_hull_of`; the largest ball in it is more than a spacing in radius.
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
    free = places[order][_apart(places[order], fixed, 0.835 * pitch)]
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
    return ConvexHull(HalfspaceIntersection(planes, _inscribed(hull)[0]).intersections)


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
        return _NONE
    # corners of many short edges lie closer than a pitch
    places = np.concatenate(found)
    return places[_apart(places, _NONE, 0.75 * pitch)]


_NONE: Floats = np.zeros((0, 3))


def _apart(places: Floats, fixed: Floats, least: float) -> list[int]:
    """Return indices of places that keep a distance from all before them, and from others."""
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
    return kept


THIN = 1.5
"""Thickness in spacings up to which a piece is its volume alone; from `THICK` its surface is.

Measured on held bodies: rods of 0.8 and 1.4 spacings are lifted by 1.03 of their weight in water by
their volume alone, a ball of two spacings by 0.73 only.
"""
LAYERS = 2.0
"""Spacings that the main piece of a body must be thick, so that the fluid sees a solid."""


class Thin(enum.Enum):
    """Treatment of pieces thinner than a spacing."""

    volume = "volume"
    """By their volume: exact buoyancy, partly permeable."""
    block = "block"
    """As a layer one spacing thick: impermeable, but displaces more."""


def sample_pieces(
    pieces: Sequence[Piece], spacing: float, *, thin: Thin = Thin.volume, layers: int = SEEN
) -> Samples:
    """Sample the pieces of a body, in its axes.

    Args:
        pieces: of the body; where they overlap, the volumes add up as they do in a hull.
        spacing: of the fluid [m].
        thin: treatment of pieces thinner than a spacing.
        layers: under the surface; deeper ones are left out.
    """
    return joined([_sampled(piece, spacing, thin, layers) for piece in pieces])


def _sampled(piece: Piece, spacing: float, thin: Thin, layers: int) -> Samples:
    """Sample one piece; a stated volume rescales the volumes of its samples."""
    if piece.kind == "mesh":
        assert piece.vertices is not None
        closed = is_closed(piece.faces) and _volume_of(piece.vertices, piece.faces) > 0.0
        hull = _hull_of(piece.vertices, volume_of(piece)) if closed else None
        if hull is not None and layers == SEEN and thickness(piece) >= THICK * spacing:
            found = _convex_face(hull, spacing, PITCH * spacing)
        elif closed:
            found = sample_closed(piece.vertices, piece.faces, spacing, layers)
        else:
            found = sample_sheet(piece.vertices, piece.faces, spacing)
    elif layers == SEEN and thickness(piece) >= THICK * spacing:
        found = fine_face(piece.kind, piece.size, spacing)
    else:
        found = sample_shape(piece.kind, piece.size, spacing, layers)
    if piece.volume is not None:
        found = Samples(found.points, found.volumes * (piece.volume / volume_of(piece)))
    bulk = min(max((thickness(piece) / spacing - THIN) / (THICK - THIN), 0.0), 1.0)
    if thin is Thin.block or not volume_of(piece):
        bulk = 1.0
        found = Samples(found.points, np.maximum(found.volumes, spacing**3))
    found = found._replace(bulk=np.full(len(found.points), bulk))
    return found.placed(piece.position, piece.rotation)


def reach_of(pieces: Sequence[Piece], spacing: float, thin: Thin) -> float:
    """Return how far the surface of a body lies from its reference point, at most [m].

    Args:
        pieces: of the body.
        spacing: of the fluid [m].
        thin: treatment of pieces thinner than a spacing.
    """
    points = sample_pieces(pieces, spacing, thin=thin).points
    far = np.linalg.norm(points, axis=1).max(initial=0.0)
    return float(far) + 0.5 * spacing if len(points) else 0.0


def volume_of(piece: Piece) -> float:
    """Return the volume of a piece's shape [m^3], zero for a sheet.

    Example:
        >>> volume_of(Piece("box", (1.0, 2.0, 3.0), np.zeros(3), np.eye(3)))
        6.0
    """
    if piece.kind == "mesh":
        assert piece.vertices is not None
        return _volume_of(piece.vertices, piece.faces) if is_closed(piece.faces) else 0.0
    if piece.kind == "box":
        return math.prod(piece.size)
    radius = piece.size[0]
    ball = 4.0 / 3.0 * math.pi * radius**3
    if piece.kind == "sphere":
        return ball
    straight = math.pi * radius**2 * piece.size[1]
    return straight + (ball if piece.kind == "capsule" else 0.0)


def thickness(piece: Piece) -> float:
    """Return the thickness of a piece [m].

    Of a convex mesh twice the radius of the largest ball in it, of others the thickness of a plate
    of equal volume and area.

    Example:
        >>> thickness(Piece("cylinder", (0.1, 0.05), np.zeros(3), np.eye(3)))
        0.05
    """
    if piece.kind == "box":
        return min(piece.size)
    if piece.kind == "cylinder":
        return min(2.0 * piece.size[0], piece.size[1])
    if piece.kind in ("sphere", "capsule"):
        return 2.0 * piece.size[0]
    assert piece.vertices is not None
    hull = _hull_of(piece.vertices, volume_of(piece)) if volume_of(piece) > 0.0 else None
    if hull is not None:
        return 2.0 * _inscribed(hull)[1]
    a, b, c = (piece.vertices[np.asarray(piece.faces)[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    # a plate of thickness t has the volume A t and the area 2 A; a ball gives 2 D / 3
    return min(2.0 * volume_of(piece) / area, float(np.ptp(piece.vertices, axis=0).min()))


def refuse_coarse(name: str, pieces: Sequence[Piece], spacing: float) -> None:
    """Refuse a spacing that does not resolve a body.

    The piece with the largest volume must be `LAYERS` spacings thick; a body of sheets alone
    passes, since a sheet is always a layer.

    Args:
        name: of the body.
        pieces: of all its links.
        spacing: of the fluid [m].

    Raises:
        PhysicsError: the largest spacing that would do is printed.
    """
    solid = [piece for piece in pieces if volume_of(piece) > 0.0]
    if not solid:
        return
    thick = thickness(max(solid, key=volume_of))
    if thick < LAYERS * spacing:
        raise PhysicsError(
            f"a spacing of {spacing:g} m is too coarse for '{name}': its main part is "
            f"{thick:.3g} m thick.\n"
            f"Allowed: up to {thick / LAYERS:.3g} m, {LAYERS:g} particles through it; "
            "for forces within 5 % use a tenth of its size."
        )
