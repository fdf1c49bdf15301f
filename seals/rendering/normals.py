"""Surface normals from a depth image, for renderers without them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering.camera import Lens

Image = NDArray[np.float32]


def normals_of(
    depth: Image, parts: NDArray[np.int32], rotation: Floats, lens: Lens
) -> NDArray[np.float32]:
    """Return normals in world axes, shape (H, W, 3); zero for the background.

    Points of neighbouring pixels span the surface; of the two neighbours along a row, and along a
    column, the one nearer in depth is taken, so that a normal does not reach over an edge.

    Args:
        depth: [m], shape (H, W).
        parts: what is met, 0 for nothing.
        rotation: R_WO, shape (3, 3).
        lens: of the camera.
    """
    met = parts > 0
    points = lens.rays() * np.where(met, depth, np.float32(0.0))[..., None]
    along, down = _step(points, parts, 1), _step(points, parts, 0)
    normal = np.cross(down, along)
    size = np.sqrt((normal * normal).sum(axis=-1, keepdims=True))
    normal = np.where(size > 0.0, normal / np.maximum(size, np.float32(1e-30)), np.float32(0.0))
    away = (normal * lens.rays()).sum(axis=-1, keepdims=True) > 0.0
    normal = np.where(away, -normal, normal) * met[..., None]
    found: NDArray[np.float32] = (normal @ rotation.T.astype(np.float32)).astype(np.float32)
    return found


def _step(points: Image, parts: NDArray[np.int32], axis: int) -> Image:
    """Change from pixel to pixel along an axis, to the neighbour that is nearer in depth."""
    change = np.diff(points, axis=axis)
    cost = np.abs(change[..., 2]) + np.where(np.diff(parts, axis=axis) != 0, np.float32(1e6), 0.0)
    pad = [(0, 0), (0, 0)]
    pad[axis] = (0, 1)
    after, after_cost = _padded(change, pad), np.pad(cost, pad, constant_values=np.inf)
    pad[axis] = (1, 0)
    before, before_cost = _padded(change, pad), np.pad(cost, pad, constant_values=np.inf)
    better = (after_cost <= before_cost)[..., None]
    return np.where(better, after, before)


def _padded(change: Image, pad: list[tuple[int, int]]) -> Image:
    return np.pad(change, [*pad, (0, 0)])
