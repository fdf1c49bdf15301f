"""Conversion of PyBullet's image buffers to a picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.plugins.viewers.bullet.client import Bodies, View
from seals.rendering.camera import Cameras, Lens
from seals.rendering.ground import Planes
from seals.rendering.light import TABLE, Light
from seals.rendering.normals import normals_of
from seals.rendering.optics import to_linear
from seals.rendering.picture import Picture
from seals.rendering.scene import Poses, Scene, check_scene

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
        self._planes = Planes(scene.shapes, light)
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
