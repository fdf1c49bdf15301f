"""Mesh of the open sea: fine near the robot, coarser with distance, with a cut-out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering.optics import Surface

FINE = 0.06
"""Edge of the cells about the robot [m]."""
GROWTH = 1.06
"""Ratio of neighbouring cells outside [1]."""
FAR = 600.0
"""How far the mesh goes [m]."""
CALM = (25.0, 60.0)
"""From where to where waves fade, because cells there are longer than they are [m]."""

Box = tuple[tuple[float, float], tuple[float, float]]


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
    points = np.stack([east, north, calmed(surface, east, north, time, fine)], axis=-1)
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1), indexing="ij")
    kept = np.ones(i.shape, dtype=bool)
    if hole:
        inside = (i >= first_x) & (i < last_x) & (j >= first_y) & (j < last_y)
        kept = ~inside
    a = (i * len(y) + j)[kept]
    b, c, d = a + len(y), a + len(y) + 1, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return points.reshape(-1, 3), triangles.astype(np.int64)


def calmed(surface: Surface, x: Floats, y: Floats, time: float, fine: Box) -> Floats:
    """Return heights of the sea [m], with waves fading out where the mesh is coarse."""
    middle = [0.5 * (low + high) for low, high in fine]
    distance = np.hypot(x - middle[0], y - middle[1])
    near, far = CALM
    share = np.clip((far - distance) / (far - near), 0.0, 1.0)
    height = np.asarray(surface.height(x, y, time), dtype=float)
    found: Floats = surface.level + share * (height - surface.level)
    return found


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
