"""Closed forms of a cylinder and a hemisphere cut by an oblique plane.

Both work in the plane of the body's axis e and the surface normal n, with c = e . n and
s = sqrt(1 - c^2), and are written once for floats and for columns.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from seals.hydrostatics.wetted import Column

HALF_PI = 0.5 * math.pi
LEAST_TILT = 3e-4
"""Smallest ratio of axial to radial height span. Below it a cylinder is treated as tilted by this
ratio (volume wrong by less than 1e-6 of itself) with its axial moments reduced in proportion,
because the closed form divides differences by the span squared."""


class Part(NamedTuple):
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
    root = xp.sqrt(squared)
    half, angle = x * root, xp.asin(x)
    second = 0.25 * (angle + half * (1.0 - 2.0 * squared))
    return half + angle, (-2.0 / 3.0) * squared * root, second


def flat_ended(  # noqa: PLR0917 - positional, in the hot path
    xp: Any, c: Column, s: Column, depth: Column, radius: float, length: float
) -> Part:
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
    r = xp.maximum(s * radius, one * (1e-9 * (radius + length)))
    true = xp.abs(c) * length
    w = xp.maximum(true, r * LEAST_TILT)
    p = depth + 0.5 * w
    low = xp.maximum(xp.minimum((p - w) / r, one), -one)
    high = xp.maximum(xp.minimum(p / r, one), -one)
    a0, a1, a2 = _chord_integrals(xp, low)
    b0, b1, b2 = _chord_integrals(xp, high)
    g, k = p / w, r / w
    d0, d1, d2 = b0 - a0, b1 - a1, b2 - a2
    ramp = g * d0 - k * d1
    across = a1 + g * d1 - k * d2
    axial = 0.5 * (g * (ramp - d0) - k * (g * d1 - k * d2 - d1))
    size = radius * radius * length
    volume = size * (a0 + HALF_PI + ramp)
    area = size * d0 / w
    # the axial moments fall linearly to zero as the axis becomes horizontal, with the sign of c
    lever = c * (length * length) / w
    radial, radial_area = (size * radius) * across, (size * radius) * d1 / w
    normal, normal_area = radial * (radius / r), radial_area * (radius / r)
    return Part(
        volume,
        size * axial * lever - normal * c,
        normal,
        area,
        size * (ramp - 0.5 * d0) / w * lever - normal_area * c,
        normal_area,
    )


def half_ball(xp: Any, c: Column, s: Column, depth: Column, radius: float) -> Part:
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
    rho_squared = (1.0 - d) * (1.0 + d)
    rho = xp.sqrt(rho_squared)
    flat = xp.maximum(xp.minimum(d / s, one), -one)
    flat_squared = (1.0 - flat) * (1.0 + flat)
    flat_root = xp.sqrt(flat_squared)
    v = xp.maximum(xp.minimum(-d * c / s, rho), -rho)
    chord_squared = (rho - v) * (rho + v)
    chord = xp.sqrt(chord_squared)
    phi = xp.atan2(chord, v)
    segment = rho_squared * phi - v * chord
    surface = 2.0 * (d * phi + xp.atan2(s * flat_root, c))
    j_water = 0.25 * (rho_squared * segment - (2.0 / 3.0) * v * chord_squared * chord)
    j_flat = (flat * flat_root * (2.5 - flat * flat) + 1.5 * (xp.asin(flat) + HALF_PI)) / 6.0
    square = radius * radius
    along = (2.0 / 3.0) * square * radius * chord_squared * chord / s
    return Part(
        (square * radius / 3.0) * (d * segment + surface),
        (square * square) * j_flat,
        -(square * square) * j_water,
        square * segment,
        along,
        square * radius * segment * d - along * c,
    )
