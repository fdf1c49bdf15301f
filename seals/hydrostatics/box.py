"""Box cut by the water surface, in closed form at any tilt."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from seals.hydrostatics.placed import HullPlaced, checked_size, checked_triple
from seals.hydrostatics.wetted import FLOATS, Column, Sums

GAUSS = 0.5 / math.sqrt(3.0)
"""Offset of the two Gauss points from the middle of a unit interval (exact to degree 3)."""
LEAST_WIDTH = 1e-6
"""Least share of one edge in the height span of the tilted box. A flatter edge counts as this flat
(volume wrong by less than 1e-6), its lever shrinking in proportion, so that righting moments stay
exactly odd in the tilt."""


class _Slice(NamedTuple):
    """Wetted fraction of a rectangle and of its waterline, with first moments about its centre."""

    volume: Column
    volume_y: Column
    volume_z: Column
    area: Column
    area_y: Column
    area_z: Column


def _wet_rectangle(  # noqa: PLR0917 - positional, it is called six times per step
    xp: Any, q: Column, a: Column, b: Column, zero: Column, one: Column
) -> _Slice:
    """Return the part a y + b z <= q of the unit square, 0 < a <= b, moments about its centre.

    Equation: the wetted length along z is 1 for y < y1 and (q - a y) / b for y1 < y < y2.
    """
    per_a, per_b = 1.0 / a, 1.0 / b
    ratio = a * per_b
    q = q * per_b
    y1 = xp.maximum(xp.minimum((q - 1.0) * (b * per_a), one), zero)
    y2 = xp.maximum(xp.minimum(q * (b * per_a), one), zero)
    d, middle = y2 - y1, 0.5 * (y1 + y2) - 0.5
    line = d * per_b
    # on the ramp from y1 to y2 the wetted length is linear, h = mean - ratio (y - middle)
    mean = q - ratio * (middle + 0.5)
    # -int (y - middle) h dy = d skew
    skew = d * d * (ratio * (1.0 / 12.0))
    strip = d * mean
    return _Slice(
        y1 + strip,
        0.5 * y1 * (y1 - 1.0) + d * (middle * mean - skew),
        # int (h^2 - h) / 2 over the ramp; where all is wet, h = 1, it vanishes
        0.5 * (d * (mean * mean + ratio * skew) - strip),
        line,
        line * middle,
        line * (mean - 0.5),
    )


class HullBox(HullPlaced):
    """Hull of a rectangular box.

    Equation: slices at constant x are wetted rectangles (:func:`_wet_rectangle`), polynomial in x
        between the heights where the surface passes an edge; two Gauss points integrate each piece
        exactly.

    Args:
        size: full edges x, y, z [m].
        position: centre in link axes [m].
        rpy: roll, pitch, yaw in the link [rad].

    Raises:
        RobotError: an edge is not positive and finite.

    Example:
        >>> crate = HullBox(size=(0.4, 0.2, 0.1))
        >>> round(crate.wetted((0, 0, 1), 0.025).volume / crate.volume, 9)
        0.75
    """

    def __init__(
        self,
        *,
        size: Sequence[float],
        position: Sequence[float] = (0.0, 0.0, 0.0),
        rpy: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        x, y, z = (checked_size("size", edge) for edge in checked_triple("size", size))
        self.size = (x, y, z)
        radius = 0.5 * math.hypot(x, y, z)
        super().__init__(volume=x * y * z, radius=radius, position=position, rpy=rpy)

    def sums(self, xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        """Return volume, area and first moments about the link origin (see the base class)."""
        px, py, pz = self.position
        depth = level - (ux * px + uy * py + uz * pz)
        spans = [
            (ux * x + uy * y + uz * z) * edge
            for (x, y, z), edge in zip(self.axes, self.size, strict=True)
        ]
        share, along, area, area_along = _wet_box(xp, spans, depth)
        volume, flat = share * self.volume, area * self.volume
        scaled = [
            tuple(edge * e * self.volume for e in axis)
            for axis, edge in zip(self.axes, self.size, strict=True)
        ]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = scaled
        (m0, m1, m2), (s0, s1, s2) = along, area_along
        return Sums(
            volume,
            volume * px + m0 * ax + m1 * bx + m2 * cx,
            volume * py + m0 * ay + m1 * by + m2 * cy,
            volume * pz + m0 * az + m1 * bz + m2 * cz,
            flat,
            flat * px + s0 * ax + s1 * bx + s2 * cx,
            flat * py + s0 * ay + s1 * by + s2 * cy,
            flat * pz + s0 * az + s1 * bz + s2 * cz,
        )


def _wet_box(
    xp: Any, spans: Sequence[Column], depth: Column
) -> tuple[Column, list[Column], Column, list[Column]]:
    """Return the wetted fraction of a unit box with its moments, and their derivatives by depth.

    Args:
        xp: array namespace or ``FLOATS``.
        spans: signed height span of each edge [m]: normal component times edge length.
        depth: height of the surface above the centre [m].
    """
    heights = [xp.abs(span) for span in spans]
    least = (heights[0] + heights[1] + heights[2]) * LEAST_WIDTH
    wx, wy, wz = (xp.maximum(height, least) for height in heights)
    # the slice's form holds for a <= b: y and z are exchanged, and its moments back below
    a, b = xp.minimum(wy, wz), xp.maximum(wy, wz)
    top = depth + 0.5 * (wx + a + b)
    full, sums = _gauss_sums(xp, top, wx, a, b)
    share, x, y, z, area, area_x, area_y, area_z = sums
    # whole slices from 0 to `full`: int (x - 1/2) dx
    share, x = share + full, x + 0.5 * full * (full - 1.0)
    swap = wy > wz
    # below one for an edge flatter than the least: its lever vanishes with it
    signs = [span / width for span, width in zip(spans, (wx, wy, wz), strict=True)]
    along = (x, xp.where(swap, z, y), xp.where(swap, y, z))
    flat = (area_x, xp.where(swap, area_z, area_y), xp.where(swap, area_y, area_z))
    return (
        share,
        [moment * sign for moment, sign in zip(along, signs, strict=True)],
        area,
        [moment * sign for moment, sign in zip(flat, signs, strict=True)],
    )


def _gauss_sums(
    xp: Any, top: Column, wx: Column, a: Column, b: Column
) -> tuple[Column, list[Column]]:
    """Return the share of full slices, and the eight sums over the slices that are partly wet."""
    zero = 0.0 * top
    one = zero + 1.0
    knots = [
        xp.maximum(xp.minimum(offset / wx, one), zero)
        for offset in (top - (a + b), top - b, top - a, top)
    ]
    # between knots a slice is a quadratic in x, its moment a cubic: two Gauss points are exact
    places, weights = [], []
    for low, high in itertools.pairwise(knots):
        length, middle = high - low, 0.5 * (low + high)
        places += [middle - GAUSS * length, middle + GAUSS * length]
        weights += [0.5 * length, 0.5 * length]
    if xp is FLOATS:
        rows = [_terms(xp, top, wx, a, b, x, w) for x, w in zip(places, weights, strict=True)]
        return knots[0], [sum(column) for column in zip(*rows, strict=True)]
    # one pass over all six points: fewer, longer array operations
    terms = _terms(xp, top, wx, a, b, xp.stack(places), xp.stack(weights))
    return knots[0], [xp.sum(term, axis=0) for term in terms]


def _terms(  # noqa: PLR0917
    xp: Any, top: Column, wx: Column, a: Column, b: Column, x: Column, weight: Column
) -> tuple[Column, ...]:
    """Return the weighted contributions of the slices at ``x`` from 0 to 1."""
    zero = 0.0 * x
    s = _wet_rectangle(xp, top - wx * x, a, b, zero, zero + 1.0)
    volume, area, off = s.volume * weight, s.area * weight, x - 0.5
    return (
        volume,
        volume * off,
        s.volume_y * weight,
        s.volume_z * weight,
        area,
        area * off,
        s.area_y * weight,
        s.area_z * weight,
    )
