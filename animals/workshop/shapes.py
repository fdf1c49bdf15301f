"""Meshes of animals without mass: domed shells, and tubes of varying radius."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.robots.workshop.pieces import Piece

Outline = Callable[[float], tuple[float, float]]
"""Point x, y of a rim [m] at an angle from x [rad]."""


@dataclass(frozen=True, kw_only=True)
class Sculpted(Piece):
    """A closed surface given by its triangles; drawn only.

    Args:
        points: link axes [m], shape (n, 3).
        faces: three points each, anticlockwise from outside.
    """

    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    faces: Sequence[tuple[int, int, int]] = ()

    @property
    def volume(self) -> float:
        """Zero: other pieces displace the water [m^3]."""
        return 0.0

    def inertia(self) -> Floats:
        """Zero: it has no mass [kg m^2], shape (3, 3)."""
        return np.zeros((3, 3))

    def mesh(self) -> Any:
        """Triangles in link axes."""
        import trimesh

        return trimesh.Trimesh(self.points, list(self.faces), process=False)


def tube(
    path: Sequence[Sequence[float]],
    radii: Sequence[float],
    *,
    colour: str,
    flat: float = 1.0,
    corners: int = 8,
) -> Piece:
    """Return a tube along a line of points, round or flattened, closed at both ends.

    Args:
        path: points on its axis [m].
        radii: at those points [m].
        colour: name of its material.
        flat: width across the plane of the path and z over the height in it [1].
        corners: of its cross-section.
    """
    line = np.array(path, float)
    ways = np.gradient(line, axis=0)
    rings = []
    for point, way, radius in zip(line, ways, radii, strict=True):
        ahead = way / np.linalg.norm(way)
        side = np.cross([0.0, 0.0, 1.0], ahead)
        # a tube that points straight up keeps y at its side
        side = np.array([0.0, 1.0, 0.0]) if np.linalg.norm(side) < 1e-6 else side
        side = side / np.linalg.norm(side)
        turns = 2.0 * math.pi * np.arange(corners) / corners
        up = np.cross(ahead, side)
        across = np.outer(flat * np.cos(turns), side) + np.outer(np.sin(turns), up)
        rings.append(point + radius * across)
    return _closed(rings, line[0], line[-1], colour=colour)


def shell(
    outline: Outline,
    *,
    top: float,
    bottom: float,
    colour: str,
    corners: int = 32,
    rows: int = 4,
    solid: bool = False,
) -> Piece:
    """Return a shell over a rim: domed above, flatter below.

    Args:
        outline: of the rim.
        top: height of the dome [m].
        bottom: depth below the rim [m].
        colour: name of its material.
        corners: of the rim.
        rows: rings between rim and either pole.
        solid: whether it touches other things.
    """
    turns = 2.0 * math.pi * np.arange(corners) / corners
    rim = np.array([outline(turn) for turn in turns])
    rings = []
    for k in range(1 - rows, rows):
        height = math.sin(0.5 * math.pi * k / rows)
        # fuller than an ellipse: crabs are boxes with rounded edges
        share = (1.0 - abs(height) ** 3.0) ** (1.0 / 2.2)
        z = height * (top if k > 0 else bottom)
        rings.append(np.column_stack((share * rim, np.full(corners, z))))
    low, high = (np.array([0.0, 0.0, z]) for z in (-bottom, top))
    return _closed(rings, low, high, colour=colour, solid=solid)


def _closed(
    rings: Sequence[Floats], first: Floats, last: Floats, *, colour: str, solid: bool = False
) -> Piece:
    """Join rings of one count of points, with a point at either end."""
    count = len(rings[0])
    points = np.concatenate([*rings, [first], [last]])
    faces = []
    for k in range(len(rings) - 1):
        for i in range(count):
            a, b = k * count + i, k * count + (i + 1) % count
            faces += [(a, b, a + count), (b, b + count, a + count)]
    end, tip = len(rings) * count, (len(rings) - 1) * count
    for i in range(count):
        j = (i + 1) % count
        faces += [(end, j, i), (end + 1, tip + i, tip + j)]
    return Sculpted(
        kind="sculpted", size=(), points=points, faces=faces, colour=colour, solid=solid
    )
