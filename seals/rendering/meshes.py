"""Triangulation of primitives, for renderers of triangles only."""

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
        from trimesh.creation import box

        made = box(shape.size)
        return np.asarray(made.vertices), np.asarray(made.faces)
    if shape.kind == "sphere":
        corners, faces = _ball()
        return shape.size[0] * corners, faces
    if shape.kind == "plane":
        raise ConfigError("a plane has no triangles.\nDraw it as a half space.")
    radius, length = shape.size
    # A cylinder or a capsule along z
    r, half = radius * _swelling(), 0.5 * length
    if shape.kind != "capsule":
        return _lathe(np.array([[0.0, -half], [r, -half], [r, half], [0.0, half]]))
    a = np.linspace(0.0, 0.5 * np.pi, ROUND // 4 + 1)
    top = np.stack([r * np.sin(a), half + r * np.cos(a)], 1)
    return _lathe(np.concatenate([top * [1.0, -1.0], top[::-1]]))


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


@lru_cache(maxsize=1)
def _ball() -> tuple[Floats, NDArray[np.int64]]:
    """A unit sphere of rings, scaled so that its outline covers a circle's area."""
    angles = np.linspace(0.0, np.pi, ROUND // 2 + 1)
    return _lathe(_swelling() * np.stack([np.sin(angles), -np.cos(angles)], 1))


def _swelling() -> float:
    """Circumradius of a polygon with the area of the unit circle."""
    step = 2.0 * np.pi / ROUND
    return float(np.sqrt(step / np.sin(step)))


def _lathe(outline: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Turn an outline (radius, height) from the lower pole to the upper one about z."""
    from trimesh.creation import revolve

    # the poles lie on the axis to the last digit: their corners become one each
    outline[[0, -1], 0] = 0.0
    made = revolve(outline, sections=ROUND)
    return np.asarray(made.vertices), np.asarray(made.faces)
