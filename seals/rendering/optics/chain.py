"""Chain of image formation steps, from a rendered image to the underwater image."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from array_api_compat import device

from seals.arrays import Array, namespace
from seals.rendering.optics import blur, caustics
from seals.rendering.optics.crossing import FAR, Crossing, crossing
from seals.rendering.optics.interface import INDEX, fresnel
from seals.rendering.optics.path import Medium, channels
from seals.rendering.optics.sky import sky
from seals.rendering.optics.surface import Surface, SurfaceSmooth, SurfaceStill

if TYPE_CHECKING:
    from seals.rendering.optics.optics import Optics, Sight

AT_ONCE = 1 << 16
"""Pixels that a processor works on together: their planes stay in its cache."""


class _Lines(NamedTuple):
    """Pixel rays and their quantities for the image formation steps, shapes (N, H, W).

    Args:
        hit: whether there is something at the end.
        ends: length [m], `FAR` where there is nothing.
        rise: upward component of the direction [1].
        cross: how they lie to the water.
        length: wet part [m].
        start: depth where that begins [m].
        depth: of the end [m], zero or more.
        under: whether the end is in the water.
    """

    hit: Array
    ends: Array
    rise: Array
    cross: Crossing
    length: Array
    start: Array
    depth: Array
    under: Array


def seen(optics: Optics, medium: Medium, view: Sight, surface: Surface, time: Array) -> Array:
    """Return the image of views, linear radiance, shape (N, H, W, 3)."""
    xp = namespace(view.colour)
    views, rows, columns, _ = view.colour.shape
    few = max(1, AT_ONCE // (rows * columns))
    if xp is np:
        _settled()
    if str(device(view.colour)) != "cpu" or views <= few:
        return _seen(optics, medium, view, surface, time)
    parts = []
    for first in range(0, views, few):
        some = [None if x is None else x[first : first + few] for x in view]
        when = time if isinstance(time, int | float) else time[first : first + few]
        parts.append(_seen(optics, medium, type(view)(*some), surface, when))
    return xp.concat(parts, axis=0)


@functools.cache
def _settled() -> None:
    """Keep freed memory in the C library's heap for the next image.

    Its threshold follows the largest block that was ever freed; without this a third of the time
    goes into fetching pages anew.
    """
    np.empty(30 << 20, dtype=np.uint8)


def _seen(optics: Optics, medium: Medium, view: Sight, surface: Surface, time: Array) -> Array:
    xp = namespace(view.colour)
    when = time if isinstance(time, int | float) else xp.reshape(time, (-1, 1, 1))
    lines = _lines(optics, view, surface, when)
    planes = xp.stack([view.colour[..., k] for k in range(3)])
    planes = planes * medium.transmission(lines.length, lines.depth)
    light = _light(optics, view, lines, surface, time)
    planes = planes * (1.0 + xp.astype(lines.under, planes.dtype) * (light - 1.0))
    crosses = optics.surface and bool(xp.any(lines.cross.through))
    mirror = None
    if crosses:
        mirror = _Mirror(optics, lines, view, _slope(view, lines, surface, when))
        planes = mirror.behind(medium, planes)
    if optics.blur:
        planes = _blurred(optics, medium, view, lines, planes)
    planes = planes + medium.veil(lines.length, lines.start, lines.rise)
    if mirror is not None:
        planes = mirror.before(planes)
    return xp.stack([planes[k] for k in range(3)], axis=-1)


def _lines(optics: Optics, view: Sight, surface: Surface, when: Array) -> _Lines:
    xp = namespace(view.colour)
    hit = view.ranges < FAR
    ends = xp.where(hit, view.ranges, FAR)
    calm = surface if optics.surface else SurfaceStill(level=surface.level)
    cross = crossing(view.origins, view.directions, ends, calm, when, port=optics.port)
    rise = view.directions[..., 2]
    below = (surface.level - view.origins[:, 2])[:, None, None]
    return _Lines(
        hit=hit,
        ends=ends,
        rise=rise,
        cross=cross,
        length=xp.where(cross.wet, cross.distance, ends - cross.distance),
        start=xp.where(cross.wet, xp.clip(below, 0.0, None), 0.0),
        depth=xp.clip(below - ends * rise, 0.0, None),
        under=cross.wet != cross.through,
    )


def _places(view: Sight, distance: Array) -> tuple[Array, Array]:
    """World x and y of places along the lines of sight [m]."""
    x, y = (view.origins[:, k][:, None, None] + distance * view.directions[..., k] for k in (0, 1))
    return x, y


def _slope(view: Sight, lines: _Lines, surface: Surface, when: Array) -> tuple[Array, Array]:
    """Slope of the surface where lines of sight cross it, averaged over the pixel."""
    xp = namespace(view.colour)
    distance = lines.cross.distance
    x, y = _places(view, distance)
    if not isinstance(surface, SurfaceSmooth):
        return surface.slope(x, y, when)
    # half of what a pixel covers, longer the flatter the line meets the surface
    width = distance * (0.5 * blur.pixel_angle(view.directions))
    width = width / xp.clip(xp.abs(lines.rise), 0.02, None)
    return surface.slope_over(x, y, when, width)


def _light(optics: Optics, view: Sight, lines: _Lines, surface: Surface, time: Array) -> Array:
    """Light transmitted through the surface to the objects below, relative to full light [1]."""
    if not optics.caustics or surface.reach == 0.0 or optics.sun_share == 0.0:
        return optics.entering
    xp = namespace(lines.ends)
    lit = lines.under & lines.hit
    ends = xp.where(lit, lines.ends, 0.0)
    x, y = _places(view, ends)
    cells = optics.cells
    patch = caustics.around(x, y, lines.depth, ends, lit, cells=cells)
    maps = caustics.pattern(patch, surface, time, optics.sun, cells=cells, rays=optics.rays)
    found = caustics.looked_up(maps, patch, x, y, lines.depth)
    # what was turned on the way down has lost the pattern; green stands for all colours
    loss = optics.fading
    share = optics.sun_share * xp.exp(-loss * lines.depth)
    if view.normals is not None:
        # sunlight on an inclined surface relative to a level one, at most 1 [1]
        xp = namespace(view.normals)
        east, north = optics.sun.drift()
        toward = view.normals[..., 2] - east * view.normals[..., 0] - north * view.normals[..., 1]
        share = share * xp.clip(toward, 0.0, 1.0)
    return optics.entering * (1.0 + share * (found - 1.0))


def _blurred(optics: Optics, medium: Medium, view: Sight, lines: _Lines, planes: Array) -> Array:
    """Light from the scene, blurred by the water along the path."""
    xp = namespace(planes)
    wet = lines.cross.wet
    inside = planes
    if bool(xp.any(~wet)):
        # what is not seen through water must not shine into what is
        count = xp.clip(xp.sum(xp.astype(wet, planes.dtype), axis=(1, 2)), 1.0, None)
        mean = xp.sum(xp.where(wet[None], planes, 0.0), axis=(2, 3)) / count
        inside = xp.where(wet[None], planes, mean[:, :, None, None])
    lobe, pixel = optics.forward_angle, blur.pixel_angle(view.directions)
    mixed = blur.blurred(inside, lines.length, medium.spread, lobe, pixel)
    return mixed if inside is planes else xp.where(wet[None], mixed, planes)


class _Mirror:
    """Reflection and transmission at the surface where lines of sight cross it."""

    def __init__(
        self, optics: Optics, lines: _Lines, view: Sight, slope: tuple[Array, Array]
    ) -> None:
        xp = namespace(lines.ends)
        self.optics, self.lines = optics, lines
        cross, (sx, sy) = lines.cross, slope
        long = xp.sqrt(1.0 + sx * sx + sy * sy)
        dx, dy, dz = (view.directions[..., k] for k in range(3))
        along = (dz - dx * sx - dy * sy) / long
        cosine = xp.clip(xp.abs(along), 0.0, 1.0)
        self.out, self.into = cross.wet & cross.through, ~cross.wet & cross.through
        outward, inward = fresnel(cosine, INDEX), fresnel(cosine, 1.0 / INDEX)
        self.share = xp.where(self.out, outward, xp.where(self.into, inward, 0.0))
        # upward components of the mirrored and of the refracted line
        self.back = dz - 2.0 * along / long
        bend = xp.sqrt(xp.clip(1.0 - INDEX**2 * (1.0 - cosine * cosine), 0.0, None))
        self.onward = INDEX * dz + (bend - INDEX * cosine) / long

    def _sky(self, rise: Array) -> Array:
        return sky(tuple(self.optics.sky_zenith), tuple(self.optics.sky_horizon), rise)

    def behind(self, medium: Medium, planes: Array) -> Array:
        """Light from above the surface that reaches a camera under water."""
        xp = namespace(planes)
        lines = self.lines
        arrives = xp.exp(-channels(medium.direct, lines.ends) * lines.length[None])
        air = xp.where(lines.hit[None], planes, self._sky(self.onward) * arrives)
        water = medium.far_veil(lines.start * 0.0, self.back) * arrives
        # radiance grows with the square of the index as light is squeezed into the water
        shown = (1.0 - self.share) * INDEX**2 * air + self.share * water
        return xp.where(self.out[None], shown, planes)

    def before(self, planes: Array) -> Array:
        """Light reflected by and transmitted through the surface, for a camera above water."""
        xp = namespace(planes)
        through = (1.0 - self.share) * (1.0 / INDEX**2) * planes
        return xp.where(self.into[None], through + self.share * self._sky(self.back), planes)
