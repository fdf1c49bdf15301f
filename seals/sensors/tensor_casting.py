"""Ray casting by PyTorch: all rays against all solids at once, on a processor or a CUDA card."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.sensors.rays import Shape

KINDS = ("plane", "box", "cylinder", "capsule", "sphere", "mesh")
_TINY, _FLAT = 1e-12, 1e-300
_FACES = 256
"""Triangles that are met at a time."""


class TensorHits(NamedTuple):
    """First hits of n rays, tensors of double precision.

    Args:
        distance: along each ray [m], infinite for a miss, shape (n,).
        normal: outward, world axes, of any direction for a miss, shape (n, 3).
        shape: row of the scene's table that was hit, any for a miss, shape (n,).
    """

    distance: Any
    normal: Any
    shape: Any


class Scene(NamedTuple):
    """Solids sorted by kind.

    Args:
        table: position, axes row by row, half sizes (radius, radius, half length of round ones),
            kind; shape (k, 16).
        counts: how many there are of each of the `KINDS`.
        corners: of the triangles of each mesh [m], shape (f, 3, 3).
        order: number of each row's shape as given.
    """

    table: Floats
    counts: tuple[int, ...]
    corners: tuple[Floats, ...]
    order: list[int]


def scene_of(shapes: Sequence[Shape]) -> Scene:
    """Return solids in the world as a scene."""
    order = sorted(range(len(shapes)), key=lambda k: KINDS.index(shapes[k].kind))
    rows = np.zeros((len(shapes), 16))
    for row, k in zip(rows, order, strict=True):
        shape = shapes[k]
        row[:3], row[3:12] = shape.position, shape.turn.ravel()
        if shape.kind == "box":
            row[12:15] = shape.size
            row[12:15] *= 0.5
        elif shape.size and shape.kind != "plane":
            row[12:14], row[14] = shape.size[0], 0.5 * (*shape.size, 0.0)[1]
        row[15] = KINDS.index(shape.kind)
    kinds = [shape.kind for shape in shapes]
    return Scene(
        rows,
        tuple(kinds.count(kind) for kind in KINDS),
        tuple(shapes[k].corners for k in order if shapes[k].kind == "mesh"),
        order,
    )


def tensor_cast(
    table: Any,
    counts: Sequence[int],
    corners: Sequence[Any],
    origin: Any,
    directions: Any,
    *,
    farthest: float,
) -> TensorHits:
    """Return the first hit of every ray, as `seals.sensors.casting.cast` does.

    Args:
        table: of a `Scene`, as a tensor.
        counts: of the scene.
        corners: of the scene, as tensors.
        origin: of all rays [m], tensor of shape (3,).
        directions: unit vectors, tensor of shape (n, 3).
        farthest: length of the rays [m].
    """
    import torch

    place, turn, half = table[:, :3], table[:, 3:12].reshape(-1, 3, 3), table[:, 12:15]
    start = torch.einsum("ki,kij->kj", origin - place, turn)
    ways = directions[None] @ turn
    found, row = [], 0
    for kind, count in zip(KINDS[:-1], counts, strict=False):
        if count:
            rows = slice(row, row + count)
            enter, leave = _span(kind, start[rows], ways[rows], half[rows])
            met = (enter <= leave) & (leave >= 0.0)
            found.append(torch.where(met, enter.clamp(min=0.0), math.inf))
        row += count
    sides = {}
    for k, faces in enumerate(corners, start=row):
        distance, sides[k] = _mesh(faces, start[k], ways[k])
        found.append(distance[None])
    distances = torch.cat(found)
    way, first = torch.where(distances <= farthest, distances, math.inf).min(dim=0)
    points = origin + torch.where(torch.isfinite(way), way, 0.0)[:, None] * directions
    own = torch.einsum("ni,nij->nj", points - place[first], turn[first])
    normal = _normals(table[first, 15], half[first], own)
    for k, side in sides.items():
        normal = torch.where((first == k)[:, None], side, normal)
    return TensorHits(way, torch.einsum("nij,nj->ni", turn[first], normal), first)


def _span(kind: str, start: Any, ways: Any, half: Any) -> tuple[Any, Any]:
    """Return entry and exit distances of k shapes of one kind, shape (k, n); see `rays._span`."""
    import torch

    if kind == "plane":
        crossing = -start[:, None, 2] / _steep(ways[..., 2])
        falls = ways[..., 2] < 0.0
        return torch.where(falls, crossing, -math.inf), torch.where(falls, math.inf, crossing)
    if kind == "box":
        near, far = _slab(start[:, None], ways, half[:, None])
        return near.amax(dim=2), far.amin(dim=2)
    radius, reach = half[:, 0], half[:, 2]
    if kind == "sphere":
        return _quadric(start, ways, radius)
    barrel = _quadric(start[:, :2], ways[..., :2], radius)
    slab = _slab(start[:, None, 2], ways[..., 2], reach[:, None])
    enter, leave = torch.maximum(barrel[0], slab[0]), torch.minimum(barrel[1], slab[1])
    if kind == "cylinder":
        return enter, leave
    for sign in (-1.0, 1.0):
        centre = torch.zeros_like(start)
        centre[:, 2] = sign * reach
        near, far = _quadric(start - centre, ways, radius)
        apart = enter > leave
        met = near <= far
        enter = torch.where(apart, near, torch.where(met, torch.minimum(enter, near), enter))
        leave = torch.where(apart, far, torch.where(met, torch.maximum(leave, far), leave))
    return enter, leave


def _steep(way: Any) -> Any:
    """Return rates of a coordinate, next to nothing for none."""
    import torch

    return torch.where(way.abs() < _TINY, _FLAT, way)


def _slab(start: Any, way: Any, half: Any) -> tuple[Any, Any]:
    """Return the interval in which rays are between two levels of a coordinate."""
    import torch

    rate = _steep(way)
    a, b = (-half - start) / rate, (half - start) / rate
    return torch.minimum(a, b), torch.maximum(a, b)


def _quadric(start: Any, ways: Any, radius: Any) -> tuple[Any, Any]:
    """Return the interval in which rays are within a radius of the origin."""
    import torch

    square = (ways * ways).sum(dim=2)
    half = (ways * start[:, None]).sum(dim=2)
    rest = ((start * start).sum(dim=1) - radius * radius)[:, None]
    root = half * half - square * rest
    flat = square < _TINY
    reach, square = root.clamp(min=0.0).sqrt(), torch.where(flat, 1.0, square)
    passed = torch.where(flat, rest > 0.0, root < 0.0)
    near = torch.where(flat, -math.inf, (-half - reach) / square)
    far = torch.where(flat, math.inf, (-half + reach) / square)
    return torch.where(passed, math.inf, near), torch.where(passed, -math.inf, far)


def _normals(kind: Any, half: Any, points: Any) -> Any:
    """Return outward normals at points of the surface, own axes, shape (n, 3)."""
    import torch

    names = {name: (kind == k)[:, None] for k, name in enumerate(KINDS)}
    up = torch.zeros_like(points)
    up[:, 2] = 1.0
    scaled = points / half.clamp(min=1e-30)
    most = scaled.abs().argmax(dim=1, keepdim=True)
    side = (torch.arange(3, device=points.device) == most) * scaled.sign()
    radius, reach = half[:, 0], half[:, 2]
    out = points.clone()
    out[:, 2] -= torch.minimum(torch.maximum(points[:, 2], -reach), reach)
    aside = torch.hypot(points[:, 0], points[:, 1])
    capped = radius - aside > (reach - points[:, 2].abs()).abs()
    flat = torch.where(capped[:, None], up * points[:, 2:].sign(), points * (1.0 - up))
    out = torch.where(names["cylinder"], flat, out)
    out = out / out.norm(dim=1, keepdim=True).clamp(min=1e-30)
    return torch.where(names["plane"], up, torch.where(names["box"], side, out))


def _mesh(corners: Any, start: Any, ways: Any) -> tuple[Any, Any]:
    """Nearest triangle ahead and its normal towards the ray, own axes; see `rays._mesh`."""
    import torch

    best = torch.full((len(ways),), math.inf, dtype=ways.dtype, device=ways.device)
    normal = torch.zeros_like(ways)
    for part in corners.split(_FACES):
        first, second = part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]
        face = torch.linalg.cross(first, second)
        scale = -(ways @ face.T)
        offset = start - part[:, 0]
        turned = torch.linalg.cross(offset, first)
        u = ways @ torch.linalg.cross(second, offset).T / scale
        v = ways @ turned.T / scale
        way = (second * turned).sum(dim=1) / scale
        met = (scale.abs() > _TINY) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (way >= 0.0)
        way, nearest = torch.where(met, way, math.inf).min(dim=1)
        unit = face / face.norm(dim=1, keepdim=True).clamp(min=1e-30)
        normal = torch.where((way < best)[:, None], unit[nearest], normal)
        best = torch.minimum(best, way)
    return best, -(normal * ways).sum(dim=1, keepdim=True).sign() * normal
