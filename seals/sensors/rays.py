"""Ray intersection with solids, in closed form, on any array library."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.environment.ground import Solid
from seals.frames import cross, matrix_of
from seals.hydrostatics import (
    Hull,
    HullBox,
    HullCapsule,
    HullCompound,
    HullCylinder,
    HullMesh,
    HullSphere,
)
from seals.hydrostatics.placed import HullPlaced

_TINY, _FLAT = 1e-12, 1e-300
_FACES = 256
"""Triangles that are met at a time."""


class Shape(NamedTuple):
    """Solid for ray intersection.

    Args:
        kind: ``plane`` (upper side of a level half space), ``box``, ``cylinder``, ``capsule``,
            ``sphere`` or ``mesh``.
        size: box edges; cylinder and capsule radius, length; sphere radius [m].
        position: centre, or a point of the plane [m], shape (3,).
        turn: its axes as columns, shape (3, 3).
        corners: triangles of a mesh [m], shape (F, 3, 3); empty for others.
    """

    kind: str
    size: tuple[float, ...]
    position: Floats
    turn: Floats
    corners: Floats

    def moved(self, origin: Floats, turn: Floats) -> Shape:
        """Return the shape of a link in the world, at its pose."""
        return self._replace(position=origin + turn @ self.position, turn=turn @ self.turn)


_NO_CORNERS: Floats = np.zeros((0, 3, 3))


def shape_of_solid(solid: Solid) -> Shape:
    """Return a solid of the ground as a shape."""
    turn = matrix_of(solid.quaternion[None])[0]
    if solid.terrain is not None:
        nodes, faces = solid.terrain.mesh()
        return Shape("mesh", (), solid.position, turn, nodes[faces])
    return Shape(solid.kind, solid.size, solid.position, turn, _NO_CORNERS)


def shapes_of_hull(hull: Hull | None) -> list[Shape]:
    """Return the shapes of a hull, link axes; empty for a sampled hull."""
    if isinstance(hull, HullCompound):
        found = [shape for part in hull.parts for shape in shapes_of_hull(part)]
        return [s._replace(position=s.position + hull.lift) for s in found]
    if isinstance(hull, HullMesh):
        return [Shape("mesh", (), np.zeros(3), np.eye(3), hull.faces.corners)]
    if isinstance(hull, HullBox):
        return [_placed("box", tuple(hull.size), hull)]
    if isinstance(hull, HullSphere):
        return [_placed("sphere", (hull.radius,), hull)]
    if isinstance(hull, HullCylinder | HullCapsule):
        kind = "cylinder" if isinstance(hull, HullCylinder) else "capsule"
        return [_placed(kind, (hull.radius, hull.length), hull)]
    return []


def distances(shape: Shape, origin: Floats, directions: Floats) -> Floats:
    """Return the distances at which rays enter a shape [m], infinite for a miss.

    A ray that starts inside has gone no way.

    Args:
        shape: that may be met.
        origin: of all rays [m], shape (3,).
        directions: unit vectors, shape (n, 3).

    Example:
        >>> ball = Shape("sphere", (1.0,), np.array([3.0, 0, 0]), np.eye(3), np.zeros((0, 3, 3)))
        >>> distances(ball, np.zeros(3), np.array([[1.0, 0, 0], [0, 1.0, 0]]))
        array([ 2., inf])
    """
    start, ways = (origin - shape.position) @ shape.turn, directions @ shape.turn
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found: Floats
        if shape.kind == "mesh":
            found = nearest_face(shape.corners, start, ways)[0]
        else:
            found = entered(shape.kind, start[None], ways[None], half_sizes(shape)[None])[0]
    return found


def half_sizes(shape: Shape) -> Floats:
    """Return half the edges of a box; radius, radius and half length of a round shape [m], (3,)."""
    if shape.kind == "box":
        return 0.5 * np.array(shape.size, dtype=float)
    radius, length = (*shape.size, 0.0, 0.0)[:2]
    return np.array([radius, radius, 0.5 * length])


def entered(kind: str, start: Array, ways: Array, half: Array) -> Array:
    """Return the distances at which rays enter convex shapes of one kind [m], shape (k, n).

    Infinite for a miss, zero for a ray that starts inside.

    Args:
        kind: of the shapes.
        start: of the rays in the axes of each shape [m], shape (k, 3).
        ways: their unit vectors in those axes, shape (k, n, 3).
        half: see `half_sizes`, shape (k, 3).
    """
    xp = namespace(ways)
    enter, leave = _span(kind, start, ways, half)
    met = (enter <= leave) & (leave >= 0.0)
    return xp.where(met, xp.maximum(enter, 0.0), math.inf)


def _span(kind: str, start: Array, ways: Array, half: Array) -> tuple[Array, Array]:
    """Return entry and exit distances; entry exceeds exit, or exit is behind, for a miss."""
    xp, end = namespace(ways), start[:, None, 2]
    if kind == "plane":
        crossing, falls = -end / _steep(ways[..., 2]), ways[..., 2] < 0.0
        return xp.where(falls, crossing, -math.inf), xp.where(falls, math.inf, crossing)
    if kind == "box":
        spans = [_slab(start[:, None, k], ways[..., k], half[:, None, k]) for k in range(3)]
        return functools.reduce(_common, spans)
    radius, reach = half[:, None, 0], half[:, None, 2]
    if kind == "sphere":
        return _quadric(start, ways, radius)
    slab = _slab(end, ways[..., 2], reach)
    enter, leave = _common(_quadric(start[:, :2], ways[..., :2], radius), slab)
    if kind == "cylinder":
        return enter, leave
    # a capsule is the union of barrel and two balls, and convex: the spans touch or are empty
    up = as_like(np.array([0.0, 0.0, 1.0]), half)
    ends = [_quadric(start + sign * half * up, ways, radius) for sign in (1.0, -1.0)]
    parts = [(a <= b, a, b) for a, b in ((enter, leave), *ends)]
    return (
        functools.reduce(xp.minimum, [xp.where(met, a, math.inf) for met, a, _ in parts]),
        functools.reduce(xp.maximum, [xp.where(met, b, -math.inf) for met, _, b in parts]),
    )


def _common(one: tuple[Array, Array], other: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return where two intervals overlap."""
    xp = namespace(one[0])
    return xp.maximum(one[0], other[0]), xp.minimum(one[1], other[1])


def _steep(way: Array) -> Array:
    """Return rates of a coordinate, next to nothing for none."""
    xp = namespace(way)
    return xp.where(xp.abs(way) < _TINY, _FLAT, way)


def _slab(start: Array, way: Array, half: Array) -> tuple[Array, Array]:
    """Return the interval in which rays are between two levels of a coordinate."""
    xp, rate = namespace(way), _steep(way)
    a, b = (-half - start) / rate, (half - start) / rate
    return xp.minimum(a, b), xp.maximum(a, b)


def _quadric(start: Array, ways: Array, radius: Array) -> tuple[Array, Array]:
    """Return the interval in which rays are within a radius of the origin."""
    xp = namespace(ways)
    square = xp.vecdot(ways, ways)
    half = xp.matmul(ways, start[:, :, None])[..., 0]
    rest = xp.sum(start * start, axis=1)[:, None] - radius * radius
    root = half * half - square * rest
    flat, passed = square < _TINY, root < 0.0
    reach, away = xp.sqrt(xp.abs(root)), xp.where(rest > 0.0, math.inf, -math.inf)
    enter = xp.where(passed, math.inf, (-half - reach) / square)
    leave = xp.where(passed, -math.inf, (-half + reach) / square)
    return xp.where(flat, away, enter), xp.where(flat, -away, leave)


def outward(kind: str, half: Array, points: Array) -> Array:
    """Return outward normals at points of the surface of a shape, own axes, shape (n, 3).

    Args:
        kind: of the shape, none of a mesh.
        half: see `half_sizes`, one shape or one for each point, shape (1 or n, 3).
        points: on the surface, own axes [m], shape (n, 3).
    """
    xp, up = namespace(points), as_like(np.array([[0.0, 0.0, 1.0]]), points)
    if kind == "plane":
        return up + 0.0 * points
    if kind == "box":
        most = xp.argmax(xp.abs(points / xp.maximum(half, 1e-30)), axis=1, keepdims=True)
        return xp.where(most == xp.arange(3, device=points.device), xp.sign(points), 0.0 * points)
    radius, reach, height = half[:, 0:1], half[:, 2:3], points[:, 2:3]
    out = points - up * xp.minimum(xp.maximum(height, -reach), reach)
    if kind == "cylinder":
        aside = xp.sqrt(xp.sum(points[:, :2] ** 2, axis=1, keepdims=True))
        cap = radius - aside > xp.abs(reach - xp.abs(height))
        out = xp.where(cap, up * xp.sign(height), points * (1.0 - up))
    return out / xp.maximum(xp.sqrt(xp.sum(out * out, axis=1, keepdims=True)), 1e-30)


def nearest_face(corners: Array, start: Array, ways: Array) -> tuple[Array, Array]:
    """Return distance of the nearest triangle ahead, and its normal towards the ray, own axes.

    After Moeller and Trumbore 1997, J. Graphics Tools 2(1).

    Args:
        corners: of the triangles [m], shape (f, 3, 3).
        start: of all rays [m], shape (3,).
        ways: unit vectors, shape (n, 3).

    Returns:
        Distance [m], infinite for a miss, (n,); normal, zero for a miss, (n, 3).
    """
    xp = namespace(ways)
    best, normal = xp.full_like(ways[:, 0], math.inf), 0.0 * ways
    for k in range(0, corners.shape[0], _FACES):
        part = corners[k : k + _FACES]
        first, second = part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]
        face, offset = cross(first, second), start - part[:, 0]
        turned = cross(offset, first)
        scale = -(ways @ face.T)
        u, v = ways @ cross(second, offset).T / scale, ways @ turned.T / scale
        way = xp.sum(second * turned, axis=1) / scale
        met = (xp.abs(scale) > _TINY) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (way >= 0.0)
        way = xp.where(met, way, math.inf)
        ahead = xp.min(way, axis=1)
        size = xp.sqrt(xp.sum(face * face, axis=1, keepdims=True))
        unit = xp.take(face / xp.maximum(size, 1e-30), xp.argmin(way, axis=1), axis=0)
        normal = xp.where((ahead < best)[:, None], unit, normal)
        best = xp.minimum(best, ahead)
    return best, -xp.sign(xp.sum(normal * ways, axis=1))[:, None] * normal


def _placed(kind: str, size: tuple[float, ...], hull: HullPlaced) -> Shape:
    """A primitive in its link; ``axes`` of a hull are its own axes in link axes, row by row."""
    turn = np.array(hull.axes).T
    return Shape(kind, size, np.array(hull.position), turn, _NO_CORNERS)
