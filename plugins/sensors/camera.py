"""Camera: images of colour, depth, parts and normals."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError, refuse_unlisted, suggestion
from seals.field_roles import roles
from seals.rendering.camera import OPTICAL, Lens
from seals.rendering.camera_view import Shot
from seals.rendering.picture import MILLIMETRE, Picture
from seals.schema import optional, param, setting
from seals.sensors.mount import Mount, PicturingSensor
from seals.sensors.protocol import SensorInput

WHAT = ("rgb", "depth", "segmentation", "normals")
"""Kinds of images."""
_NGUYEN = "Nguyen, Izadi and Lovell 2012, 3DIMPVT, eq. 1, with its parabola begun at zero"


@roles(data="what")
@dataclass(kw_only=True)
class SensorCamera(PicturingSensor):
    """Pinhole camera with depth; it looks along its x axis, z is up in the image.

    Equation:
        A point at (x, y, z) in optical axes (right, down, ahead) appears in column
        f x / z + width / 2 and row f y / z + height / 2, f = width / (2 tan(fov / 2)). The depth
        read is z + (floor + growth z^2) n, n standard normal.

    Args:
        position: of the camera in link axes [m].
        rpy: turn of the camera's axes (x along the view, z up) against those of the link [rad].
        rate: pictures a second [Hz].
        width: pixels along a row.
        height: pixels along a column.
        fov: horizontal field of view, edge to edge [rad].
        fov_vertical: vertical field of view [rad]; absent for square pixels.
        near: nearest depth that is seen [m].
        far: farthest depth that is seen [m].
        what: images that are kept: ``rgb``, ``depth``, ``segmentation``, ``normals``.
        depth_floor: standard deviation of the depth at any distance [m].
        depth_growth: its growth with the square of the distance [1/m].

    Assumptions:
        All pixels are exposed at one instant; no distortion, no blur by motion.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        Noise of the depth is white from pixel to pixel, without holes and without the fringe of
        edges. Light in water and noise of the colours are those of the run's ``optics``.

    References:
        Hartley and Zisserman 2004, Multiple View Geometry, ch. 6; Nguyen, Izadi and Lovell 2012,
        Modeling Kinect sensor noise, 3DIMPVT.

    Example:
        >>> SensorCamera(width=64, height=48).lens.cy
        24.0
    """

    rate: float = setting(10.0, "Hz", bounds=(0.01, 1e4), source="chosen")
    width: int = 128
    height: int = 128
    fov: float = setting(1.22, "rad", bounds=(1e-3, 2.9), source="chosen")
    fov_vertical: float | None = optional("rad", bounds=(1e-3, 2.9), source="chosen")
    near: float = setting(0.02, "m", bounds=(1e-4, 1e4), source="chosen")
    far: float = setting(50.0, "m", bounds=(1e-3, 1e5), source="chosen")
    what: list[str] = field(default_factory=lambda: ["rgb", "depth"])
    depth_floor: float = param(0.0012, "m", bounds=(0.0, 1.0), tolerance=0.0005, source=_NGUYEN)
    depth_growth: float = param(0.0019, "1/m", bounds=(0.0, 1.0), tolerance=0.0005, source=_NGUYEN)

    sees: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse unknown kinds of images, and check the lens."""
        for name in self.what:
            refuse_unlisted(name, WHAT, f"a camera does not provide '{name}'", label="Images")
        if not self.what:
            raise ConfigError(f"a camera provides no images: what=[].\n{suggestion('', WHAT)}")
        self.mount = Mount("camera", self.position, self.rpy)
        self.lens = Lens(
            width=self.width,
            height=self.height,
            fov=self.fov,
            fov_vertical=self.fov_vertical,
            near=self.near,
            far=self.far,
        )

    def channels(self) -> dict[str, int]:
        """Return the channels: the image number; images are stored next to the log."""
        return {"picture": 1}

    def described(self) -> dict[str, Any]:
        """Return the lens and the contents of the images, for readers of the files."""
        lens = self.lens
        return {
            "width": lens.width,
            "height": lens.height,
            "fx": lens.fx,
            "fy": lens.fy,
            "cx": lens.cx,
            "cy": lens.cy,
            "near": lens.near,
            "far": lens.far,
            "what": list(self.what),
            "depth_unit": MILLIMETRE,
        }

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Render an image when due and a scene exists; return its number."""
        if not due:
            return None, memory
        if felt.camera is not None:
            here = self.mount.felt(felt)
            axes = here.rotation @ OPTICAL
            camera = here.position, axes
            picture = felt.camera.see(
                camera, self.lens, felt.time, rng, normals="normals" in self.what
            )
            if "depth" in self.what:
                picture = picture._replace(depth=self._measured(picture, rng))
            what = tuple(self.what)
            felt.camera.keep(Shot(memory, felt.time, picture, self.lens, what, *camera))
        return {"picture": np.array([float(memory)])}, memory + 1

    def _measured(self, picture: Picture, rng: np.random.Generator) -> NDArray[np.float32]:
        """Depth with noise; pixels without a hit are unchanged."""
        depth: NDArray[np.float32] = np.asarray(picture.depth)
        if not (self.depth_floor or self.depth_growth):
            return depth
        noise = rng.standard_normal(depth.shape, dtype=np.float32)
        known = np.where(np.isfinite(depth), depth, np.float32(0.0))
        spread = np.float32(self.depth_floor) + np.float32(self.depth_growth) * known * known
        read: NDArray[np.float32] = np.maximum(depth + spread * noise, np.float32(0.0))
        return read
