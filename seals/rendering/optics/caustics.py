"""Caustics: sunlight refracted by the water surface, as a light pattern."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from array_api_compat import device

from seals.arrays import Array, namespace
from seals.rendering.optics.path import INDEX
from seals.rendering.optics.surface import Surface

EXACT = 4096.0
"""Weights are multiples of 1 / EXACT: their sums are exact, in whatever order they are taken."""


class Sun(NamedTuple):
    """Direction of the sun.

    Args:
        zenith: angle from straight up [rad].
        azimuth: direction it comes from, from east anticlockwise [rad].
    """

    zenith: float
    azimuth: float

    def ray(self) -> tuple[float, float, float]:
        """Return the unit direction of the sunlight, world axes [1]."""
        flat = -math.sin(self.zenith)
        return (
            flat * math.cos(self.azimuth),
            flat * math.sin(self.azimuth),
            -math.cos(self.zenith),
        )

    def drift(self) -> tuple[float, float]:
        """Return the shift of sunlight east and north per metre of depth in still water [1]."""
        lean = math.tan(math.asin(math.sin(self.zenith) / INDEX))
        return -lean * math.cos(self.azimuth), -lean * math.sin(self.azimuth)


class Patch(NamedTuple):
    """Square area of the caustics pattern at two depths, one per view.

    Args:
        x: world x of its middle [m], shape (N,).
        y: world y of its middle [m], shape (N,).
        half: half its edge [m], shape (N,).
        depths: below the mean level, the lesser one first [m], shape (N, 2).
    """

    x: Array
    y: Array
    half: Array
    depths: Array


def pattern(
    patch: Patch, surface: Surface, time: Array, sun: Sun, *, cells: int, rays: int = 1
) -> Array:
    """Return the sunlight on level planes, relative to that under still water.

    A lattice of rays is refracted at the surface by Snell's law with the local
    slope; each is shared between the four cells about where it meets the plane. Light is neither
    lost nor made, and places where rays cross add up: the pattern is right past the focus, too.

    Args:
        patch: where, and at which depths.
        surface: water surface.
        time: [s]; a number, or shape (N,).
        sun: direction of the light.
        cells: of the square along an edge.
        rays: of a cell along an edge. Where the surface spreads light by s, a lattice of one leaves
            stripes of (sinc(1 / s))^2, a lattice of two of (sinc(2 / s))^2.

    Returns:
        Relative irradiance [1], shape (N, 2, cells, cells), along x, then along y.
    """
    xp = namespace(patch.x)
    cell = (patch.half * (2.0 / cells))[:, None, None]
    # light comes in over the edges, too
    margin = cells // 10
    # under still water, light on the patch comes from beside it
    middle = xp.mean(patch.depths, axis=1)
    east, north = sun.drift()
    steps = xp.arange(rays * (cells + 2 * margin), dtype=patch.x.dtype, device=device(patch.x))
    steps = (steps + 0.5) * (1.0 / rays) - (0.5 * cells + margin)
    x = (patch.x - east * middle)[:, None, None] + cell * steps[None, :, None]
    y = (patch.y - north * middle)[:, None, None] + cell * steps[None, None, :]
    x, y = x + 0.0 * y, y + 0.0 * x
    when = time if isinstance(time, int | float) else xp.reshape(time, (-1, 1, 1))
    along, across, weight = _bent(*surface.slope(x, y, when), sun)
    # the height of the waves is little against the depth at which they focus
    fall = patch.depths[:, :, None, None]
    u = (x - patch.x[:, None, None])[:, None] + along[:, None] * fall
    v = (y - patch.y[:, None, None])[:, None] + across[:, None] * fall
    scale, shift = 1.0 / cell[:, None], 0.5 * cells - 0.5
    return _counted(u * scale + shift, v * scale + shift, weight[:, None] * (1.0 / rays**2), cells)


def _bent(sx: Array, sy: Array, sun: Sun) -> tuple[Array, Array, Array]:
    """Horizontal offset of refracted sunlight per metre of depth, and its intensity."""
    xp = namespace(sx)
    lx, ly, lz = sun.ray()
    long = xp.sqrt(1.0 + sx * sx + sy * sy)
    facing = lx * sx + ly * sy - lz
    cosine = xp.clip(facing / long, 0.0, 1.0)
    ratio = 1.0 / INDEX
    bend = ratio * cosine - xp.sqrt(1.0 - ratio * ratio * (1.0 - cosine * cosine))
    lean = bend / long
    down = -(ratio * lz + lean)
    # a wave's side that faces the sun catches more of it
    strength = xp.clip(facing * (1.0 / -lz), 0.0, None)
    return (ratio * lx - lean * sx) / down, (ratio * ly - lean * sy) / down, strength


def _counted(u: Array, v: Array, weight: Array, cells: int) -> Array:
    """Distribute rays at (u, v) over the neighbouring cells; shape (N, 2, cells, cells)."""
    xp = namespace(u)
    views, depths = u.shape[0], u.shape[1]
    # one more row and column on every side takes what falls beside the patch
    wide = cells + 2
    u, v = xp.clip(u + 1.0, 0.0, wide - 1.001), xp.clip(v + 1.0, 0.0, wide - 1.001)
    i, j = xp.floor(u), xp.floor(v)
    p, q = u - i, v - j
    planes = xp.arange(views * depths, dtype=xp.int64, device=device(u)) * (wide * wide)
    start = xp.astype(i * wide + j, xp.int64) + xp.reshape(planes, (views, depths, 1, 1))
    whole = xp.round(weight * EXACT)
    far = xp.round(whole * p)
    near = whole - far
    near_far, far_far = xp.round(near * q), xp.round(far * q)
    shares = ((near - near_far, 0), (near_far, 1), (far - far_far, wide), (far_far, wide + 1))
    total = _sums(start, shares, views * depths * wide * wide) * (1.0 / EXACT)
    total = xp.reshape(total, (views, depths, wide, wide))
    return total[:, :, 1:-1, 1:-1]


def _sums(start: Array, shares: tuple[tuple[Array, int], ...], size: int) -> Array:
    """Sums of weights by cell index, each weight with its own offset."""
    xp = namespace(start)
    flat = xp.reshape(start, (-1,))
    if xp is np:
        total = np.zeros(size)
        for share, offset in shares:
            counted = np.bincount(flat, share.ravel(), size - offset)
            total[offset:] += counted[: size - offset]
        return total.astype(shares[0][0].dtype)
    total = xp.zeros(size, dtype=shares[0][0].dtype, device=device(start))
    for share, offset in shares:
        total.index_add_(0, flat + offset, xp.reshape(share, (-1,)))
    return total


def looked_up(maps: Array, patch: Patch, x: Array, y: Array, depth: Array) -> Array:
    """Return the pattern at points; 1 outside the patch.

    Args:
        maps: of `pattern`, shape (N, 2, cells, cells).
        patch: where they are.
        x: world x [m], shape (N, H, W).
        y: world y [m], shape (N, H, W).
        depth: below the mean level [m], shape (N, H, W).

    Returns:
        Relative irradiance [1], shape (N, H, W).
    """
    xp, cells = namespace(maps), maps.shape[-1]
    # both depths side by side: one look-up fetches them together
    pairs = xp.reshape(xp.stack([maps[:, 0], maps[:, 1]], axis=-1), (-1, 2))
    scale, edge = (0.5 * cells / patch.half)[:, None, None], 0.5 * cells
    u, v = (x - patch.x[:, None, None]) * scale, (y - patch.y[:, None, None]) * scale
    aside = xp.maximum(xp.abs(u), xp.abs(v))
    inside = xp.clip((edge - 1.0 - aside) * (5.0 / cells), 0.0, 1.0)
    u, v = (xp.clip(w + (edge - 0.5), 0.0, cells - 1.001) for w in (u, v))
    i, j = xp.floor(u), xp.floor(v)
    p, q = u - i, v - j
    views = xp.arange(maps.shape[0], dtype=xp.int64, device=device(maps)) * cells**2
    start = xp.reshape(xp.astype(i * cells + j, xp.int64) + views[:, None, None], (-1,))
    first, last = (patch.depths[:, k][:, None, None] for k in (0, 1))
    deep = xp.clip((depth - first) / xp.clip(last - first, 1e-3, None), 0.0, 1.0)
    near, far = p * 0.0, p * 0.0
    for more, weight in (
        (0, (1.0 - p) * (1.0 - q)),
        (1, (1.0 - p) * q),
        (cells, p * (1.0 - q)),
        (cells + 1, p * q),
    ):
        corner = xp.reshape(xp.take(pairs, start + more, axis=0), (*p.shape, 2))
        near, far = near + weight * corner[..., 0], far + weight * corner[..., 1]
    return 1.0 + inside * (near + deep * (far - near) - 1.0)


def around(x: Array, y: Array, depth: Array, length: Array, seen: Array, *, cells: int) -> Patch:
    """Return the patches that cover the near field of the views.

    Args:
        x: world x of the points seen [m], shape (N, H, W).
        y: world y [m], shape (N, H, W).
        depth: below the mean level [m], shape (N, H, W).
        length: distance from the camera [m], shape (N, H, W).
        seen: whether a point counts, shape (N, H, W).
        cells: of the square along an edge.
    """
    xp = namespace(x)
    # a sixteenth of the pixels is enough to know where things are
    x, y, depth, length, seen = (part[:, ::4, ::4] for part in (x, y, depth, length, seen))
    # near things fill the picture with few of its finest details: they decide
    weight = xp.astype(seen, x.dtype) / (1.0 + length * length)
    whole = xp.clip(xp.sum(weight, axis=(1, 2)), 1e-9, None)
    cx, cy = (xp.sum(weight * w, axis=(1, 2)) / whole for w in (x, y))
    aside = xp.maximum(xp.abs(x - cx[:, None, None]), xp.abs(y - cy[:, None, None]))
    half = 1.6 * xp.sqrt(xp.sum(weight * aside * aside, axis=(1, 2)) / whole)
    # sizes in few steps and middles on whole cells: the lattice of rays stays where it is
    half = 2.0 ** (xp.ceil(2.0 * xp.log2(xp.clip(half, 0.25, 16.0))) * 0.5)
    cell = half * (2.0 / cells)
    cx, cy = (xp.round(c / cell) * cell for c in (cx, cy))
    deep = xp.max(xp.where(seen, depth, 0.0), axis=(1, 2))
    shallow = xp.minimum(xp.min(xp.where(seen, depth, 1e4), axis=(1, 2)), deep)
    return Patch(cx, cy, half, xp.stack([shallow, deep], axis=1))
