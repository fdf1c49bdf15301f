"""Environment map of sky and sun."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from seals.rendering.optics import Optics

SIZE = (256, 512)
"""Rows and columns of the picture."""
BELOW = 0.25
"""Radiance under the horizon over that at the horizon: haze over a far sea [1]."""
EDGE = 0.25
"""Share of the sun's radius over which it fades [1]."""


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
    return (light + sun_disc(optics, ways, sun_radius)[..., None]).astype(np.float32)


def sun_disc(optics: Optics, ways: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the radiance of the sun in the directions of a sky map, shape (H, W)."""
    toward = -np.array(optics.sun.ray())
    angle = np.arccos(np.clip(ways @ toward, -1.0, 1.0))
    shape = np.clip((radius - angle) / (EDGE * radius), 0.0, 1.0)
    rows, columns = ways.shape[:2]
    solid = np.sin((np.arange(rows) + 0.5) * (math.pi / rows)) * (2.0 * math.pi**2 / rows / columns)
    level = float(np.sum(shape * np.maximum(ways[..., 2], 0.0) * solid[:, None]))
    found: NDArray[np.float64] = shape * (math.pi * optics.sun_share / max(level, 1e-9))
    return found
