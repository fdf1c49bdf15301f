"""Cylinder and capsule cut by the water surface at any tilt."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from seals.hydrostatics.placed import HullPlaced, Triple, checked_size
from seals.hydrostatics.revolution import Part, flat_ended, half_ball
from seals.hydrostatics.wetted import Column, Sums

LEAST_SINE = 1e-9
"""Least sine between axis and normal; the moments that it divides vanish with it."""


def _seen_by_axis(  # noqa: PLR0917 - positional, in the hot path
    xp: Any, axis: Triple, centre: Triple, ux: Column, uy: Column, uz: Column, level: Column
) -> tuple[Column, Column, Column]:
    """Return cosine and sine between axis and normal, and the surface's height [m]."""
    ex, ey, ez = axis
    c = ux * ex + uy * ey + uz * ez
    # the cross product keeps the sine accurate where 1 - c^2 would cancel
    x, y, z = uy * ez - uz * ey, uz * ex - ux * ez, ux * ey - uy * ex
    s = xp.sqrt(x * x + y * y + z * z + LEAST_SINE**2)
    depth = level - (ux * centre[0] + uy * centre[1] + uz * centre[2])
    return c, s, depth


def _in_link(  # noqa: PLR0917 - positional, in the hot path
    part: Part, axis: Triple, centre: Triple, ux: Column, uy: Column, uz: Column
) -> Sums:
    """Convert sums along axis and normal to sums about the link origin."""
    volume, along, up, area, area_along, area_up = part
    (px, py, pz), (ex, ey, ez) = centre, axis
    return Sums(
        volume,
        volume * px + along * ex + up * ux,
        volume * py + along * ey + up * uy,
        volume * pz + along * ez + up * uz,
        area,
        area * px + area_along * ex + area_up * ux,
        area * py + area_along * ey + area_up * uy,
        area * pz + area_along * ez + area_up * uz,
    )


class _Rod(HullPlaced):
    """Base of hulls with a radius and a length [m] along their own z."""

    def __init__(
        self,
        *,
        radius: float,
        length: float,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rpy: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        self.radius = checked_size("radius", radius)
        self.length = checked_size("length", length)
        volume, reach = self._measures()
        super().__init__(volume=volume, radius=reach, position=position, rpy=rpy)

    @abstractmethod
    def _measures(self) -> tuple[float, float]:
        """Volume [m^3], and radius about the centre that holds it [m]."""


class HullCylinder(_Rod):
    """Hull of a circular cylinder, axis along its own z.

    Equation: see :func:`seals.hydrostatics.revolution.flat_ended`.

    Args:
        radius: [m].
        length: [m].
        position: centre in link axes [m].
        rpy: roll, pitch, yaw in the link [rad].

    Raises:
        RobotError: a dimension is not positive and finite.

    Example:
        >>> can = HullCylinder(radius=0.1, length=0.4)
        >>> round(can.wetted((0, 0, 1), 0.1).volume / can.volume, 12)
        0.75
    """

    def _measures(self) -> tuple[float, float]:
        volume = math.pi * self.radius**2 * self.length
        return volume, math.hypot(self.radius, 0.5 * self.length)

    def sums(self, xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        """Return volume, area and first moments about the link origin (see the base class)."""
        axis, centre = self.axes[2], self.position
        c, s, depth = _seen_by_axis(xp, axis, centre, ux, uy, uz, level)
        part = flat_ended(xp, c, s, depth, self.radius, self.length)
        return _in_link(part, axis, centre, ux, uy, uz)


class HullCapsule(_Rod):
    """Hull of a capsule (cylinder with hemispherical ends), axis along its own z.

    Equation: a flat-ended cylinder and two half balls, see :mod:`seals.hydrostatics.revolution`.

    Args:
        radius: [m].
        length: of the straight part [m].
        position: centre in link axes [m].
        rpy: roll, pitch, yaw in the link [rad].

    Raises:
        RobotError: a dimension is not positive and finite.

    Example:
        >>> pill = HullCapsule(radius=0.1, length=0.4, rpy=(0, 1.5707963267948966, 0))
        >>> round(pill.wetted((0, 0, 1), 0.0).volume / pill.volume, 12)
        0.5
    """

    def _measures(self) -> tuple[float, float]:
        volume = math.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius)
        return volume, self.radius + 0.5 * self.length

    def sums(self, xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        """Return volume, area and first moments about the link origin (see the base class)."""
        axis, centre, half = self.axes[2], self.position, 0.5 * self.length
        c, s, depth = _seen_by_axis(xp, axis, centre, ux, uy, uz, level)
        body = flat_ended(xp, c, s, depth, self.radius, self.length)
        head = half_ball(xp, c, s, depth - c * half, self.radius)
        tail = half_ball(xp, -c, s, depth + c * half, self.radius)
        whole = Part(
            body.volume + head.volume + tail.volume,
            body.volume_e + head.volume_e - tail.volume_e + half * (head.volume - tail.volume),
            body.volume_n + head.volume_n + tail.volume_n,
            body.area + head.area + tail.area,
            body.area_e + head.area_e - tail.area_e + half * (head.area - tail.area),
            body.area_n + head.area_n + tail.area_n,
        )
        return _in_link(whole, axis, centre, ux, uy, uz)
