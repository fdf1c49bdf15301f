"""Chain of image formation steps, from a rendered image to the underwater image.

Rays of pixels meet the water surface; light scattered at small angles blurs what they see.
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from array_api_compat import device

from seals.arrays import Array, Floats, namespace
from seals.rendering.optics import caustics
from seals.rendering.optics.path import INDEX, Medium, channels, fresnel, sky
from seals.rendering.optics.surface import Surface, SurfaceSmooth, SurfaceStill

if TYPE_CHECKING:
    from seals.rendering.optics.optics import Optics, Sight


FAR = 1e4
"""Stands for a line of sight that ends nowhere [m]."""
STEPS = 5
"""Steps in which a line of sight is searched for a moving surface."""


class _Crossing(NamedTuple):
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
) -> _Crossing:
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
        return _Crossing(wet, through, distance)
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
    return _Crossing(wet, through, distance)


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


MOST = 10.0
"""Turns that are counted: more of them leave the small angles of the lobe."""


def pixel_angle(directions: Array) -> float:
    """Return the angle between neighbouring pixels in the centre of the first image [rad].

    Args:
        directions: unit [1], shape (N, H, W, 3), W at least two.
    """
    _, rows, columns, _ = directions.shape
    if columns < 2:
        return math.pi
    left, right = (directions[0, rows // 2, columns // 2 - k, :] for k in (1, 0))
    xp = namespace(directions)
    # of the chord: the arc cosine of nearly one has no digits in single precision
    chord = float(xp.sqrt(xp.sum((left - right) ** 2)))
    return 2.0 * math.asin(min(max(0.5 * chord, 1e-6), 1.0))


def blurred(planes: Array, length: Array, scattering: float, angle: float, pixel: float) -> Array:
    """Return images blurred by the water, with the total light conserved.

    Light turned once, at a place evenly drawn along the path, by an angle of mean square t^2, comes
    in from t^2 / 3 beside its true direction, half of it along each axis of the picture; turned n
    times, from n times that. What was turned once and what was turned most often are made by two
    Gaussians, all else is mixed from them so that its variance is right.

    Args:
        planes: light, shape (3, N, H, W).
        length: of the path in the water [m], shape (N, H, W).
        scattering: b, into the lobe [1/m].
        angle: t, root of the mean square turn in the lobe [rad].
        pixel: angle between neighbouring pixels [rad].

    References:
        McGlamery 1980, Proc. SPIE 208, doi:10.1117/12.958279; Wells 1973, AGARD LS-61.
    """
    xp = namespace(length)
    turns = xp.clip(scattering * length, 1e-4, MOST)
    # Poisson: the share 1 - exp(-b z) is scattered, b z / share times in the mean
    share = 1.0 - xp.exp(-turns)
    turns = turns / share
    often = share * (turns - 1.0) * (1.0 / (MOST - 1.0))
    width = angle / math.sqrt(6.0) / pixel
    # the narrower Gaussian is to be well drawn by the pixels of the coarse picture
    step = max(1, min(int(width / 0.75), 16))
    coarse = _coarse(planes, step)
    once = _spread(coarse, planes, width, step)
    most = _spread(_coarse(coarse, 2), planes, width * math.sqrt(MOST), 2 * step)
    straight, some = (1.0 - share)[None], (share - often)[None]
    return planes * straight + once * some + most * often[None]


def _coarse(planes: Array, step: int) -> Array:
    """Means of blocks of pixels; edge pixels are repeated to fill the last block."""
    if step == 1:
        return planes
    xp = namespace(planes)
    for axis in (2, 3):
        lack = -planes.shape[axis] % step
        if lack:
            end = planes[:, :, -1:, :] if axis == 2 else planes[:, :, :, -1:]
            planes = xp.concat([planes, *[end] * lack], axis=axis)
    rows = sum(planes[:, :, k::step, :] for k in range(step))
    return sum(rows[:, :, :, k::step] for k in range(step)) * (1.0 / step**2)


def _spread(coarse: Array, like: Array, width: float, step: int) -> Array:
    """Blur the coarse image by a Gaussian, evaluated on the fine pixels."""
    xp = namespace(like)
    # means of blocks have spread the light a little already
    width = math.sqrt(max(width * width - (step * step - 1.0) / 12.0, 0.01))
    down, across = (
        xp.asarray(
            _gaussian(like.shape[k], coarse.shape[k], width, step),
            dtype=like.dtype,
            device=device(like),
        )
        for k in (2, 3)
    )
    return xp.matmul(down, xp.matmul(coarse, across.T))


@functools.lru_cache(maxsize=16)
def _gaussian(size: int, count: int, width: float, step: int) -> Floats:
    """Weights of coarse pixels for fine ones, shape (size, count); each row sums to one."""
    fine = np.arange(size) + 0.5
    coarse = (np.arange(count) + 0.5) * step
    weights = np.exp(-0.5 * ((fine[:, None] - coarse) / width) ** 2)
    scaled: Floats = weights / weights.sum(axis=1, keepdims=True)
    return scaled


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
    cross: _Crossing
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
    width = distance * (0.5 * pixel_angle(view.directions))
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
    lobe, pixel = optics.forward_angle, pixel_angle(view.directions)
    mixed = blurred(inside, lines.length, medium.spread, lobe, pixel)
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
