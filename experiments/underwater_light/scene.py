"""Test scene of balls, a colour chart and a chequered floor, with a small ray caster."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.rendering.optics import Optics, Sight

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
