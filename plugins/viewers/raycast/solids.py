"""A scene as tables of convex primitives, sorted by kind.

A mesh becomes convex solids: polyhedra, or the fitted sphere, cylinder or box.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering.scene import Scene, Shape

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
        direction = axis / np.linalg.norm(axis)
        side = np.eye(3)[int(np.abs(direction).argmin())]
        first = np.cross(side, direction)
        first /= np.linalg.norm(first)
        axes = np.stack([first, np.cross(direction, first), direction], axis=1)
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


KINDS = ("sphere", "box", "cylinder", "convex", "plane")
"""Order of the kinds in the tables."""


class _Solid(NamedTuple):
    """One primitive in its frame; size as half lengths, for a cylinder (radius, radius, half)."""

    kind: str
    half: tuple[float, float, float]
    position: Floats
    rotation: Floats
    colour: tuple[float, float, float]
    part: int
    frame: int
    normals: Floats | None = None
    offsets: Floats | None = None
    tile: float = 0.0

    def planes(self) -> int:
        """Number of planes reserved for a convex solid in its group: the next power of two."""
        count = 0 if self.offsets is None else len(self.offsets)
        return 1 << max(count - 1, 0).bit_length()


class Tables(NamedTuple):
    """All primitives of a scene, K of them.

    Args:
        counts: number of each kind, in the order of ``KINDS``.
        half: half lengths [m], shape (K, 3).
        position: in the frames [m], shape (K, 3).
        rotation: in the frames, shape (K, 3, 3).
        colour: displayed, shape (K, 3).
        part: shape (K,).
        frame: shape (K,); the last frame of all stands still.
        hulls: number of convex ones, and of planes, of each group of them.
        normals: of the planes of convex ones, group by group, zero where one has fewer than its
            group, shape (P, 3).
        offsets: of those planes [m], one where there are fewer, shape (P,).
        tile: edge of a plane's squares [m], shape (K,).
    """

    counts: tuple[int, ...]
    half: Floats
    position: Floats
    rotation: Floats
    colour: Floats
    part: NDArray[np.int32]
    frame: NDArray[np.int64]
    hulls: tuple[tuple[int, int], ...]
    normals: Floats
    offsets: Floats
    tile: Floats

    @classmethod
    def of(cls, scene: Scene) -> Tables:
        """Return the primitives of a scene.

        Example:
            >>> ball = Shape("capsule", (0.1, 1.0), np.zeros(3), np.eye(3), (1.0, 0.0, 0.0), 1)
            >>> Tables.of(Scene((ball,), ("nothing", "a"), ())).counts
            (2, 0, 1, 0, 0)
        """
        found = [solid for shape in scene.shapes for solid in _split(shape)]
        found.sort(key=lambda solid: (KINDS.index(solid.kind), solid.planes()))
        hulls, normals, offsets = _grouped([s for s in found if s.kind == "convex"])
        still = len(scene.frames)
        return cls(
            counts=tuple(sum(s.kind == kind for s in found) for kind in KINDS),
            half=np.array([s.half for s in found]).reshape(-1, 3),
            position=np.array([s.position for s in found]).reshape(-1, 3),
            rotation=np.array([s.rotation for s in found]).reshape(-1, 3, 3),
            colour=np.array([s.colour for s in found]).reshape(-1, 3),
            part=np.array([s.part for s in found], dtype=np.int32),
            frame=np.array([still if s.frame < 0 else s.frame for s in found], dtype=np.int64),
            hulls=hulls,
            normals=normals,
            offsets=offsets,
            tile=np.array([s.tile for s in found]),
        )


def _grouped(solids: list[_Solid]) -> tuple[tuple[tuple[int, int], ...], Floats, Floats]:
    """Convex solids in groups of like size, and all their planes."""
    sizes = [s.planes() for s in solids]
    groups = tuple((sizes.count(n), n) for n in sorted(set(sizes)))
    normals, offsets = np.zeros((sum(sizes), 3)), np.ones(sum(sizes))
    start = 0
    for solid, size in zip(solids, sizes, strict=True):
        assert solid.normals is not None
        assert solid.offsets is not None
        cut = slice(start, start + len(solid.offsets))
        normals[cut], offsets[cut] = solid.normals, solid.offsets
        start += size
    return groups, normals, offsets


def _split(shape: Shape) -> list[_Solid]:
    """The primitives that make up a shape: a mesh is its convex pieces, a capsule three."""
    place, turn = np.asarray(shape.position, dtype=float), np.asarray(shape.rotation, dtype=float)
    rest = (shape.colour, shape.part, shape.frame)
    if shape.kind == "mesh":
        assert shape.vertices is not None
        assert shape.faces is not None
        return [
            _Solid(
                piece.kind,
                _half(piece.kind, piece.size),
                place + turn @ piece.position,
                turn @ piece.rotation,
                *rest,
                piece.normals,
                piece.offsets,
            )
            for piece in solids_of(shape.vertices, shape.faces)
        ]
    if shape.kind == "capsule":
        end = 0.5 * shape.size[1] * turn[:, 2]
        parts = (("cylinder", 0.0), ("sphere", 1.0), ("sphere", -1.0))
        return [
            _Solid(kind, _half(kind, shape.size), place + side * end, turn, *rest)
            for kind, side in parts
        ]
    return [_Solid(shape.kind, _half(shape.kind, shape.size), place, turn, *rest, tile=shape.tile)]


def _half(kind: str, size: tuple[float, ...]) -> tuple[float, float, float]:
    """Half lengths along the axes of a primitive [m]; ones for what planes bound."""
    if kind == "box":
        return 0.5 * size[0], 0.5 * size[1], 0.5 * size[2]
    if kind in ("sphere", "cylinder"):
        return size[0], size[0], 0.5 * size[1] if kind == "cylinder" else size[0]
    return 1.0, 1.0, 1.0
