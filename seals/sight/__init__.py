"""Sight: scenes, cameras, pictures, and the protocol of the renderers that make them."""

from seals.sight.camera import OPTICAL, Cameras, Lens, mounted, single
from seals.sight.eye import Eye, Shot, Watch
from seals.sight.light import Light
from seals.sight.picture import Picture, Renderer
from seals.sight.scene import NOTHING, Detail, Poses, Scene, Shape, nowhere

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
