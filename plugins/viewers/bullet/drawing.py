"""Conversion of PyBullet's image buffers to a picture.

Infinite level planes are added pixel by pixel; normals come from the depth image.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.plugins.viewers.bullet.client import Bodies, View
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import CONTRAST, TABLE, Light
from seals.rendering.optics import to_linear
from seals.rendering.picture import Picture
from seals.rendering.scene import Poses, Scene, Shape, check_scene

UP = (0.0, 0.0, 1.0)

Image = NDArray[np.float32]
Mask = NDArray[np.bool_]


class _Planes:
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


BACK = 1e-5
"""How far behind the camera pictures are taken [m]. Cameras sit in faces of their own links, and
TinyRenderer never ends when all corners of a triangle lie in the very plane of the camera.
"""


class Sampling(NamedTuple):
    """Sampling of the PyBullet renderers.

    Args:
        flag: name of its constant in the engine.
        shift: how far its samples lie from the pixels' middles, right and down [pixel].
    """

    flag: str
    shift: tuple[float, float]


class Drawing:
    """Scene drawn by PyBullet; planes are added behind it pixel by pixel.

    Args:
        scene: what to draw.
        light: that falls on it.
        sampling: of the renderer.
        name: of the renderer, for messages.
        plugin: file and name of the renderer's plug-in, or None.
    """

    def __init__(
        self,
        scene: Scene,
        light: Light,
        sampling: Sampling,
        name: str,
        plugin: tuple[str, str] | None = None,
    ) -> None:
        check_scene(scene)
        self.bodies = Bodies(scene, name, plugin)
        self._planes = _Planes(scene.shapes, light)
        self._sky = to_linear(np.array(light.sky)).astype(np.float32)
        self._shift = sampling.shift
        engine = self.bodies.engine
        self._options: Mapping[str, Any] = {
            "renderer": getattr(engine, sampling.flag),
            "shadow": 0,
            "lightDirection": list(light.direction),
            "lightAmbientCoeff": light.ambient,
            "lightDiffuseCoeff": light.diffuse,
            "lightSpecularCoeff": 0.0,
            "physicsClientId": self.bodies.client,
        }

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return the pictures of all cameras, one after the other."""
        environments, count = np.shape(cameras.origin)[:2]
        shape = (environments, count, lens.height, lens.width)
        colour = np.empty((*shape, 3), dtype=np.float32)
        depth, parts = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.int32)
        outward = np.empty_like(colour) if normals else None
        for n in range(environments):
            frames = np.asarray(poses.position)[n], np.asarray(poses.rotation)[n]
            for c in range(count):
                images = colour[n, c], depth[n, c], parts[n, c]
                origin, turn = np.asarray(cameras.origin[n, c]), np.asarray(cameras.rotation[n, c])
                self.bodies.place(*frames, View(origin, turn, lens))
                self._shoot(origin, turn, lens, images)
                if outward is not None:
                    outward[n, c] = normals_of(depth[n, c], parts[n, c], turn, lens)
        return Picture(colour, depth, parts, outward)

    def _shoot(
        self,
        origin: Floats,
        turn: Floats,
        lens: Lens,
        images: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]],
    ) -> None:
        """Draw one picture into the given arrays."""
        colour, depth, parts = images
        # view matrix of OpenGL, column-major: camera axes x right, y up, z backwards
        view = np.eye(4)
        view[:3, :3] = (turn * [1.0, -1.0, -1.0]).T
        view[2, 3] = -BACK
        flat: list[float] = view.T.ravel().tolist()
        levels, buffer, hit = self.bodies.engine.getCameraImage(
            lens.width, lens.height, flat, _projection(lens, self._shift), **self._options
        )[2:5]
        shape = depth.shape
        np.take(self.bodies.part_of, np.reshape(hit, shape) + 1, out=parts, mode="clip")
        near, far = np.float32(lens.near), np.float32(lens.far)
        np.divide(far * near, far - (far - near) * np.reshape(buffer, shape), out=depth)
        depth -= np.float32(BACK)
        np.take(TABLE, np.reshape(levels, (*shape, 4))[..., :3], out=colour, mode="clip")
        empty = parts == 0
        depth[empty], colour[empty] = np.inf, self._sky
        self._planes.draw(origin, turn, lens, images)

    def close(self) -> None:
        """Release the engine."""
        self.bodies.close()


def _projection(lens: Lens, shift: tuple[float, float]) -> list[float]:
    """Perspective matrix of OpenGL, column-major."""
    w, h, near, far = lens.width, lens.height, lens.near, lens.far
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = 2.0 * lens.fx / w, 2.0 * lens.fy / h
    matrix[0, 2], matrix[1, 2] = -2.0 * shift[0] / w, 2.0 * shift[1] / h
    matrix[2, 2], matrix[2, 3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    matrix[3, 2] = -1.0
    flat: list[float] = matrix.T.ravel().tolist()
    return flat
