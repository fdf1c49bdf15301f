"""Frames of renderers without water: colour and depth, with water composited."""

from __future__ import annotations

import dataclasses

import numpy as np

from seals.rendering import Poses, Renderer, Scene, SceneView
from seals.rendering.optics import Optics
from seals.view.films.frame import Frame, Image
from seals.view.films.settings import Quality


class Drawn:
    """Adapter of a renderer without water to frames of films.

    Args:
        renderer: that draws without water.
    """

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        self._watch: SceneView | None = None
        self._dry: Optics | None = None
        self._poses: Poses | None = None

    def arrange(self, scene: Scene, optics: Optics, quality: Quality) -> None:
        """Open the renderer with a noiseless camera."""
        clean = dataclasses.replace(optics, noise=False)
        self._dry = dataclasses.replace(clean, water_type="none")
        self._watch = SceneView(self.renderer, scene, self._now, optics=clean, surface=None)
        self._watch.optics = clean

    def _now(self) -> Poses:
        if self._poses is None:
            raise RuntimeError("no frame is being drawn")
        return self._poses

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
