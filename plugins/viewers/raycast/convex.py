"""Conversion of meshes to convex solids: polyhedra, or the fitted sphere, cylinder or box."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats

ROUND = 10
"""Sides from which on a prism counts as a cylinder."""
EVEN = 6e-3
"""How far corners may lie beside the ball or cylinder that they stand for, in its radii: as far as
the sides of a prism of 32."""
CLOSE = 0.9
"""Distance of a ball's faces from its middle, in its radii."""
SAME = 2e-3
"""Difference up to which two faces lie in one plane [1, sizes of the piece]."""


class Solid(NamedTuple):
    """A convex solid in axes of the mesh.

    Args:
        kind: ``sphere``, ``cylinder``, ``box`` or ``convex``.
        size: radius; radius and length; edges; empty for planes [m].
        position: centre [m], shape (3,).
        rotation: of its axes, shape (3, 3); a cylinder lies along z.
        normals: of the planes, outward, about the position, shape (P, 3).
        offsets: distance of the planes from the position [m], shape (P,).
    """

    kind: str
    size: tuple[float, ...]
    position: Floats
    rotation: Floats
    normals: Floats
    offsets: Floats


def solids_of(vertices: Floats, faces: NDArray[np.int64]) -> list[Solid]:
    """Return the connected pieces of a mesh as convex solids; a hollow piece becomes its hull.

    Args:
        vertices: [m], shape (V, 3).
        faces: shape (F, 3).

    Example:
        >>> cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
        >>> from scipy.spatial import ConvexHull
        >>> [piece] = solids_of(cube, ConvexHull(cube).simplices)
        >>> piece.kind, np.round(piece.size, 9).tolist(), np.round(piece.position, 9).tolist()
        ('box', [1.0, 1.0, 1.0], [0.5, 0.5, 0.5])
    """
    points, back = np.unique(np.round(vertices, 7), axis=0, return_inverse=True)
    corners = back.reshape(-1)[faces]
    label = _pieces(corners)
    pieces = [points[np.unique(corners[label == k])] for k in range(label.max() + 1)]
    return [_solid(piece) for piece in pieces if len(piece) >= 4]


def _pieces(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Piece index of every face; pieces that touch only at a corner stay apart."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(np.concatenate([faces[:, :2], faces[:, 1:], faces[:, ::2]]), axis=1)
    edge = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1) + len(faces)
    face = np.tile(np.arange(len(faces)), 3)
    size = int(edge.max()) + 1
    graph = coo_matrix((np.ones(len(edge)), (face, edge)), shape=(size, size))
    found = connected_components(graph, directed=False)[1][: len(faces)]
    return found.astype(np.int64)


def _solid(points: Floats) -> Solid:
    """The convex solid of some corners."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    size = float(np.ptp(points, axis=0).max())
    # one plane equation for each flat face that consists of several triangles
    kept: list[Floats] = []
    for row in np.asarray(hull.equations):
        if not any(
            np.abs(row[:3] - k[:3]).max() < SAME and abs(row[3] - k[3]) < SAME * size for k in kept
        ):
            kept.append(row)
    equations = np.array(kept)
    corners = points[hull.vertices]
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    known = _ball(corners, equations) or _cylinder(corners, equations) or _box(equations)
    if known is not None:
        return known
    offsets = -(equations[:, 3] + equations[:, :3] @ middle)
    return Solid("convex", (), middle, np.eye(3), equations[:, :3], offsets)


def _ball(corners: Floats, equations: Floats) -> Solid | None:
    """A ball through all corners."""
    if len(corners) < 4 * ROUND:
        return None
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    reach = np.linalg.norm(corners - middle, axis=1)
    radius = float(reach.mean())
    # the faces pass close by the ball, which those of a prism with its corners on one do not
    deep = -(equations[:, 3] + equations[:, :3] @ middle)
    if np.abs(reach - radius).max() > EVEN * radius or deep.min() < CLOSE * radius:
        return None
    return Solid("sphere", (radius,), middle, np.eye(3), np.zeros((0, 3)), np.zeros(0))


def _cylinder(corners: Floats, equations: Floats) -> Solid | None:
    """A cylinder through all corners: two opposite planes hold them, on circles about one axis."""
    if len(corners) < 2 * ROUND:
        return None
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    for normal in equations[:, :3]:
        upper = corners @ normal > middle @ normal
        if upper.sum() < 0.4 * len(corners) or upper.sum() > 0.6 * len(corners):
            continue
        # from ring to ring: of a thin rod the caps tell the axis badly
        axis = corners[upper].mean(axis=0) - corners[~upper].mean(axis=0)
        along = corners @ (axis / np.linalg.norm(axis))
        low, high = float(along.min()), float(along.max())
        # corners off both ends: a chamfer, a cone, another direction
        if np.minimum(high - along, along - low).max() > EVEN * (high - low):
            continue
        axes = _axes(axis / np.linalg.norm(axis))
        flat = corners @ axes[:, :2]
        # middle and radius of the circle through points of the plane, in the least-squares sense
        table = np.column_stack([2.0 * flat, np.ones(len(flat))])
        found = np.linalg.lstsq(table, (flat**2).sum(axis=1), rcond=None)[0]
        aside, radius = found[:2], float(np.sqrt(max(found[2] + found[:2] @ found[:2], 0.0)))
        if np.abs(np.linalg.norm(flat - aside, axis=1) - radius).max() > EVEN * radius:
            continue
        centre = axes @ np.array([*aside, 0.5 * (low + high)])
        none = np.zeros((0, 3)), np.zeros(0)
        return Solid("cylinder", (radius, high - low), centre, axes, *none)
    return None


def _box(equations: Floats) -> Solid | None:
    """A box: three pairs of opposite faces, square to each other."""
    if len(equations) != 6:
        return None
    normals = equations[:, :3]
    facing = normals @ normals.T
    opposite = facing.argmin(axis=1)
    if np.abs(facing[np.arange(6), opposite] + 1.0).max() > SAME:
        return None
    first = [k for k in range(6) if k < opposite[k]]
    axes = normals[first]
    if np.abs(axes @ axes.T - np.eye(3)).max() > SAME:
        return None
    axes[2] *= np.sign(np.linalg.det(axes))
    ends = np.stack([equations[first, 3], equations[opposite[first], 3]])
    ends[:, 2] = ends[:, 2] if np.allclose(axes[2], normals[first[2]]) else ends[::-1, 2]
    edges = -ends.sum(axis=0)
    middle = axes.T @ (0.5 * (ends[1] - ends[0]))
    none = np.zeros((0, 3)), np.zeros(0)
    size = (float(edges[0]), float(edges[1]), float(edges[2]))
    return Solid("box", size, middle, axes.T, *none)


def _axes(along: Floats) -> Floats:
    """Right-handed axes whose third is given, as columns."""
    side = np.eye(3)[int(np.abs(along).argmin())]
    first = np.cross(side, along)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(along, first), along], axis=1)
