"""Boundary samples of tank walls and floors, outside the fluid."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from seals.arrays import Floats
from seals.plugins.fluids.sampling.shapes import PITCH, Samples

WALL = 1
"""Layers of a wall: one stands for all that lies behind it."""

SIDES = ("x_low", "x_high", "y_low", "y_high", "z_low", "z_high")
"""Sides of a box, in order of axis and end."""


def fewest_places(cells: tuple[int, int, int], *, closed: Collection[str] = SIDES[:5]) -> int:
    """Return the least number of samples of the walls of a box, without sampling them.

    Args:
        cells: spacings along each side.
        closed: sides that have a wall.

    Example:
        >>> fewest_places((10, 10, 10)) <= len(box_walls(np.zeros(3), np.ones(3), 0.1).points)
        True
    """
    x, y, z = map(int, cells)
    faces = dict(zip(SIDES, (y * z, y * z, x * z, x * z, x * y, x * y), strict=True))
    return int(sum(faces[side] for side in closed) / PITCH**2)


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
    shut = np.array([side in closed for side in SIDES])
    across = np.meshgrid(*(np.arange(-WALL, n + WALL) for n in counts[1:]), indexing="ij")
    plane = np.stack([np.zeros_like(across[0]), *across], -1).reshape(-1, 3)
    found = []
    # one plane after the other: all places of the inside at once would take the room of its volume
    for k in range(-WALL, counts[0] + WALL):
        plane[:, 0] = k
        behind = np.stack([plane < 0, plane >= counts], -1).reshape(len(plane), 6)
        found.append(plane[(behind & shut).any(axis=1) & ~(behind & ~shut).any(axis=1)])
    index = np.concatenate(found)
    points = first + step * (index + 1)
    share = exact.prod() * PITCH**2
    return Samples(points, np.full(len(points), float(share)))
