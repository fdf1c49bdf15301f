"""Hulls cut into small cells: submerged share, its rate and its centroid."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.validation.hidden.rotation import Array, cross, matrix, multiply

# edges of a cell along the part's own axes [m]: fine along the usual vertical, or across a boom
CELL = {
    "box": (0.03, 0.03, 0.012),
    "cylinder": (0.025, 0.025, 0.012),
    "capsule": (0.012, 0.012, 0.03),
}


def _local_points(part: dict[str, Any], coarse: float) -> tuple[Array, float]:
    """Cell centres (3, k) in the part's own frame and the volume of one cell."""
    size, kind = np.asarray(part["size"], dtype=float), part["type"]
    if kind == "sphere":
        kind, size = "capsule", np.array([size[0], 0.0])
    if kind == "box":
        half = size / 2.0
    elif kind == "cylinder":
        half = np.array([size[0], size[0], size[1] / 2.0])
    else:
        half = np.array([size[0], size[0], size[1] / 2.0 + size[0]])
    edges = coarse * np.asarray(CELL.get(kind, (0.012, 0.012, 0.012)))
    counts = np.maximum(np.ceil(2.0 * half / edges).astype(int), 2)
    axes = [h * (2.0 * (np.arange(c) + 0.5) / c - 1.0) for h, c in zip(half, counts, strict=True)]
    points = np.stack([m.ravel() for m in np.meshgrid(*axes, indexing="ij")])
    unit = float(np.prod(2.0 * half / counts))
    flat = np.hypot(points[0], points[1])
    if kind == "cylinder":
        points = points[:, flat <= size[0]]
    elif kind == "capsule":
        over = np.maximum(np.abs(points[2]) - size[1] / 2.0, 0.0)
        points = points[:, np.hypot(flat, over) <= size[0]]
    return points, unit


def cells(parts: list[dict[str, Any]], *, coarse: float = 1.0) -> tuple[Array, Array]:
    """Cell centres (3, k) in the body and their shares (k,) of the whole volume."""
    places, weights = [], []
    for part in parts:
        points, unit = _local_points(part, coarse)
        roll, pitch, yaw = part["rpy"]
        turn = matrix(
            multiply(_about(2, yaw), multiply(_about(1, pitch), _about(0, roll)))[:, None]
        )[..., 0]
        places.append(turn @ points + np.asarray(part["position"], dtype=float)[:, None])
        weights.append(np.full(points.shape[1], unit))
    weight = np.concatenate(weights)
    return np.concatenate(places, axis=1), weight / weight.sum()


def _about(axis: int, angle: float) -> Array:
    q = np.zeros(4)
    q[0], q[1 + axis] = np.cos(angle / 2.0), np.sin(angle / 2.0)
    return q


def submerged(
    place: Array, share: Array, up: Array, *, surface: Array, thick: Array | float
) -> tuple[Array, Array, Array]:
    """Share under water (n,), its centroid (3, n) and the wet layer (k, n) of each case.

    Args:
        place: Cell centres in the body, (3, k, n).
        share: Share of the volume in each cell, (k, n).
        up: Height of each cell above the still water, (k, n) [m].
        surface: Elevation of the water above each cell, (k, n) [m].
        thick: Height over which a cell fills, (n,) or one [m].
    """
    fill = np.clip((surface - up) / thick + 0.5, 0.0, 1.0)
    wet = share * fill
    total = wet.sum(0)
    centroid = (place * wet).sum(1) / np.maximum(total, 1e-9)
    layer = np.where((fill > 0.0) & (fill < 1.0), share / thick, 0.0)
    return total, centroid, layer


def filling_rate(place: Array, layer: Array, turn: Array, velocity: Array, spin: Array) -> Array:
    """Rate of the submerged share (n,) of a hull moving with body velocity and spin (3, n)."""
    sink = -(turn[2] * velocity).sum(0)
    # the height of a cell falls with the part of spin x place along the vertical
    lever = cross(turn[2], spin)
    return (layer * (sink - (lever[:, None] * place).sum(0))).sum(0)
