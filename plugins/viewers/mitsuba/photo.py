"""Rendering of one frame: camera in air, under water, or half submerged."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.plugins.viewers.mitsuba.building import Build, Crop
from seals.plugins.viewers.mitsuba.denoise import cleaned
from seals.view.films import Frame

Image = NDArray[np.float32]
FINER = 3
"""Points of a pixel along an edge at which it is asked whether the port is under water there."""


def photograph(build: Build, frame: Frame, *, samples: int, depth: int, denoise: bool) -> Image:
    """Render a frame; linear colour, white is 1, shape (H, W, 3).

    Args:
        build: of the film.
        frame: what it shows.
        samples: of a pixel.
        depth: most turns of a path of light.
        denoise: whether grain is taken out.
    """
    share = wet_share(frame)
    parts = build.links(frame.poses) | build.sky() | build.water(frame) | build.ground(frame)
    image = np.zeros((frame.lens.height, frame.lens.width, 3), dtype=np.float32)
    for wet, weight in ((False, 1.0 - share), (True, share)):
        rows = np.flatnonzero(weight.any(axis=1))
        if not len(rows):
            continue
        # more rows than needed: the denoiser looks about
        first, last = max(int(rows[0]) - 4, 0), min(int(rows[-1]) + 5, frame.lens.height)
        crop = Crop(first, last - first)
        sensor = build.sensor(frame, crop, wet=wet, samples=samples)
        fog = build.fog if wet else 0.0
        seen = _shot(build.mi, {**parts, "sensor": sensor}, depth, denoise=denoise, fog=fog)
        image[first:last] += weight[first:last, :, None].astype(np.float32) * seen
    return image


def _shot(mi: Any, parts: dict[str, Any], depth: int, *, denoise: bool, fog: float = 0.0) -> Image:
    """Render one image; fog is the extinction of what the camera stands in [1/m]."""
    inner = {"type": "volpath", "max_depth": depth, "rr_depth": 3}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "aov", "aovs": "d:depth,a:albedo,n:sh_normal", "image": inner},
            **parts,
        }
    )
    pixels = np.nan_to_num(np.array(mi.render(scene), dtype=np.float32))
    colour = pixels[..., :3]
    if not denoise:
        return colour
    # guides fade as what they tell of does: else the horizon under water is drawn as a line
    clear = faded(pixels[..., -7:-6], fog)
    return np.maximum(cleaned(colour, clear * pixels[..., -6:-3], clear * pixels[..., -3:]), 0.0)


def faded(distance: Image, fog: float) -> Image:
    """Return the share of the light of what is seen first that arrives [1].

    Args:
        distance: of what is seen first; 0 where nothing is [m].
        fog: extinction [1/m].

    Example:
        >>> faded(np.array([0.0, 1.0]), 0.0).tolist(), faded(np.array([0.0, 1.0]), 1e3).tolist()
        ([1.0, 1.0], [0.0, 0.0])
    """
    if fog <= 0.0:
        return np.ones_like(distance)
    return np.asarray(np.where(distance > 0.0, np.exp(-fog * distance), 0.0))


def wet_share(frame: Frame) -> NDArray[np.float64]:
    """Return the fraction of every pixel whose ray starts under water, shape (H, W)."""
    lens, (origin, axes) = frame.lens, frame.view
    if frame.water is None:
        return np.zeros((lens.height, lens.width))
    steps = (np.arange(FINER) + 0.5) / FINER
    columns = (np.arange(lens.width)[:, None] + steps).ravel()
    rows = (np.arange(lens.height)[:, None] + steps).ravel()
    x, y = np.meshgrid((columns - lens.cx) / lens.fx, (rows - lens.cy) / lens.fy)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ axes.T
    wet = frame.water.covers(origin + frame.port * rays, frame.time).astype(float)
    split = wet.reshape(lens.height, FINER, lens.width, FINER)
    found: NDArray[np.float64] = split.mean(axis=(1, 3))
    return found
