"""Forward scattering: blur by light scattered at small angles."""

from __future__ import annotations

import functools
import math

import numpy as np
from array_api_compat import device

from seals.arrays import Array, Floats, namespace

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


def _turned(length: Array, scattering: float) -> tuple[Array, Array]:
    """Return the scattered fraction of the light, and its mean number of scatterings.

    Args:
        length: of the path in the water [m], any shape.
        scattering: b, into small angles [1/m].

    Returns:
        Share 1 - exp(-b z) and mean b z / share, of Poisson's distribution; the same shapes.
    """
    xp = namespace(length)
    turns = xp.clip(scattering * length, 1e-4, MOST)
    share = 1.0 - xp.exp(-turns)
    return share, turns / share


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
    share, turns = _turned(length, scattering)
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
