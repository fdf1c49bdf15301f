"""Ray intersection with solids, in closed form."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import Solid
from seals.frames import matrix_of
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

_TINY = 1e-12


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
    with np.errstate(divide="ignore", invalid="ignore"):
        if shape.kind == "mesh":
            return _mesh(shape.corners, start, ways)
        enter, leave = _span(shape, start, ways)
    return np.where((enter <= leave) & (leave >= 0.0), np.maximum(enter, 0.0), math.inf)


def _span(shape: Shape, start: Floats, ways: Floats) -> tuple[Floats, Floats]:
    """Return entry and exit distances of a convex shape; entry exceeds exit for a miss."""
    if shape.kind == "plane":
        return _slab(start[2], ways[:, 2], -math.inf, 0.0)
    if shape.kind == "box":
        spans = [_slab(start[k], ways[:, k], -0.5 * e, 0.5 * e) for k, e in enumerate(shape.size)]
        return _common(spans)
    if shape.kind == "sphere":
        return _quadric(start, ways, shape.size[0])
    radius, half = shape.size[0], 0.5 * shape.size[1]
    barrel = _quadric(start[:2], ways[:, :2], radius)
    barrel = _common([barrel, _slab(start[2], ways[:, 2], -half, half)])
    if shape.kind == "cylinder":
        return barrel
    # a capsule is the union of barrel and two balls, and convex: the spans touch or are empty
    ends = [_quadric(start - np.array([0.0, 0.0, z]), ways, radius) for z in (-half, half)]
    spans = [barrel, *ends]
    enter = np.min([np.where(a <= b, a, math.inf) for a, b in spans], axis=0)
    leave = np.max([np.where(a <= b, b, -math.inf) for a, b in spans], axis=0)
    return enter, leave


def _slab(start: float, way: Floats, low: float, high: float) -> tuple[Floats, Floats]:
    """Return the interval in which rays are between two levels of one coordinate."""
    flat = np.abs(way) < _TINY
    inside = low <= start <= high
    a, b = (low - start) / way, (high - start) / way
    near = np.where(flat, -math.inf if inside else math.inf, np.minimum(a, b))
    far = np.where(flat, math.inf if inside else -math.inf, np.maximum(a, b))
    return near, far


def _quadric(start: Floats, ways: Floats, radius: float) -> tuple[Floats, Floats]:
    """Return the interval in which rays are within a radius of the origin."""
    square = np.sum(ways * ways, axis=1)
    half = ways @ start
    rest = float(start @ start) - radius * radius
    root = half * half - square * rest
    flat = square < _TINY
    reach = np.sqrt(np.maximum(root, 0.0))
    near, far = (-half - reach) / square, (-half + reach) / square
    near = np.where(root < 0.0, math.inf, near)
    far = np.where(root < 0.0, -math.inf, far)
    inside = rest <= 0.0
    near = np.where(flat, -math.inf if inside else math.inf, near)
    return near, np.where(flat, math.inf if inside else -math.inf, far)


def _common(spans: list[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    return np.max([a for a, _ in spans], axis=0), np.min([b for _, b in spans], axis=0)


def _mesh(corners: Floats, start: Floats, ways: Floats) -> Floats:
    """Nearest triangle ahead, after Moeller and Trumbore 1997, J. Graphics Tools 2(1)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(ways[:, None], second[None])
    scale = np.sum(first * across, axis=2)
    offset = start - corners[:, 0]
    u = np.sum(offset * across, axis=2) / scale
    turned = np.cross(offset, first)
    v = (ways @ turned.T) / scale
    way = np.sum(second * turned, axis=1) / scale
    met = (np.abs(scale) > _TINY) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (way >= 0.0)
    nearest: Floats = np.where(met, way, math.inf).min(axis=1, initial=math.inf)
    return nearest


def _placed(kind: str, size: tuple[float, ...], hull: HullPlaced) -> Shape:
    """A primitive in its link; ``axes`` of a hull are its own axes in link axes, row by row."""
    turn = np.array(hull.axes).T
    return Shape(kind, size, np.array(hull.position), turn, _NO_CORNERS)
