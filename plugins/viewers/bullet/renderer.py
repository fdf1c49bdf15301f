"""Base of both PyBullet renderers, and the rasteriser on the CPU."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from seals.errors import PhysicsError
from seals.plugins.viewers.bullet.drawing import Drawing, Sampling
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import Light
from seals.rendering.picture import Picture
from seals.rendering.scene import Poses, Scene

SAMPLING = Sampling("ER_TINY_RENDERER", (-0.5, 0.5))
"""It samples at the corner of a pixel, lower left, where the middle is meant."""


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


@dataclass(kw_only=True)
class RendererTiny(RendererBullet):
    """TinyRenderer of PyBullet: rasteriser on one CPU core.

    Equation:
        Pinhole projection, depth buffer, Lambert shading (`seals.rendering.light.Light`).

    Assumptions:
        Links are opaque. Level ground is drawn beside it, exactly, from depth.

    Valid range:
        Some thousand triangles and 128 x 128 pixels: a few hundred pictures a second.

    Limitations:
        No shadows, no textures, no half-transparent links. Depth comes from a buffer in single
        precision: 0.4 mm off at 10 m with near = 0.02 m. Triangles of less than 0.005 square
        pixels are left out. Normals are those of the depth picture, wrong along edges. Pictures of
        several environments come one after the other.

    References:
        Sokolov, D., tinyrenderer; Coumans and Bai 2016-2021, PyBullet.

    Example:
        >>> RendererTiny().close()
    """

    def begin(self, scene: Scene, light: Light) -> Drawing:
        """Load the scene."""
        return Drawing(scene, light, SAMPLING, "tiny")
