"""Base of both PyBullet renderers: open, render, close."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from seals.errors import PhysicsError
from seals.plugins.viewers.bullet.drawing import Drawing
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import Light
from seals.rendering.picture import Picture
from seals.rendering.scene import Poses, Scene


@dataclass(kw_only=True)
class RendererBullet(ABC):
    """Base of renderers with one PyBullet client, which subclasses open."""

    def __post_init__(self) -> None:
        """Keep the engine closed until `open`."""
        self._drawing: Drawing | None = None

    @abstractmethod
    def begin(self, scene: Scene, light: Light) -> Drawing:
        """Return the drawing of a scene."""

    def open(self, scene: Scene, light: Light) -> None:
        """Load a scene, closing the one before.

        Raises:
            MissingExtra: what the renderer needs is not installed.
        """
        self.close()
        self._drawing = self.begin(scene, light)

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return the pictures of all cameras.

        Raises:
            PhysicsError: no scene is open.
        """
        if self._drawing is None:
            raise PhysicsError("the renderer has no scene.\nOpen one first: open(scene, light)")
        return self._drawing.render(poses, cameras, lens, normals=normals)

    def close(self) -> None:
        """Release the engine; a second call does nothing."""
        if self._drawing is not None:
            self._drawing.close()
        self._drawing = None
