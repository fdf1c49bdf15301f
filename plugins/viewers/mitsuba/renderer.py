"""Mitsuba 3 as a viewer: photoreal frames of runs, and plain pictures for cameras.

The camera of a frame is in air, under water, or half submerged; Open Image Denoise takes the grain
out where it is installed. Pictures for cameras show links and ground without water.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import PhysicsError
from seals.field_roles import roles
from seals.plugins.viewers.mitsuba.building import (
    WIDE,
    Build,
    Crop,
    camera,
    plain_colour,
    pose_of,
    write_shapes,
)
from seals.plugins.viewers.mitsuba.variant import Variant, mitsuba
from seals.rendering import Cameras, Lens, Light, Picture, Poses, Scene
from seals.rendering.optics import Optics
from seals.rendering.scene import Shape, check_scene, opened
from seals.schema import check_tree, count, setting
from seals.view.films import Frame, Viewpoint
from seals.view.films.settings import Quality

_PLAIN_SAMPLES = 16
"""Samples of a pixel's colour."""


class _Plain:
    """Scene for camera images.

    Args:
        mi: the mitsuba module.
        shapes: number, shape and file of everything that is not a plane.
        planes: level planes.
        light: sun and sky.
    """

    def __init__(
        self, mi: Any, shapes: list[tuple[int, Shape, Path]], planes: list[Shape], light: Light
    ) -> None:
        self.mi, self.shapes, self.planes, self.light = mi, shapes, planes, light

    def render(self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool) -> Picture:
        """Return the pictures of all cameras, one after the other."""
        environments, count = np.shape(cameras.origin)[:2]
        found = [
            self._one(poses, n, Viewpoint(cameras.origin[n, c], cameras.rotation[n, c]), lens)
            for n in range(environments)
            for c in range(count)
        ]
        colour, depth, parts, outward = (
            np.stack(part).reshape(environments, count, *part[0].shape)
            for part in zip(*found, strict=True)
        )
        return Picture(colour, depth, parts, outward if normals else None)

    def _one(self, poses: Poses, n: int, view: Viewpoint, lens: Lens) -> tuple[Any, ...]:
        """Colour, depth, parts and normals of one camera."""
        whole = Crop(0, lens.height)
        sensor = camera(self.mi, view, lens, near=lens.near, crop=whole)
        parts, numbers = self._parts(poses, n)
        # the middle of the pixel, so that depth is that of one place
        once = {"type": "stratified", "sample_count": 1, "jitter": False}
        places = {"type": "aov", "aovs": "p:position,n:sh_normal,i:shape_index"}
        exact, order = self._drawn(parts, {**sensor, "sampler": once}, places)
        many = {"type": "independent", "sample_count": _PLAIN_SAMPLES}
        matt = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1}
        colour = self._drawn(parts, {**sensor, "sampler": many}, matt)[0][..., :3]
        place, normal, index = exact[..., -7:-4], exact[..., -4:-1], exact[..., -1]
        met = np.abs(normal).sum(axis=-1) > 0.0
        ahead = (place - view.origin) @ view.axes[:, 2]
        depth = np.where(met, ahead, np.inf).astype(np.float32)
        # it counts from one, nothing is zero
        table = np.array([numbers[name] for name in order] or [0])
        part = np.where(met, table[(np.rint(index).astype(int) - 1).clip(0, len(table) - 1)], 0)
        return colour, depth, part.astype(np.int32), normal

    def _parts(self, poses: Poses, n: int) -> tuple[dict[str, Any], dict[str, int]]:
        """Everything but camera and integrator; the number of the part of every shape."""
        place, turn = np.asarray(poses.position)[n], np.asarray(poses.rotation)[n]
        out: dict[str, Any] = {}
        numbers = {}
        for number, shape, path in self.shapes:
            matrix = pose_of(shape, place, turn)
            out[f"s{number}"] = {
                "type": "ply",
                "filename": str(path),
                "to_world": self.mi.ScalarTransform4f(matrix.tolist()),
                "bsdf": plain_colour(shape.colour),
            }
            numbers[f"s{number}"] = shape.part
        for k, plane in enumerate(self.planes):
            matrix = np.diag([WIDE, WIDE, 1.0, 1.0])
            matrix[2, 3] = float(plane.position[2])
            out[f"g{k}"] = {
                "type": "rectangle",
                "to_world": self.mi.ScalarTransform4f(matrix.tolist()),
                "bsdf": plain_colour(plane.colour),
            }
            numbers[f"g{k}"] = plane.part
        sky = (np.array(self.light.sky) * self.light.ambient).tolist()
        sun = [np.pi * self.light.diffuse] * 3
        out["ambient"] = {"type": "constant", "radiance": {"type": "rgb", "value": sky}}
        out["sun"] = {
            "type": "directional",
            "direction": [-x for x in self.light.direction],
            "irradiance": {"type": "rgb", "value": sun},
        }
        return out, numbers

    def _drawn(self, parts: dict[str, Any], sensor: Any, integrator: Any) -> tuple[Any, list[str]]:
        """Pixels, and the names of the shapes in the order that Mitsuba gives them."""
        scene = self.mi.load_dict(
            {"type": "scene", "integrator": integrator, "sensor": sensor, **parts}
        )
        pixels = np.nan_to_num(np.array(self.mi.render(scene), dtype=np.float32))
        return pixels, [str(shape.id()) for shape in scene.shapes()]


Image = NDArray[np.float32]


def denoiser() -> Any:
    """Return pyoidn's ``denoise``, or None if it is not installed or cannot be loaded."""
    try:
        from pyoidn import denoise
    except (ImportError, OSError):
        return None
    return denoise


def cleaned(colour: Image, albedo: Image, normal: Image) -> Image:
    """Return a denoised image; without a denoiser only single bright pixels are removed.

    Args:
        colour: linear, shape (H, W, 3).
        albedo: of what is seen first, 0 to 1.
        normal: of what is seen first.
    """
    denoise = denoiser()
    if denoise is None:
        from scipy.ndimage import median_filter

        # single bright pixels are replaced by the local median
        around = median_filter(colour, size=(3, 3, 1), mode="nearest")
        bright = colour.sum(axis=-1) > 4.0 * (around.sum(axis=-1) + 1e-3)
        return np.where(bright[..., None], around, colour)
    guides = [
        np.ascontiguousarray(np.nan_to_num(x), dtype=np.float32) for x in (colour, albedo, normal)
    ]
    return np.asarray(
        denoise(guides[0], albedo=np.clip(guides[1], 0.0, 1.0), normal=guides[2], hdr=True)
    )


FINER = 3
"""Points of a pixel along an edge at which it is asked whether the port is under water there."""


def photograph(build: Build, frame: Frame, *, samples: int, depth: int, denoise: bool) -> Image:
    """Render a frame; linear colour, white is 1, shape (H, W, 3).

    Args:
        build: of the film.
        frame: what it shows.
        samples: of a pixel.
        depth: most turns of a path of light.
        denoise: whether grain is taken out.
    """
    share = wet_share(frame)
    parts = build.links(frame.poses) | build.sky() | build.water(frame) | build.ground(frame)
    image = np.zeros((frame.lens.height, frame.lens.width, 3), dtype=np.float32)
    for wet, weight in ((False, 1.0 - share), (True, share)):
        rows = np.flatnonzero(weight.any(axis=1))
        if not len(rows):
            continue
        # more rows than needed: the denoiser looks about
        first, last = max(int(rows[0]) - 4, 0), min(int(rows[-1]) + 5, frame.lens.height)
        crop = Crop(first, last - first)
        sensor = build.sensor(frame, crop, wet=wet, samples=samples)
        fog = build.fog if wet else 0.0
        seen = _shot(build.mi, {**parts, "sensor": sensor}, depth, denoise=denoise, fog=fog)
        image[first:last] += weight[first:last, :, None].astype(np.float32) * seen
    return image


def _shot(mi: Any, parts: dict[str, Any], depth: int, *, denoise: bool, fog: float = 0.0) -> Image:
    """Render one image; fog is the extinction of what the camera stands in [1/m]."""
    inner = {"type": "volpath", "max_depth": depth, "rr_depth": 3}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "aov", "aovs": "d:depth,a:albedo,n:sh_normal", "image": inner},
            **parts,
        }
    )
    pixels = np.nan_to_num(np.array(mi.render(scene), dtype=np.float32))
    colour = pixels[..., :3]
    if not denoise:
        return colour
    # guides fade as what they tell of does: else the horizon under water is drawn as a line
    clear = faded(pixels[..., -7:-6], fog)
    return np.maximum(cleaned(colour, clear * pixels[..., -6:-3], clear * pixels[..., -3:]), 0.0)


def faded(distance: Image, fog: float) -> Image:
    """Return the share of the light of what is seen first that arrives [1].

    Args:
        distance: of what is seen first; 0 where nothing is [m].
        fog: extinction [1/m].

    Example:
        >>> faded(np.array([0.0, 1.0]), 0.0).tolist(), faded(np.array([0.0, 1.0]), 1e3).tolist()
        ([1.0, 1.0], [0.0, 0.0])
    """
    if fog <= 0.0:
        return np.ones_like(distance)
    return np.asarray(np.where(distance > 0.0, np.exp(-fog * distance), 0.0))


def wet_share(frame: Frame) -> NDArray[np.float64]:
    """Return the fraction of every pixel whose ray starts under water, shape (H, W)."""
    lens, (origin, axes) = frame.lens, frame.view
    if frame.water is None:
        return np.zeros((lens.height, lens.width))
    steps = (np.arange(FINER) + 0.5) / FINER
    columns = (np.arange(lens.width)[:, None] + steps).ravel()
    rows = (np.arange(lens.height)[:, None] + steps).ravel()
    x, y = np.meshgrid((columns - lens.cx) / lens.fx, (rows - lens.cy) / lens.fy)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ axes.T
    wet = frame.water.covers(origin + frame.port * rays, frame.time).astype(float)
    split = wet.reshape(lens.height, FINER, lens.width, FINER)
    found: NDArray[np.float64] = split.mean(axis=(1, 3))
    return found


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
        self._plain: _Plain | None = None
        self._build: Build | None = None
        self._quality = Quality.draft

    def open(self, scene: Scene, light: Light) -> None:
        """Load a scene for cameras."""
        check_scene(scene)
        mi = mitsuba(self.variant)
        shapes = write_shapes(scene, self._fresh())
        self._plain = _Plain(mi, shapes, [s for s in scene.shapes if s.kind == "plane"], light)

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return the pictures of all cameras, without water.

        Raises:
            PhysicsError: no scene is open.
        """
        return opened(self._plain).render(poses, cameras, lens, normals=normals)

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
