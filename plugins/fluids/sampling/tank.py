"""Boundary samples of tank walls and floors, outside the fluid."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.sampling.faces import PITCH
from seals.plugins.fluids.sampling.samples import Samples

WALL = 1
"""Layers of a wall: one stands for all that lies behind it."""

SIDES = ("x_low", "x_high", "y_low", "y_high", "z_low", "z_high")
"""Sides of a box, in order of axis and end."""


def box_walls(
    lower: Floats, upper: Floats, spacing: float, *, closed: Collection[str] = SIDES[:5]
) -> Samples:
    """Sample the walls of a box from outside, in a fine layer half a spacing behind each face.

    Args:
        lower: corner of the inside [m], shape (3,).
        upper: opposite corner [m], shape (3,).
        spacing: [m].
        closed: sides that have a wall; all but the lid.

    Example:
        >>> walls = box_walls(np.zeros(3), np.ones(3), 0.1)
        >>> bool(np.isclose(walls.points[:, 2].min(), -0.05))
        True
    """
    cells = np.round((upper - lower) / spacing).astype(int)
    exact = (upper - lower) / cells
    # a finer lattice whose outermost places lie half a spacing behind the faces
    first, last = lower - 0.5 * exact, upper + 0.5 * exact
    counts = np.round((last - first) / (PITCH * exact)).astype(int) - 1
    step = (last - first) / (counts + 1)
    index = np.stack(
        np.meshgrid(*(np.arange(-WALL, n + WALL) for n in counts), indexing="ij"), -1
    ).reshape(-1, 3)
    low, high = index < 0, index >= counts
    behind = np.stack([low, high], -1).reshape(len(index), 6)
    shut = np.array([side in closed for side in SIDES])
    kept = (behind & shut).any(axis=1) & ~(behind & ~shut).any(axis=1)
    points = first + step * (index[kept] + 1)
    share = exact.prod() * PITCH**2
    return Samples(points, np.full(len(points), float(share)))
