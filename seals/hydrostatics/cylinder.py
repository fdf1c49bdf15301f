"""Cylinder and capsule cut by the water surface at any tilt.

The closed forms of a cylinder and a hemisphere cut by an oblique plane work in the plane of the
body's axis e and the surface normal n, with c = e . n and s = sqrt(1 - c^2), and are written once
for floats and for columns.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

from seals.hydrostatics.placed import HullPlaced, Triple, checked_size
from seals.hydrostatics.wetted import Column, Sums

HALF_PI = 0.5 * math.pi
LEAST_TILT = 3e-4
"""Smallest ratio of axial to radial height span. Below it a cylinder is treated as tilted by this
ratio (volume wrong by less than 1e-6 of itself) with its axial moments reduced in proportion,
because the closed form divides differences by the span squared."""


class _Part(NamedTuple):
    """Volume, area and first moments about the body's centre, along axis and normal.

    ``volume_e`` and ``area_e`` multiply the axis e; ``volume_n`` and ``area_n`` the normal n.
    """

    volume: Column
    volume_e: Column
    volume_n: Column
    area: Column
    area_e: Column
    area_n: Column


def _chord_integrals(xp: Any, x: Column) -> tuple[Column, Column, Column]:
    """Return the integrals of 2 sqrt(1 - x^2) times 1, x, x^2 from the disc's centre to ``x``."""
    squared = (1.0 - x) * (1.0 + x)
    # x sqrt(1 - x^2) + asin x, -2/3 (1 - x^2)^(3/2), (asin x - x sqrt(1 - x^2) (1 - 2 x^2)) / 4;
    # the product in `squared` keeps digits that 1 - x^2 would lose near the rim
    root = xp.sqrt(squared)
    half, angle = x * root, xp.asin(x)
    second = 0.25 * (angle + half * (1.0 - 2.0 * squared))
    return half + angle, (-2.0 / 3.0) * squared * root, second


def _flat_ended(  # noqa: PLR0917 - positional, in the hot path
    xp: Any, c: Column, s: Column, depth: Column, radius: float, length: float
) -> _Part:
    """Return the wetted part of a flat-ended cylinder.

    Equation: chord width 2 sqrt(R^2 - x^2) times the wetted axial length
        clip((depth - s x) / |c| + L/2, 0, L), integrated over the radial coordinate x.

    Args:
        xp: array namespace or ``FLOATS``.
        c: cosine between axis and normal.
        s: sine between them, not negative.
        depth: height of the surface above the centre [m].
        radius: [m].
        length: [m].
    """
    one = depth * 0.0 + 1.0
    # upright, s = 0: the surface passes the radial coordinate at once, over a width of rounding
    r = xp.maximum(s * radius, one * (1e-9 * (radius + length)))
    true = xp.abs(c) * length
    w = xp.maximum(true, r * LEAST_TILT)
    p = depth + 0.5 * w
    # chords below `low` are wet over the whole length, those above `high` dry
    low = xp.maximum(xp.minimum((p - w) / r, one), -one)
    high = xp.maximum(xp.minimum(p / r, one), -one)
    a0, a1, a2 = _chord_integrals(xp, low)
    b0, b1, b2 = _chord_integrals(xp, high)
    g, k = p / w, r / w
    d0, d1, d2 = b0 - a0, b1 - a1, b2 - a2
    # between them the wetted share of the length is g - k x
    ramp = g * d0 - k * d1
    across = a1 + g * d1 - k * d2
    # int chord (u^2 - u) / 2 with u = g - k x, from the middle of the length
    axial = 0.5 * (g * (ramp - d0) - k * (g * d1 - k * d2 - d1))
    size = radius * radius * length
    volume = size * (a0 + HALF_PI + ramp)
    area = size * d0 / w
    # the axial moments fall linearly to zero as the axis becomes horizontal, with the sign of c
    lever = c * (length * length) / w
    radial, radial_area = (size * radius) * across, (size * radius) * d1 / w
    normal, normal_area = radial * (radius / r), radial_area * (radius / r)
    return _Part(
        volume,
        size * axial * lever - normal * c,
        normal,
        area,
        size * (ramp - 0.5 * d0) / w * lever - normal_area * c,
        normal_area,
    )


def _half_ball(xp: Any, c: Column, s: Column, depth: Column, radius: float) -> _Part:
    """Return the wetted part of the hemisphere on the side of +e, about the sphere's centre.

    Equation: the divergence theorem. 3 V = depth * A_w + R * S, where A_w is the segment of the
        waterplane disc inside the half ball and S the wetted spherical surface,
        S = 2 R^2 (d phi + atan2(s w, c)), d = depth / R, phi the half angle of the segment,
        w = sqrt(1 - (d / s)^2). First moment: e J(flat face) - n J(waterplane), with
        J = (2/3) integral of (rho^2 - x^2)^(3/2) over the segment of a disc of radius rho.

    Args:
        xp: array namespace or ``FLOATS``.
        c: cosine between axis and normal.
        s: sine between them, positive.
        depth: height of the surface above the ball's centre [m].
        radius: [m].
    """
    one = depth * 0.0 + 1.0
    # a hair inside the poles, where the angles below would be atan2(0, 0); costs 1e-28 of V
    most = one - 1e-14
    d = xp.maximum(xp.minimum(depth / radius, most), -most)
    # radius of the waterplane disc, and half angle of the segment of the flat face
    rho_squared = (1.0 - d) * (1.0 + d)
    rho = xp.sqrt(rho_squared)
    flat = xp.maximum(xp.minimum(d / s, one), -one)
    flat_squared = (1.0 - flat) * (1.0 + flat)
    flat_root = xp.sqrt(flat_squared)
    # line in which the surface meets the flat face, from the centre of the waterplane disc
    v = xp.maximum(xp.minimum(-d * c / s, rho), -rho)
    chord_squared = (rho - v) * (rho + v)
    chord = xp.sqrt(chord_squared)
    phi = xp.atan2(chord, v)
    segment = rho_squared * phi - v * chord
    surface = 2.0 * (d * phi + xp.atan2(s * flat_root, c))
    j_water = 0.25 * (rho_squared * segment - (2.0 / 3.0) * v * chord_squared * chord)
    # (2/3) int (1 - x^2)^(3/2) dx from -1 to `flat`, in closed form
    j_flat = (flat * flat_root * (2.5 - flat * flat) + 1.5 * (xp.asin(flat) + HALF_PI)) / 6.0
    square = radius * radius
    along = (2.0 / 3.0) * square * radius * chord_squared * chord / s
    return _Part(
        (square * radius / 3.0) * (d * segment + surface),
        (square * square) * j_flat,
        -(square * square) * j_water,
        square * segment,
        along,
        square * radius * segment * d - along * c,
    )


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
    part: _Part, axis: Triple, centre: Triple, ux: Column, uy: Column, uz: Column
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

    Equation: see :func:`_flat_ended`.

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
        part = _flat_ended(xp, c, s, depth, self.radius, self.length)
        return _in_link(part, axis, centre, ux, uy, uz)


class HullCapsule(_Rod):
    """Hull of a capsule (cylinder with hemispherical ends), axis along its own z.

    Equation: a flat-ended cylinder and two half balls.

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
        body = _flat_ended(xp, c, s, depth, self.radius, self.length)
        head = _half_ball(xp, c, s, depth - c * half, self.radius)
        tail = _half_ball(xp, -c, s, depth + c * half, self.radius)
        whole = _Part(
            body.volume + head.volume + tail.volume,
            body.volume_e + head.volume_e - tail.volume_e + half * (head.volume - tail.volume),
            body.volume_n + head.volume_n + tail.volume_n,
            body.area + head.area + tail.area,
            body.area_e + head.area_e - tail.area_e + half * (head.area - tail.area),
            body.area_n + head.area_n + tail.area_n,
        )
        return _in_link(whole, axis, centre, ux, uy, uz)
