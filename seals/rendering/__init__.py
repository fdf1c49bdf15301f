"""Sight: scenes, cameras, pictures, and the protocol of the renderers that make them."""

from seals.rendering.camera import OPTICAL, Cameras, Lens, mounted, single
from seals.rendering.eye import Eye, Shot, Watch
from seals.rendering.light import Light
from seals.rendering.picture import Picture, Renderer
from seals.rendering.scene import NOTHING, Detail, Poses, Scene, Shape, nowhere

__all__ = [
    "NOTHING",
    "OPTICAL",
    "Cameras",
    "Detail",
    "Eye",
    "Lens",
    "Light",
    "Picture",
    "Poses",
    "Renderer",
    "Scene",
    "Shape",
    "Shot",
    "Watch",
    "mounted",
    "nowhere",
    "single",
]
