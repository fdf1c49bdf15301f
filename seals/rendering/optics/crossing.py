"""Intersection of pixel rays with the water surface, and their submerged part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from seals.arrays import Array, namespace
from seals.rendering.optics.surface import Surface

FAR = 1e4
"""Stands for a line of sight that ends nowhere [m]."""
STEPS = 5
"""Steps in which a line of sight is searched for a moving surface."""


class Crossing(NamedTuple):
    """Submerged parts of pixel rays, shapes (N, H, W).

    Args:
        wet: whether they begin in the water.
        through: whether they meet the surface before they end.
        distance: where they meet it; where they end if they do not [m].
    """

    wet: Array
    through: Array
    distance: Array


def crossing(
    origins: Array, directions: Array, ranges: Array, surface: Surface, time: Array, *, port: float
) -> Crossing:
    """Find the first intersection of each pixel ray with the surface.

    Args:
        origins: of the lines, world [m], shape (N, 3).
        directions: unit, world [1], shape (N, H, W, 3).
        ranges: where the lines end [m], shape (N, H, W), finite.
        surface: water surface.
        time: [s].
        port: radius of the dome behind which the lines meet [m]: where a line leaves the dome
            decides whether it begins in the water.
    """
    xp = namespace(directions)
    oz, dz = origins[:, 2][:, None, None], directions[..., 2]
    above = oz + port * dz - surface.level
    wet, distance, through = _still(above, oz - surface.level, dz, ranges)
    if surface.reach == 0.0:
        return Crossing(wet, through, distance)
    # whether a ray enters the band of heights that the surface may reach
    low, high = -surface.reach, surface.reach
    end = oz + ranges * dz - surface.level
    near = ~(((above < low) & (end < low)) | ((above > high) & (end > high)))
    if bool(xp.any(near)):
        # rows of the images between the first and the last that the surface may cross. A camera
        # that looks ahead has the surface in one half of its picture. On an accelerator all rows
        # cost less than to wait for this answer
        if namespace(near) is not np:
            cut = slice(0, near.shape[1])
        else:
            found = np.flatnonzero(near.any(axis=(0, 2)))
            cut = slice(int(found[0]), int(found[-1]) + 1)
        line = (
            *(origins[:, k][:, None, None] for k in range(3)),
            *(directions[:, cut, :, k] for k in range(3)),
        )
        moved = _moving(line, ranges[:, cut], surface, time, port)
        still = wet, distance, through
        wet, distance, through = (_put(*pair, cut) for pair in zip(still, moved, strict=True))
    return Crossing(wet, through, distance)


def _put(whole: Array, part: Array, cut: slice) -> Array:
    """Return an image with some rows replaced."""
    if cut.start == 0 and cut.stop == whole.shape[1]:
        return part
    return np.concatenate([whole[:, : cut.start], part, whole[:, cut.stop :]], axis=1)


def _still(above: Array, height: Array, dz: Array, ranges: Array) -> tuple[Array, Array, Array]:
    """Crossing of a level surface: start under water, distance, and whether it is crossed."""
    xp = namespace(dz)
    wet = above < 0.0
    leads = xp.where(wet, dz, -dz) > 1e-9
    distance = -height / xp.where(leads, dz, 1.0)
    through = leads & (distance < ranges)
    return wet, xp.where(through, distance, ranges), through


def _moving(
    line: tuple[Array, ...], ranges: Array, surface: Surface, time: Array, port: float
) -> tuple[Array, Array, Array]:
    """Crossing of a moving surface: steps through its band of heights, then three secants."""
    xp = namespace(ranges)
    ox, oy, oz, dx, dy, dz = line

    def over(s: Array) -> Array:
        x, y = ox + s * dx, oy + s * dy
        return oz + s * dz - surface.height(x, y, time)

    start = over(xp.zeros_like(ranges) + port)
    wet = start < 0.0
    first, last = _band(oz - surface.level, dz, ranges, surface.reach, port)
    # where a line comes into the band, rounding must not put it on the other side
    a, fa = first, over(first)
    fa = xp.where((fa < 0.0) == wet, fa, -1e-9 * xp.astype(wet, fa.dtype))
    low, flow, high, fhigh = a, fa, ranges, xp.zeros_like(fa)
    found = xp.zeros_like(wet)
    for step in range(1, STEPS + 1):
        b = first + (last - first) * (step / STEPS) ** 2
        fb = over(b)
        turns = ((fa < 0.0) != (fb < 0.0)) & ~found
        low, flow = xp.where(turns, a, low), xp.where(turns, fa, flow)
        high, fhigh = xp.where(turns, b, high), xp.where(turns, fb, fhigh)
        found, a, fa = found | turns, b, fb
    for _ in range(3):
        gap = flow - fhigh
        middle = low + (high - low) * flow / xp.where(xp.abs(gap) < 1e-12, 1e-12, gap)
        middle = xp.clip(xp.where(found, middle, low), None, FAR)
        fm = over(middle)
        same = (fm < 0.0) == (flow < 0.0)
        low, flow = xp.where(same, middle, low), xp.where(same, fm, flow)
        high, fhigh = xp.where(same, high, middle), xp.where(same, fhigh, fm)
    distance = xp.where(xp.abs(flow) < xp.abs(fhigh), low, high)
    # a line so level that the search ended before it was through the band: the mean level's
    _, level, through = _still(start, oz - surface.level, dz, ranges)
    late = ~found & through & (level > last)
    return wet, xp.where(found, distance, xp.where(late, level, ranges)), found | late


def _band(
    height: Array, dz: Array, ranges: Array, reach: float, port: float
) -> tuple[Array, Array]:
    """Return the entry and exit distances of the band in which the surface moves [m]."""
    xp = namespace(dz)
    steep = xp.abs(dz) > 1e-6
    run = 1.0 / xp.where(steep, dz, 1e-6)
    one, two = (-reach - height) * run, (reach - height) * run
    first = xp.clip(xp.where(one < two, one, two), port, None)
    last = xp.where(one < two, two, one)
    first = xp.where(first < ranges, first, ranges)
    # level lines stay in the band for ever: far off, waves are finer than a pixel
    last = xp.where(last < ranges, last, ranges)
    near = first + 400.0 * reach
    last = xp.where(last < near, last, near)
    return first, xp.where(last > first, last, first)
