"""Mitsuba 3 as a viewer: photoreal frames of runs, and plain pictures for cameras."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from seals.errors import PhysicsError
from seals.field_roles import roles
from seals.plugins.viewers.mitsuba.building import Build
from seals.plugins.viewers.mitsuba.photo import photograph
from seals.plugins.viewers.mitsuba.plain import Plain
from seals.plugins.viewers.mitsuba.shapes import write_shapes
from seals.plugins.viewers.mitsuba.variant import Variant, mitsuba
from seals.rendering import Cameras, Lens, Light, Picture, Poses, Scene
from seals.rendering.optics import Optics
from seals.rendering.scene import check_scene
from seals.schema import check_tree, count, setting
from seals.view.films import Frame
from seals.view.films.settings import Quality

SAMPLES = {Quality.draft: 8, Quality.paper: 256}
"""Samples of a pixel by quality."""
DEPTHS = {Quality.draft: 8, Quality.paper: 32}
"""Most turns of a path of light by quality."""


@roles(data="denoise")
@dataclass(kw_only=True)
class RendererMitsuba:
    """Mitsuba 3 path tracer: refracting and reflecting water surface, scattering water.

    Equation:
        Radiative transfer by path tracing with volumes; Fresnel and Snell at the surface, index
        1.333; extinction, albedo and phase function of the water by its Jerlov type
        (`seals.plugins.viewers.mitsuba.building`); a clear sky and a sun of finite size.

    Args:
        variant: of Mitsuba; ``scalar_rgb`` runs everywhere, ``auto`` tries faster ones first.
        samples: of a pixel; 0 for those of the quality, 8 or 256.
        sun_radius: radius of the sun's disc [rad]; the true one, 0.0047, needs very many samples
            under water.
        denoise: whether grain is taken out, by Open Image Denoise where it is installed.

    Assumptions:
        Links are painted plastic or metal by their colour; floors are sand.

    Valid range:
        A frame of 480 x 300 pixels takes some seconds on two cores.

    Limitations:
        The wide sun draws soft shadows and no caustics: those on level floors are laid on by
        `seals.rendering.optics`; links have none. Light that goes on nearly straight counts as
        not scattered, so that the picture is not blurred by the water. No foam. For cameras of a
        run (``viewer=mitsuba``) pictures are drawn without water, which the optics lay over; they
        take seconds each.

    References:
        Jakob, W. et al. 2022, Mitsuba 3; Henyey and Greenstein 1941, ApJ 93, 70.

    Example:
        >>> RendererMitsuba().close()
    """

    variant: Variant = Variant.scalar_rgb
    samples: int = count(0, bounds=(0, 1_000_000))
    sun_radius: float = setting(0.15, "rad", bounds=(0.0047, 0.6), source="chosen")
    denoise: bool = True

    def __post_init__(self) -> None:
        """Start closed."""
        check_tree(self, where="viewer")
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._plain: Plain | None = None
        self._build: Build | None = None
        self._quality = Quality.draft

    def open(self, scene: Scene, light: Light) -> None:
        """Load a scene for cameras."""
        check_scene(scene)
        mi = mitsuba(self.variant)
        shapes = write_shapes(scene, self._fresh())
        self._plain = Plain(mi, shapes, [s for s in scene.shapes if s.kind == "plane"], light)

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return the pictures of all cameras, without water.

        Raises:
            PhysicsError: no scene is open.
        """
        if self._plain is None:
            raise PhysicsError("the renderer has no scene.\nOpen one first: open(scene, light)")
        return self._plain.render(poses, cameras, lens, normals=normals)

    def arrange(self, scene: Scene, optics: Optics, quality: Quality) -> None:
        """Prepare the frames of a film."""
        check_scene(scene)
        mi = mitsuba(self.variant)
        folder = self._fresh()
        shapes = write_shapes(scene, folder)
        planes = [s for s in scene.shapes if s.kind == "plane"]
        self._quality = quality
        self._build = Build(
            mi,
            shapes=shapes,
            planes=planes,
            optics=optics,
            sun_radius=self.sun_radius,
            folder=folder,
        )

    def photograph(self, frame: Frame) -> NDArray[np.float32]:
        """Render a frame.

        Raises:
            PhysicsError: nothing was arranged.
        """
        if self._build is None:
            raise PhysicsError("the renderer has no scene.\nArrange one first: arrange(...)")
        return photograph(
            self._build,
            frame,
            samples=self.samples or SAMPLES[self._quality],
            depth=DEPTHS[self._quality],
            denoise=self.denoise,
        )

    def _fresh(self) -> Path:
        self.close()
        self._folder = tempfile.TemporaryDirectory(prefix="seals-")
        return Path(self._folder.name)

    def close(self) -> None:
        """Remove the files of the scene; a second call does nothing."""
        self._plain = self._build = None
        if self._folder is not None:
            self._folder.cleanup()
        self._folder = None
