"""Textures: sandy floor with caustics of sunlight, environment map of sky and sun."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from seals.rendering.optics import Optics, Surface, to_linear
from seals.rendering.optics.caustics import Patch, pattern

CELLS = 512
"""Texels of the floor's picture along an edge."""
HALF = 4.0
"""Half the edge of the place that the picture covers [m]."""
GRAIN = 0.16
"""Standard deviation of the sand's brightness over its mean [1]."""
BRIGHTEST = 0.95
EVERYWHERE = ((-math.inf, -math.inf), (math.inf, math.inf))
SIZE = (256, 512)
"""Rows and columns of the picture."""
BELOW = 0.25
"""Radiance under the horizon over that at the horizon: haze over a far sea [1]."""
EDGE = 0.25
"""Share of the sun's radius over which it fades [1]."""


def sand(
    colour: tuple[float, float, float],
    middle: tuple[float, float],
    depth: float,
    light: tuple[Optics, Surface | None, float],
    wet: tuple[tuple[float, float], tuple[float, float]] = EVERYWHERE,
) -> NDArray[np.float32]:
    """Return the reflectance of a level floor, linear, shape (CELLS, CELLS, 3), rows from south.

    Caustics are added to it, as `seals.rendering.optics` adds them to every picture.

    Args:
        colour: as displayed.
        middle: of the place, east and north [m].
        depth: of the floor under the water [m]; zero or less for dry land.
        light: optics, surface of the water and time [s].
        wet: corners of the place that the water fills, east and north [m]; none has caustics
            outside.
    """
    optics, surface, time = light
    base = to_linear(np.array(colour)) * (1.0 + GRAIN * _faded() * _grains())[..., None]
    if depth > 0.0 and surface is not None and optics.caustics:
        east, north, half = (np.array([x]) for x in (*middle, HALF))
        patch = Patch(east, north, half, np.array([[max(depth, 1e-3), depth + 1e-3]]))
        bright = pattern(patch, surface, time, optics.sun, cells=CELLS, rays=1)[0, 0].T
        share = optics.sun_share * math.exp(-optics.fading * depth)
        along = HALF * ((2.0 * np.arange(CELLS) + 1.0) / CELLS - 1.0)
        x, y = (((m + along > a) & (m + along < b)) for m, a, b in zip(middle, *wet, strict=True))
        weight = share * _faded() * (y[:, None] & x)
        base = base * (1.0 + weight * (bright - 1.0))[..., None]
    found: NDArray[np.float32] = np.clip(base, 0.0, BRIGHTEST).astype(np.float32)
    return found


@lru_cache(maxsize=1)
def _grains() -> NDArray[np.float64]:
    """Return multi-scale noise with mean 0 and standard deviation 1."""
    rng = np.random.default_rng(7)
    rate = np.hypot(*np.meshgrid(np.fft.fftfreq(CELLS), np.fft.fftfreq(CELLS), indexing="ij"))
    rate[0, 0] = 1.0
    waves = np.fft.fft2(rng.normal(size=(CELLS, CELLS))) / rate**0.7
    waves[0, 0] = 0.0
    noise: NDArray[np.float64] = np.real(np.fft.ifft2(waves))
    noise /= noise.std()
    return noise


@lru_cache(maxsize=1)
def _faded() -> NDArray[np.float64]:
    """Weight that fades to zero at the edges, which hides them."""
    along = np.abs(np.arange(CELLS) + 0.5 - 0.5 * CELLS) / (0.5 * CELLS)
    edge = np.clip((1.0 - along) / 0.25, 0.0, 1.0)
    weight: NDArray[np.float64] = edge[:, None] * edge[None, :]
    return weight


def sky_map(optics: Optics, sun_radius: float) -> NDArray[np.float32]:
    """Return the radiance from all directions, shape (H, W, 3).

    Rows go from straight up to straight down, columns from north over east. The irradiance of the
    sun on level ground is pi times its share of the daylight, however large the disc.

    Args:
        optics: sky and sun.
        sun_radius: radius of the disc [rad].
    """
    rows, columns = SIZE
    theta = (np.arange(rows) + 0.5) * (math.pi / rows)
    phi = (np.arange(columns) + 0.5) * (2.0 * math.pi / columns)
    flat = np.sin(theta)[:, None]
    ways = np.stack(
        [flat * np.sin(phi), flat * np.cos(phi), np.cos(theta)[:, None] + 0.0 * phi], axis=-1
    )
    light = np.asarray(optics.sky(ways[None])[0], dtype=float)
    light[ways[..., 2] < 0.0] *= BELOW
    return (light + _sun_disc(optics, ways, sun_radius)[..., None]).astype(np.float32)


def _sun_disc(optics: Optics, ways: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the radiance of the sun in the directions of a sky map, shape (H, W)."""
    toward = -np.array(optics.sun.ray())
    angle = np.arccos(np.clip(ways @ toward, -1.0, 1.0))
    shape = np.clip((radius - angle) / (EDGE * radius), 0.0, 1.0)
    rows, columns = ways.shape[:2]
    solid = np.sin((np.arange(rows) + 0.5) * (math.pi / rows)) * (2.0 * math.pi**2 / rows / columns)
    level = float(np.sum(shape * np.maximum(ways[..., 2], 0.0) * solid[:, None]))
    found: NDArray[np.float64] = shape * (math.pi * optics.sun_share / max(level, 1e-9))
    return found
