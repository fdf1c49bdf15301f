"""Content of one frame, and the interface of renderers that draw water."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.rendering import Lens, Poses, Renderer, Scene, SceneView
from seals.rendering.optics import Optics, Surface
from seals.view.films.settings import Quality
from seals.view.films.viewpoint import Viewpoint

Image = NDArray[np.float32]


class WaterBody(NamedTuple):
    """Water at one instant.

    Args:
        vertices: of its surface, world [m], shape (n, 3).
        triangles: anticlockwise from outside, shape (m, 3).
        closed: whether the surface closes around the water; otherwise all below it is water.
        surface: the same as heights.
        lower: corner of the place that it fills, east and north [m]; without end where open.
        upper: the opposite corner [m].
    """

    vertices: Floats
    triangles: NDArray[np.int64]
    closed: bool
    surface: Surface
    lower: tuple[float, float] = (-np.inf, -np.inf)
    upper: tuple[float, float] = (np.inf, np.inf)

    def covers(self, points: Floats, time: float) -> NDArray[np.bool_]:
        """Return whether points are under water.

        Args:
            points: world [m], shape (..., 3).
            time: [s].
        """
        x, y = points[..., 0], points[..., 1]
        inside = (x > self.lower[0]) & (x < self.upper[0])
        inside &= (y > self.lower[1]) & (y < self.upper[1])
        found: NDArray[np.bool_] = inside & (points[..., 2] < self.surface.height(x, y, time))
        return found


class Frame(NamedTuple):
    """Content of one frame: time, poses, camera, water.

    Args:
        time: of the run [s].
        poses: of the scene's frames, one environment.
        view: of the camera.
        lens: of the camera.
        water: as it stands, or None.
        port: radius of the dome before the lens [m].
    """

    time: float
    poses: Poses
    view: Viewpoint
    lens: Lens
    water: WaterBody | None
    port: float


@runtime_checkable
class Photographer(Protocol):
    """Interface of a renderer that draws water: surface, underwater light, sky."""

    def arrange(self, scene: Scene, optics: Optics, quality: Quality) -> None:
        """Prepare for the frames of a film.

        Raises:
            SealsError: a package or a device is missing, or the scene cannot be drawn.
        """

    def photograph(self, frame: Frame) -> Image:
        """Render a frame: linear red, green, blue, white is 1, shape (H, W, 3)."""

    def close(self) -> None:
        """Release memory and devices; a second call does nothing."""


class Drawn:
    """Adapter of a renderer without water to frames of films.

    Args:
        renderer: that draws without water.
    """

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        self._watch: SceneView | None = None
        self._dry: Optics | None = None
        self._poses: Poses

    def arrange(self, scene: Scene, optics: Optics, quality: Quality) -> None:
        """Open the renderer with a noiseless camera."""
        clean = dataclasses.replace(optics, noise=False)
        self._dry = dataclasses.replace(clean, water_type="none")
        view = SceneView(self.renderer, scene, lambda: self._poses, optics=clean, surface=None)
        self._watch = view
        self._watch.optics = clean

    def photograph(self, frame: Frame) -> Image:
        """Render a frame."""
        watch = self._watch
        if watch is None or self._dry is None:
            raise RuntimeError("nothing was arranged")
        self._poses = frame.poses
        if frame.water is None:
            watch.optics = self._dry
        else:
            watch.surface = frame.water.surface
        picture = watch.see(
            (frame.view.origin, frame.view.axes), frame.lens, frame.time, np.random.default_rng(0)
        )
        return np.asarray(picture.colour, dtype=np.float32)

    def close(self) -> None:
        """Release the renderer."""
        self.renderer.close()
