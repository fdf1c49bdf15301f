"""Primitives as triangles, for renderers that draw nothing else."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.rendering.scene import Shape

ROUND = 32
"""Edges of a circle."""


def triangles(shape: Shape) -> tuple[Floats, NDArray[np.int64]]:
    """Return corners (V, 3) and anticlockwise faces (F, 3) of a shape in its own axes.

    Circles are drawn a little larger than they are, so that their polygons cover the same area.

    Raises:
        ConfigError: a plane, which has no end.

    Example:
        >>> box = Shape("box", (2.0, 2.0, 2.0), np.zeros(3), np.eye(3), (1.0, 1.0, 1.0), 1)
        >>> corners, faces = triangles(box)
        >>> len(corners), len(faces), float(corners.max())
        (8, 12, 1.0)
    """
    if shape.kind == "mesh":
        assert shape.vertices is not None
        assert shape.faces is not None
        return shape.vertices, shape.faces
    if shape.kind == "box":
        return 0.5 * _BOX * np.array(shape.size), _BOX_FACES
    if shape.kind == "sphere":
        corners, faces = _ball()
        return shape.size[0] * corners, faces
    if shape.kind == "plane":
        raise ConfigError("a plane has no triangles.\nDraw it as the half space that it is.")
    radius, length = shape.size
    return _turned(radius, length, rounded=shape.kind == "capsule")


def corners_of(shape: Shape) -> tuple[Floats, Floats]:
    """Return the corners of a shape's triangles and the normals there, shapes (3 F, 3).

    Round primitives have the normals of what they stand for, all else those of its faces.

    Example:
        >>> ball = Shape("sphere", (0.5,), np.zeros(3), np.eye(3), (1.0, 1.0, 1.0), 1)
        >>> corners, normals = corners_of(ball)
        >>> bool(np.allclose(corners, np.linalg.norm(corners[0]) * normals))
        True
    """
    vertices, faces = triangles(shape)
    corners = vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=-1, keepdims=True), 1e-30)
    flat = np.repeat(flat, 3, axis=0)
    corners = corners.reshape(-1, 3)
    if shape.kind in ("box", "mesh"):
        return corners, flat
    half = 0.5 * shape.size[1] if shape.kind != "sphere" else 0.0
    out = corners.copy()
    out[:, 2] -= np.clip(out[:, 2], -half, half)
    if shape.kind == "cylinder":
        cap = np.abs(flat[:, 2]) > 0.9
        out[cap] = flat[cap]
    return corners, out / np.linalg.norm(out, axis=-1, keepdims=True)


_BOX: Floats = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_BOX_FACES: NDArray[np.int64] = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


@lru_cache(maxsize=1)
def _ball() -> tuple[Floats, NDArray[np.int64]]:
    """A unit sphere of rings, scaled so that its outline covers a circle's area."""
    turns = ROUND // 2
    angles = np.linspace(0.0, np.pi, turns + 1)[1:-1]
    return _lathe(
        np.array([[0.0, 1.0], *np.stack([np.sin(angles), np.cos(angles)], 1), [0.0, -1.0]])
        * _swelling()
    )


def _turned(radius: float, length: float, *, rounded: bool) -> tuple[Floats, NDArray[np.int64]]:
    """A cylinder or a capsule along z."""
    r, half = radius * _swelling(), 0.5 * length
    if not rounded:
        return _lathe(np.array([[0.0, half], [r, half], [r, -half], [0.0, -half]]))
    a = np.linspace(0.0, 0.5 * np.pi, ROUND // 4 + 1)
    top = np.stack([r * np.sin(a), half + r * np.cos(a)], 1)
    return _lathe(np.concatenate([top, (top * [1.0, -1.0])[::-1]]))


def _swelling() -> float:
    """Radius of a polygon's corners when its area is that of the unit circle."""
    step = 2.0 * np.pi / ROUND
    return float(np.sqrt(step / np.sin(step)))


def _lathe(outline: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Turn an outline (radius, height) from the upper pole to the lower one about z."""
    angle = 2.0 * np.pi * np.arange(ROUND) / ROUND
    rings = outline[1:-1]
    corners = np.stack(
        [
            np.outer(rings[:, 0], np.cos(angle)),
            np.outer(rings[:, 0], np.sin(angle)),
            np.repeat(rings[:, 1:], ROUND, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    poles = np.array([[0.0, 0.0, outline[0, 1]], [0.0, 0.0, outline[-1, 1]]])
    here, beside = np.arange(ROUND), (np.arange(ROUND) + 1) % ROUND
    top, bottom = len(corners), len(corners) + 1
    last = (len(rings) - 1) * ROUND
    faces = [
        np.stack([np.full(ROUND, top), here, beside], 1),
        np.stack([np.full(ROUND, bottom), last + beside, last + here], 1),
    ]
    for k in range(len(rings) - 1):
        upper, lower = k * ROUND, (k + 1) * ROUND
        faces.append(np.stack([upper + here, lower + here, lower + beside], 1))
        faces.append(np.stack([upper + here, lower + beside, upper + beside], 1))
    return np.concatenate([corners, poles]), np.concatenate(faces).astype(np.int64)
