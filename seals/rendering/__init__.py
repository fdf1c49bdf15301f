"""Rendering: scenes, cameras, images, and the interface of renderers."""

from seals.rendering.camera import OPTICAL, Cameras, Lens, mounted, single
from seals.rendering.camera_view import CameraView, SceneView, Shot
from seals.rendering.light import Light
from seals.rendering.picture import Picture, Renderer
from seals.rendering.scene import NOTHING, Detail, Poses, Scene, Shape, nowhere

__all__ = [
    "NOTHING",
    "OPTICAL",
    "CameraView",
    "Cameras",
    "Detail",
    "Lens",
    "Light",
    "Picture",
    "Poses",
    "Renderer",
    "Scene",
    "SceneView",
    "Shape",
    "Shot",
    "mounted",
    "nowhere",
    "single",
]
