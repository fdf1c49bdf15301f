"""Both PyBullet renderers: the rasteriser on the CPU, and OpenGL without a display (EGL)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from seals.child_process import tried
from seals.errors import MissingExtra
from seals.plugins.viewers.bullet.client import engine
from seals.plugins.viewers.bullet.drawing import Drawing, Sampling
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import Light
from seals.rendering.picture import Picture
from seals.rendering.scene import Poses, Scene, opened

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
        return opened(self._drawing).render(poses, cameras, lens, normals=normals)

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


_EGL_SAMPLING = Sampling("ER_BULLET_HARDWARE_OPENGL", (0.0, 0.0))
ENTRY = "_eglRendererPlugin"
"""Prefix of the plug-in's functions."""
PATIENCE = 60.0
"""How long a first picture may take [s]."""
_TRIAL = Path(__file__).with_name("egl_trial.py")


@dataclass(kw_only=True)
class RendererEgl(RendererBullet):
    """OpenGL renderer through EGL: fast on a graphics card, slow on a software driver.

    Equation:
        Pinhole projection, depth buffer; shading by PyBullet's own shader.

    Assumptions:
        A driver for EGL is installed. It is tried in a process of its own first, because one that
        is missing or broken can end the program.

    Valid range:
        Linux; one scene a process.

    Limitations:
        Best effort: colours follow PyBullet's shader and differ from the other renderers'.

    References:
        Coumans and Bai 2016-2021, PyBullet, eglRenderer plug-in.

    Example:
        >>> RendererEgl().close()
    """

    def begin(self, scene: Scene, light: Light) -> Drawing:
        """Test the driver, then load the scene.

        Raises:
            MissingExtra: the plug-in or a driver is missing, or the trial failed.
        """
        # the file of PyBullet's EGL plug-in
        engine("egl")
        found = find_spec("eglRenderer")
        if found is None or found.origin is None:
            raise MissingExtra(
                "viewer=egl needs PyBullet's plug-in eglRenderer, which this build does not have.\n"
                "Draw on the processor: viewer=tiny"
            )
        plugin = found.origin
        try_out(plugin)
        return Drawing(scene, light, _EGL_SAMPLING, "egl", (plugin, ENTRY))


def try_out(plugin: str) -> None:
    """Test the driver by rendering a picture in a child process.

    Raises:
        MissingExtra: it did not work; the message says how it ended.
    """
    code, last = tried(_TRIAL, plugin, seconds=PATIENCE)
    if code != 0:
        ended = f"took more than {PATIENCE:g} s" if code is None else f"ended with code {code}"
        raise MissingExtra(
            f"viewer=egl: a trial picture {ended} ({last[:120] or 'no words'}).\n"
            "Install a driver for EGL (Debian: libegl1, libgl1-mesa-dri), or draw on the "
            "processor: viewer=tiny"
        )
