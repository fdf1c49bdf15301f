"""Infinite level planes, added to a rasterised image pixel by pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering.camera import Lens
from seals.rendering.light import CONTRAST, Light
from seals.rendering.optics import to_linear
from seals.rendering.scene import Shape

UP = (0.0, 0.0, 1.0)

Image = NDArray[np.float32]
Mask = NDArray[np.bool_]


class Planes:
    """The level planes of a scene, drawn pixel by pixel.

    Args:
        shapes: of the scene; all but planes are left alone.
        light: that falls on them.
    """

    def __init__(self, shapes: tuple[Shape, ...], light: Light) -> None:
        self._planes = []
        for shape in shapes:
            if shape.kind != "plane":
                continue
            shown = np.array(shape.colour) * light.shade(UP)
            colours = np.stack([shown, shown * (1.0 - CONTRAST)])
            table = to_linear(colours).astype(np.float32)
            self._planes.append((float(shape.position[2]), shape.part, shape.tile, table))

    def draw(
        self,
        origin: Floats,
        rotation: Floats,
        lens: Lens,
        images: tuple[Image, Image, NDArray[np.int32]],
    ) -> None:
        """Draw the planes into an image where they are nearer than its content.

        Args:
            origin: of the camera, world [m], shape (3,).
            rotation: R_WO, shape (3, 3).
            lens: of the camera.
            images: colour, depth and parts, changed in place.
        """
        colour, depth, parts = images
        rays = lens.rays()
        down = _along(rays, -rotation[2])
        np.maximum(down, np.float32(1e-9), out=down)
        for height, part, tile, table in self._planes:
            above = float(origin[2]) - height
            if above <= 0.0:
                continue
            reach = np.float32(above) / down
            # parts of the picture that look up reach it beyond any lens
            seen = reach < np.minimum(depth, np.float32(lens.far))
            seen &= reach >= np.float32(lens.near)
            if not seen.any():
                continue
            np.copyto(depth, reach, where=seen)
            np.copyto(parts, part, where=seen)
            shown = seen[..., None]
            np.copyto(colour, table[0], where=shown)
            if tile > 0.0:
                shown &= _dark(rays, reach, origin, rotation, tile)[..., None]
                np.copyto(colour, table[1], where=shown)


def _dark(rays: Image, reach: Image, origin: Floats, rotation: Floats, tile: float) -> Mask:
    """Return the mask of pixels that see a dark square of a plane."""
    # counted from the camera's own square, single precision is good far from the origin
    start = np.mod(np.asarray(origin[:2]) / tile, 2.0).astype(np.float32)
    near = np.minimum(reach, np.float32(1e6))
    whole = []
    for axis in range(2):
        cells = _along(rays, rotation[axis] / tile)
        cells *= near
        cells += start[axis]
        np.floor(cells, out=cells)
        whole.append(cells.astype(np.int32))
    return ((whole[0] ^ whole[1]) & 1).astype(bool)


def _along(rays: Image, way: Floats) -> Image:
    """Component of all rays along a direction: row and column parts of the pinhole camera."""
    columns = rays[0, :, 0] * np.float32(way[0])
    rows = rays[:, 0, 1] * np.float32(way[1]) + np.float32(way[2])
    found: Image = rows[:, None] + columns[None, :]
    return found
