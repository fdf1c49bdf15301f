"""Contact sheet: waters and depths, caustics, and the surface from both sides."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.rendering.optics import (
    Optics,
    Sight,
    Surface,
    SurfaceAiry,
    SurfaceSum,
    ripples,
    to_bytes,
)

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


def draw(path: Path) -> None:
    """Write the contact sheet; its ending says whether as PNG, WebP or JPEG."""
    from PIL import Image

    surface = sea()
    # pictures side by side with white gaps, as whole numbers
    gap = 4
    padded = [
        [np.pad(to_bytes(p), ((0, gap), (0, gap), (0, 0)), constant_values=255) for p in row]
        for row in [*depths(surface), _surfaces(surface)]
    ]
    whole = np.concatenate([np.concatenate(row, axis=1) for row in padded])
    sheet = whole[:-gap, :-gap]
    Image.fromarray(sheet).save(path, quality=82)


Pixels = NDArray[np.float32]

PATCHES = (
    (0.9, 0.9, 0.9),
    (0.6, 0.05, 0.05),
    (0.08, 0.45, 0.08),
    (0.06, 0.10, 0.55),
    (0.75, 0.60, 0.05),
    (0.18, 0.18, 0.18),
)
"""Colours of the chart and of the balls: white, red, green, blue, yellow, grey; linear."""


class Eye(NamedTuple):
    """A pinhole camera.

    Args:
        place: world [m].
        target: where it looks, world [m].
        angle: whole field of view across the picture [rad].
        size: rows and columns.
    """

    place: tuple[float, float, float]
    target: tuple[float, float, float]
    angle: float
    size: tuple[int, int]

    def rays(self) -> Pixels:
        """Return the unit directions of a camera's pixels, world axes, shape (1, H, W, 3)."""
        ahead = np.subtract(self.target, self.place)
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(ahead, (0.0, 0.0, 1.0))
        right = right / max(float(np.linalg.norm(right)), 1e-9)
        up = np.cross(right, ahead)
        rows, columns = self.size
        half = np.tan(0.5 * self.angle)
        across = (np.arange(columns) + 0.5 - 0.5 * columns) * (2.0 * half / columns)
        down = (np.arange(rows) + 0.5 - 0.5 * rows) * (2.0 * half / columns)
        line = ahead + across[None, :, None] * right - down[:, None, None] * up
        line /= np.linalg.norm(line, axis=-1, keepdims=True)
        found: Pixels = line[None].astype(np.float32)
        return found


def seen(eye: Eye, optics: Optics, *, floor: float, balls: list[tuple[float, ...]]) -> Sight:
    """Return the picture of a camera without water: balls over a chequered floor under the sky.

    Args:
        eye: camera.
        optics: whose sun lights and whose sky is the background.
        floor: height [m].
        balls: x, y, z and radius [m] of each; they take their colours in turn.
    """
    line, place = eye.rays(), np.array(eye.place)
    ranges = np.full(line.shape[:3], np.inf)
    colour = optics.sky(line).astype(float)
    normals = np.broadcast_to((0.0, 0.0, 1.0), line.shape)
    far = (floor - place[2]) / np.where(line[..., 2] < -1e-6, line[..., 2], np.nan)
    spot = place + far[..., None] * line
    chequers = np.floor(spot[..., 0] / 0.25) + np.floor(spot[..., 1] / 0.25)
    tone = np.where(chequers % 2 > 0.5, 0.62, 0.30)[..., None] * (1.0, 0.93, 0.80)
    hit = far > 0.0
    ranges, colour = np.where(hit, far, ranges), np.where(hit[..., None], tone, colour)
    for number, (x, y, z, radius) in enumerate(balls):
        away = place - (x, y, z)
        b = line @ away
        inside = b * b - (away @ away - radius * radius)
        near = -b - np.sqrt(np.where(inside > 0.0, inside, np.nan))
        front = (near > 0.0) & (near < ranges)
        out = (place + near[..., None] * line - (x, y, z)) / radius
        shade = np.clip(out @ -np.array(optics.sun.ray()), 0.0, None)
        tone = (0.35 + 0.65 * shade)[..., None] * PATCHES[number % len(PATCHES)]
        ranges = np.where(front, near, ranges)
        colour = np.where(front[..., None], tone, colour)
        normals = np.where(front[..., None], out, normals)
    parts = (colour, ranges, place[None], line, normals)
    return Sight(*(np.asarray(part, dtype=np.float32) for part in parts))
