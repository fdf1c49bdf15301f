"""Ray casting against many solids: the first hit of every ray, its normal, and images of echoes."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats
from seals.rendering.picture import png
from seals.sensors.rays import Shape, distances, half_sizes, nearest_face, outward
from seals.state_records import state_record

MOST_RAYS = 1 << 22
"""Rays of a scan, and entries of each table of it."""


@state_record
class Scan(NamedTuple):
    """Images of one ping or one turn, with number, time and pose.

    Args:
        number: from 0 on.
        time: at which it was taken [s].
        images: grey images of 8 or 16 bits by the ending of their files.
        position: of the sensor, world [m], shape (3,).
        axes: of the sensor in the world as columns, shape (3, 3).
    """

    number: int
    time: float
    images: Mapping[str, Any]
    position: Floats
    axes: Floats

    def files(self) -> Mapping[str, bytes]:
        """Return PNG files by the ending of their names."""
        return {ending: png(image) for ending, image in self.images.items()}


def counts(values: Floats, unit: float) -> NDArray[np.uint16]:
    """Return values in whole units as 16 bits; 0 for what is not finite, not positive or too large.

    Example:
        >>> counts(np.array([1.25, np.inf, -3.0]), 0.01).tolist()
        [125, 0, 0]
    """
    whole = np.rint(np.where(np.isfinite(values), values, 0.0) / unit)
    return np.where((whole < 0.0) | (whole > 65535.0), 0.0, whole).astype(np.uint16)


def fan(bearings: Floats, nearest: float, farthest: float, height: int) -> NDArray[np.int64]:
    """Return which echo each pixel of a fan from above shows; -1 beside the fan, shape (H, W).

    The sensor is in the middle of the lower edge and looks up, left is left.

    Args:
        bearings: of the beams, from left to right: falling [rad], shape (B,).
        nearest: range of the first bin [m].
        farthest: end of the last bin [m].
        height: of the picture, also the number of bins [px].

    Example:
        >>> fan(np.array([0.5, 0.0, -0.5]), 0.0, 1.0, 4).shape
        (4, 4)
    """
    widest = min(float(np.max(np.abs(bearings))), 0.5 * np.pi)
    half = max(int(np.ceil(height * np.sin(widest))), 1)
    ahead = (height - np.arange(height) - 0.5)[:, None]
    left = (half - np.arange(2 * half) - 0.5)[None, :]
    size = farthest / height
    way, bearing = np.hypot(ahead, left) * size, np.arctan2(left, ahead)
    beam = np.rint(np.interp(-bearing, -bearings, np.arange(len(bearings)))).astype(np.int64)
    row = np.floor((way - nearest) / (farthest - nearest) * height).astype(np.int64)
    off = 0.5 * (2.0 * widest) / max(len(bearings) - 1, 1)
    seen = (row >= 0) & (row < height) & (np.abs(bearing) <= widest + off)
    return np.where(seen, beam * height + row, -1)


_KEPT = 64
"""Meshes whose search tree is kept."""
_trees: OrderedDict[int, tuple[Floats, Any, Floats]] = OrderedDict()


class Hits(NamedTuple):
    """First hits of n rays, in arrays of NumPy or PyTorch.

    Args:
        distance: along each ray [m], infinite for a miss, shape (n,).
        normal: outward, world axes, zero for a miss, shape (n, 3).
        shape: number of the shape hit, -1 for none, shape (n,).
    """

    distance: Array
    normal: Array
    shape: Array


def cast(shapes: Sequence[Shape], origin: Floats, directions: Floats, farthest: float) -> Hits:
    """Return the first hit of every ray.

    Primitives are met in closed form, meshes by Embree where it is installed (single precision).

    Args:
        shapes: in the world.
        origin: of all rays [m], shape (3,).
        directions: unit vectors, shape (n, 3).
        farthest: length of the rays [m].

    Example:
        >>> ball = Shape("sphere", (1.0,), np.array([3.0, 0, 0]), np.eye(3), np.zeros((0, 3, 3)))
        >>> hits = cast([ball], np.zeros(3), np.array([[1.0, 0, 0], [0, 1.0, 0]]), 10.0)
        >>> hits.distance, hits.normal[0], hits.shape
        (array([ 2., inf]), array([-1.,  0.,  0.]), array([ 0, -1]))
    """
    count = len(directions)
    found = Hits(np.full(count, math.inf), np.zeros((count, 3)), np.full(count, -1))
    for k, shape in enumerate(shapes):
        rays = _near(shape, origin, directions, farthest)
        if len(rays):
            way, normal = _met(shape, origin, directions[rays])
            first = (way < found.distance[rays]) & (way <= farthest)
            rays = rays[first]
            found.distance[rays], found.normal[rays] = way[first], normal[first]
            found.shape[rays] = k
    return found


def _near(shape: Shape, origin: Floats, directions: Floats, farthest: float) -> NDArray[np.int64]:
    """Return the rays that pass through the ball about a shape."""
    if shape.kind == "plane":
        return np.arange(len(directions))
    radius, centre = _ball(shape), shape.position - origin
    square = float(centre @ centre)
    if square > (farthest + radius) ** 2:
        return np.arange(0)
    along = directions @ centre
    return np.flatnonzero((square - along * along <= radius * radius) & (along >= -radius))


def _ball(shape: Shape) -> float:
    """Radius about the position that holds a shape [m]."""
    if shape.kind == "mesh":
        return _tree(shape.corners)[0]
    if shape.kind == "box":
        return 0.5 * math.hypot(*shape.size)
    if shape.kind == "sphere":
        return shape.size[0]
    return math.hypot(shape.size[0], 0.5 * shape.size[1]) + shape.size[0]


def _met(shape: Shape, origin: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """Return distances and normals of one shape."""
    if shape.kind == "mesh":
        start, ways = (origin - shape.position) @ shape.turn, directions @ shape.turn
        way, normal = _mesh(shape.corners, start, ways)
        return way, normal @ shape.turn.T
    way = distances(shape, origin, directions)
    hit = np.isfinite(way)
    normal = np.zeros((len(way), 3))
    points = origin + way[hit, None] * directions[hit]
    own = (points - shape.position) @ shape.turn
    normal[hit] = outward(shape.kind, half_sizes(shape)[None], own) @ shape.turn.T
    return way, normal


def _tree(corners: Floats) -> tuple[float, Any, Floats]:
    """Return radius, search tree (None without Embree) and face normals of a mesh, built once."""
    key = id(corners)
    if key not in _trees or _trees[key][0] is not corners:
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        _trees[key] = corners, _embree(corners), normals
        while len(_trees) > _KEPT:
            _trees.popitem(last=False)
    _trees.move_to_end(key)
    kept, scene, normals = _trees[key]
    return float(np.sqrt(np.max(np.sum(kept * kept, axis=2)))), scene, normals


def _embree(corners: Floats) -> Any:
    """Return the mesh in a scene of Embree; None if it is not installed."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError:
        return None
    scene = EmbreeScene()
    TriangleMesh(scene, corners.astype(np.float32))
    return scene


def _mesh(corners: Floats, start: Floats, ways: Floats) -> tuple[Floats, Floats]:
    """Return distances and normals of a mesh, own axes."""
    _, scene, normals = _tree(corners)
    if scene is None:
        with np.errstate(divide="ignore", invalid="ignore"):
            return nearest_face(corners, start, ways)
    starts = np.broadcast_to(start, ways.shape).astype(np.float32)
    got = scene.run(np.ascontiguousarray(starts), ways.astype(np.float32), output=True)
    face = got["primID"]
    way = np.where(face >= 0, got["tfar"].astype(float), math.inf)
    normal = np.where(np.isfinite(way)[:, None], normals[np.maximum(face, 0)], 0.0)
    # towards the ray, whichever way the file turns its faces
    return way, -np.sign(np.sum(normal * ways, axis=1))[:, None] * normal
