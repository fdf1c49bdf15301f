"""Contact sheet: waters and depths, caustics, and the surface from both sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from seals.experiments.underwater_light.scene import Eye, Pixels, seen
from seals.rendering.optics import Optics, Surface, SurfaceAiry, SurfaceSum, ripples, to_bytes

DEPTHS = (0.5, 2.0, 5.0, 10.0)
"""Of the camera [m]."""
TYPES = ("oceanic_1b", "coastal_1", "coastal_5")
SIZE = (168, 224)
"""Rows and columns of a picture."""
SEED = 7
MEAN = 0.16
"""Mean light of a picture by automatic exposure."""


def sea(wind: float = 2.0) -> SurfaceSum:
    """Return a low swell with the ripples of a light wind on it."""
    return SurfaceSum(SurfaceAiry([0.03], [[2.0, 0.6]], [4.5], [0.3]), ripples(wind=wind, seed=3))


def _picture(eye: Eye, name: str, surface: Surface, floor: float, time: float = 1.3) -> Pixels:
    """Return the image of the scene, as bright as automatic exposure makes it, shape (H, W, 3)."""
    balls: list[tuple[float, ...]] = [
        (x, y, floor + radius, radius)
        for x, y, radius in ((1.2, 0.45, 0.22), (1.9, -0.5, 0.25), (2.6, 0.55, 0.3))
    ]
    balls += [(3.8, -0.7, floor + 0.9, 0.3), (1.5, 0.0, floor + 0.5, 0.14)]
    balls += [(5.0, 0.9, floor + 0.35, 0.35)]
    plain = Optics(water_type=name, caustics=False, noise=False)
    view = seen(eye, plain, floor=floor, balls=balls)
    mean = float(np.mean(np.clip(plain.look(view, surface, time, None), 0.0, 1.0)))
    optics = Optics(water_type=name, cells=128, rays=2, exposure=MEAN / max(mean, 1e-3))
    light: Pixels = optics.look(view, surface, time, np.random.default_rng(SEED))[0]
    return light


def depths(surface: Surface) -> list[list[Pixels]]:
    """Return a row of pictures for every water, one for each depth."""
    rows = []
    for name in TYPES:
        row = []
        for depth in DEPTHS:
            eye = Eye((0.0, 0.0, -depth), (2.0, 0.0, -depth - 0.75), 1.3, SIZE)
            row.append(_picture(eye, name, surface, -depth - 1.2))
        rows.append(row)
    return rows


def _surfaces(surface: Surface) -> list[Pixels]:
    """Return the surface from above, between, from below, and caustics on the floor."""
    above = Eye((-0.5, 0.0, 0.8), (2.0, 0.0, -0.5), 1.3, SIZE)
    between = Eye((-0.2, 0.0, 0.0), (2.0, 0.0, -0.15), 1.5, SIZE)
    below = Eye((0.0, 0.0, -1.5), (0.6, 0.0, 0.0), 2.3, SIZE)
    down = Eye((0.5, 0.0, -0.3), (1.7, 0.0, -2.2), 1.2, SIZE)
    eyes = ((above, -1.5), (between, -1.2), (below, -3.0), (down, -2.2))
    return [_picture(eye, "oceanic_1b", surface, floor) for eye, floor in eyes]


def _joined(rows: list[list[Pixels]]) -> NDArray[np.uint8]:
    """Return pictures side by side with white gaps, as whole numbers."""
    gap = 4
    padded = [
        [np.pad(to_bytes(p), ((0, gap), (0, gap), (0, 0)), constant_values=255) for p in row]
        for row in rows
    ]
    whole = np.concatenate([np.concatenate(row, axis=1) for row in padded])
    return whole[:-gap, :-gap]


def draw(path: Path) -> None:
    """Write the contact sheet; its ending says whether as PNG, WebP or JPEG."""
    from PIL import Image

    surface = sea()
    sheet = _joined([*depths(surface), _surfaces(surface)])
    Image.fromarray(sheet).save(path, quality=82)
