"""TinyRenderer of PyBullet: rasteriser on the CPU."""

from __future__ import annotations

from dataclasses import dataclass

from seals.plugins.viewers.bullet.drawing import Drawing, Sampling
from seals.plugins.viewers.bullet.renderer import RendererBullet
from seals.rendering.light import Light
from seals.rendering.scene import Scene

SAMPLING = Sampling("ER_TINY_RENDERER", (-0.5, 0.5))
"""It samples at the corner of a pixel, lower left, where the middle is meant."""


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
