"""Sphere cut by the water surface, in closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from seals.hydrostatics.placed import HullPlaced, checked_size
from seals.hydrostatics.wetted import Column, Sums


class HullSphere(HullPlaced):
    """Hull of a sphere; its wetted part is a spherical cap.

    Equation: with h = the wetted height, V = pi h^2 (3 r - h) / 3, first moment along the normal
        about the centre -pi (r^2 - d^2)^2 / 4, waterplane area pi (r^2 - d^2), d the signed
        height of the surface above the centre.

    Args:
        radius: [m].
        position: centre in link axes [m].

    Raises:
        RobotError: a dimension is not positive and finite.

    Example:
        >>> ball = HullSphere(radius=0.5)
        >>> round(ball.wetted((0, 0, 1), 0.0).volume / ball.volume, 12)
        0.5
    """

    def __init__(self, *, radius: float, position: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
        self.radius = checked_size("radius", radius)
        whole = 4.0 / 3.0 * math.pi * self.radius**3
        super().__init__(volume=whole, radius=self.radius, position=position, rpy=(0.0, 0.0, 0.0))

    def sums(self, xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        """Return volume, area and first moments about the link origin (see the base class)."""
        px, py, pz = self.position
        radius = self.radius
        edge = level * 0.0 + radius
        depth = level - (ux * px + uy * py + uz * pz)
        # wholly dry or wholly wet beyond
        depth = xp.maximum(xp.minimum(depth, edge), -edge)
        height = depth + radius
        # cap of height h = r + d: 3 r - h = 2 r - d, and r^2 - d^2 = h (r - d)
        volume = (math.pi / 3.0) * height * height * (2.0 * radius - depth)
        area = math.pi * height * (radius - depth)
        along = area * area * (-0.25 / math.pi)
        level_area = area * depth
        return Sums(
            volume,
            volume * px + along * ux,
            volume * py + along * uy,
            volume * pz + along * uz,
            area,
            area * px + level_area * ux,
            area * py + level_area * uy,
            area * pz + level_area * uz,
        )
