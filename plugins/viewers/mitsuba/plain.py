"""Camera images by Mitsuba: links and ground without water."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from seals.plugins.viewers.mitsuba.building import WIDE, Crop, camera, plain_colour
from seals.plugins.viewers.mitsuba.shapes import pose_of
from seals.rendering import Lens, Light, Poses
from seals.rendering.camera import Cameras
from seals.rendering.picture import Picture
from seals.rendering.scene import Shape
from seals.view.films import Viewpoint

SAMPLES = 16
"""Samples of a pixel's colour."""


class Plain:
    """Scene for camera images.

    Args:
        mi: the mitsuba module.
        shapes: number, shape and file of everything that is not a plane.
        planes: level planes.
        light: sun and sky.
    """

    def __init__(
        self, mi: Any, shapes: list[tuple[int, Shape, Path]], planes: list[Shape], light: Light
    ) -> None:
        self.mi, self.shapes, self.planes, self.light = mi, shapes, planes, light

    def render(self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool) -> Picture:
        """Return the pictures of all cameras, one after the other."""
        environments, count = np.shape(cameras.origin)[:2]
        found = [
            self._one(poses, n, Viewpoint(cameras.origin[n, c], cameras.rotation[n, c]), lens)
            for n in range(environments)
            for c in range(count)
        ]
        colour, depth, parts, outward = (
            np.stack(part).reshape(environments, count, *part[0].shape)
            for part in zip(*found, strict=True)
        )
        return Picture(colour, depth, parts, outward if normals else None)

    def _one(self, poses: Poses, n: int, view: Viewpoint, lens: Lens) -> tuple[Any, ...]:
        """Colour, depth, parts and normals of one camera."""
        whole = Crop(0, lens.height)
        sensor = camera(self.mi, view, lens, near=lens.near, crop=whole)
        parts, numbers = self._parts(poses, n)
        # the middle of the pixel, so that depth is that of one place
        once = {"type": "stratified", "sample_count": 1, "jitter": False}
        places = {"type": "aov", "aovs": "p:position,n:sh_normal,i:shape_index"}
        exact, order = self._drawn(parts, {**sensor, "sampler": once}, places)
        many = {"type": "independent", "sample_count": SAMPLES}
        matt = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1}
        colour = self._drawn(parts, {**sensor, "sampler": many}, matt)[0][..., :3]
        place, normal, index = exact[..., -7:-4], exact[..., -4:-1], exact[..., -1]
        met = np.abs(normal).sum(axis=-1) > 0.0
        ahead = (place - view.origin) @ view.axes[:, 2]
        depth = np.where(met, ahead, np.inf).astype(np.float32)
        # it counts from one, nothing is zero
        table = np.array([numbers[name] for name in order] or [0])
        part = np.where(met, table[(np.rint(index).astype(int) - 1).clip(0, len(table) - 1)], 0)
        return colour, depth, part.astype(np.int32), normal

    def _parts(self, poses: Poses, n: int) -> tuple[dict[str, Any], dict[str, int]]:
        """Everything but camera and integrator; the number of the part of every shape."""
        place, turn = np.asarray(poses.position)[n], np.asarray(poses.rotation)[n]
        out: dict[str, Any] = {}
        numbers = {}
        for number, shape, path in self.shapes:
            matrix = pose_of(shape, place, turn)
            out[f"s{number}"] = {
                "type": "ply",
                "filename": str(path),
                "to_world": self.mi.ScalarTransform4f(matrix.tolist()),
                "bsdf": plain_colour(shape.colour),
            }
            numbers[f"s{number}"] = shape.part
        for k, plane in enumerate(self.planes):
            matrix = np.diag([WIDE, WIDE, 1.0, 1.0])
            matrix[2, 3] = float(plane.position[2])
            out[f"g{k}"] = {
                "type": "rectangle",
                "to_world": self.mi.ScalarTransform4f(matrix.tolist()),
                "bsdf": plain_colour(plane.colour),
            }
            numbers[f"g{k}"] = plane.part
        sky = (np.array(self.light.sky) * self.light.ambient).tolist()
        sun = [np.pi * self.light.diffuse] * 3
        out["ambient"] = {"type": "constant", "radiance": {"type": "rgb", "value": sky}}
        out["sun"] = {
            "type": "directional",
            "direction": [-x for x in self.light.direction],
            "irradiance": {"type": "rgb", "value": sun},
        }
        return out, numbers

    def _drawn(self, parts: dict[str, Any], sensor: Any, integrator: Any) -> tuple[Any, list[str]]:
        """Pixels, and the names of the shapes in the order that Mitsuba gives them."""
        scene = self.mi.load_dict(
            {"type": "scene", "integrator": integrator, "sensor": sensor, **parts}
        )
        pixels = np.nan_to_num(np.array(self.mi.render(scene), dtype=np.float32))
        return pixels, [str(shape.id()) for shape in scene.shapes()]
