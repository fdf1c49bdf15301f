"""Rendering: scenes, cameras, images, and the interface of renderers."""

from seals.rendering.camera import OPTICAL as OPTICAL
from seals.rendering.camera import Cameras as Cameras
from seals.rendering.camera import Lens as Lens
from seals.rendering.camera import mounted as mounted
from seals.rendering.camera_view import CameraView as CameraView
from seals.rendering.camera_view import SceneView as SceneView
from seals.rendering.camera_view import Shot as Shot
from seals.rendering.light import Light as Light
from seals.rendering.picture import Picture as Picture
from seals.rendering.picture import Renderer as Renderer
from seals.rendering.scene import NOTHING as NOTHING
from seals.rendering.scene import Detail as Detail
from seals.rendering.scene import Poses as Poses
from seals.rendering.scene import Scene as Scene
from seals.rendering.scene import Shape as Shape
