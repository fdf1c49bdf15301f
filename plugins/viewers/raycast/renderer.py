"""Renderer plug-in of the ray caster: device, blocks of rays, compiled programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.caches import use_private_compiler_cache
from seals.errors import ConfigError, optional_import, refuse_unlisted
from seals.field_roles import roles
from seals.plugins.viewers.raycast.placing import Fixed, Placed, fixed_of
from seals.plugins.viewers.raycast.solids import Tables
from seals.plugins.viewers.raycast.tracing import Setting, trace
from seals.rendering.camera import Cameras, Lens
from seals.rendering.light import Light
from seals.rendering.picture import Picture
from seals.rendering.scene import Poses, Scene, check_scene, opened
from seals.schema import setting

Tensor = Any
DEVICES = ("cpu", "cuda")
BLOCK = {"cpu": 0.5, "cuda": 2000.0}
"""Memory of one intermediate array [MB]: what a core's cache holds, or a share of a card's."""


@roles(data="device fused")
@dataclass(kw_only=True)
class RendererRaycast:
    """Ray caster in PyTorch: one ray per pixel against primitives, many cameras at once.

    Equation:
        Closed forms of ray and sphere, box, cylinder, convex polyhedron and level plane; Lambert
        shading (`seals.rendering.light.Light`).

    Args:
        device: ``cpu`` or ``cuda``, or one card such as ``cuda:1``.
        fused: whether torch.compile turns the arithmetic into few large programs; the first
            picture of each size then takes some ten seconds.
        block: memory of one intermediate array [MB]; 0 for what suits the device.

    Assumptions:
        Links are opaque. Every connected piece of a mesh is convex, as those of the robots here; a
        hollow one is drawn as its hull. Prisms and balls of many sides are drawn round.

    Valid range:
        Scenes of some tens of primitives: every ray meets every one.

    Limitations:
        No shadows, no textures, no half-transparent links; edges are not smoothed. Single
        precision: depth within some 1e-6 of itself.

    References:
        Haines et al. 2019, Ray Tracing Gems, ch. 7 (spheres); Kay and Kajiya 1986, SIGGRAPH
        (slabs); Haines 1991, Graphics Gems II, ch. V.1 (convex polyhedra).

    Example:
        >>> RendererRaycast(device="cpu").close()
    """

    device: str = "cpu"
    fused: bool = False
    block: float = setting(0.0, "MB", bounds=(0.0, 1e5), source="chosen")

    def __post_init__(self) -> None:
        """Refuse an unknown device; torch waits until `open`."""
        family = self.device.partition(":")[0]
        refuse_unlisted(family, DEVICES, f"device={self.device} is not known to the ray caster")
        self._scene: tuple[Tables, Fixed, Light] | None = None
        self._programs: dict[Setting, Callable[..., Any]] = {}
        self._rays: dict[Lens, tuple[Tensor, Tensor]] = {}

    def open(self, scene: Scene, light: Light) -> None:
        """Prepare a scene.

        Raises:
            MissingExtra: torch is not installed.
            ConfigError: the device is absent.
        """
        check_scene(scene)
        _check_device(self.device)
        self.close()
        tables = Tables.of(scene)
        self._scene = tables, fixed_of(tables, light.sky, self.device), light

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return the pictures of all cameras.

        Cameras given as tensors get tensors on the device; those given as NumPy arrays get arrays.

        Raises:
            PhysicsError: no scene is open.
        """
        import torch

        tables, fixed, light = opened(self._scene)
        count, views = cameras.origin.shape[:2]
        setting = Setting(
            tables.counts,
            tables.hulls,
            lens.near,
            lens.far,
            light.ambient,
            bool(np.any(tables.tile > 0)),
            normals,
        )
        with torch.no_grad():
            placed = fixed.place(tables.counts[-1], poses, cameras, light.direction)
            images = self._images(placed, fixed, lens, setting)
            size = (count, views, lens.height, lens.width)
            colour, depth, parts, outward = images
            picture = Picture(
                colour.reshape(*size, 3),
                depth.reshape(size),
                parts.reshape(size),
                None if outward is None else _turned(outward, cameras, size),
            )
        if isinstance(cameras.origin, torch.Tensor):
            return picture
        return Picture(*(None if x is None else x.cpu().numpy() for x in picture))

    def _images(
        self, placed: Placed, fixed: Fixed, lens: Lens, setting: Setting
    ) -> tuple[Tensor, Tensor, Tensor, Tensor | None]:
        """Trace in blocks of cameras and rays, so that memory stays bounded."""
        import torch

        if lens not in self._rays:
            rays = torch.as_tensor(lens.rays().reshape(-1, 3).copy(), device=self.device)
            self._rays[lens] = rays[:, 0].contiguous(), rays[:, 1].contiguous()
        x, y = self._rays[lens]
        views, pixels = placed.up.shape[0], x.shape[0]
        device, single = x.device, torch.float32
        colour = torch.empty((views, pixels, 3), dtype=single, device=device)
        depth = torch.empty((views, pixels), dtype=single, device=device)
        parts = torch.empty((views, pixels), dtype=torch.int32, device=device)
        outward = torch.empty_like(colour) if setting.normals else None
        program = self._program(setting)
        # rays of a block, by the widest array that they make
        memory = (self.block or BLOCK[self.device.partition(":")[0]]) * 1e6
        widest = max(fixed.half.shape[0], *(n * size for n, size in setting.hulls), 1)
        for rows, cut in _blocks(views, pixels, max(int(memory / 4.0 / widest), 256)):
            found = program((x[cut], y[cut]), placed.of(rows), fixed, setting)
            colour[rows, cut], depth[rows, cut], parts[rows, cut] = found[:3]
            if outward is not None:
                outward[rows, cut] = found[3]
        return colour, depth, parts, outward

    def _program(self, setting: Setting) -> Callable[..., Any]:
        """Return the ray-casting function, compiled once for each setting if wanted."""
        if not self.fused:
            return trace
        if setting not in self._programs:
            import torch

            use_private_compiler_cache()
            self._programs[setting] = torch.compile(trace, dynamic=False)
        return self._programs[setting]

    def close(self) -> None:
        """Release memory; a second call does nothing."""
        self._scene = None
        self._programs.clear()
        self._rays.clear()


def _blocks(views: int, pixels: int, most: int) -> list[tuple[slice, slice]]:
    """Split cameras and pixels into blocks of at most ``most`` rays, of equal size if possible.

    Example:
        >>> _blocks(3, 100, 200)
        [(slice(0, 2, None), slice(0, 100, None)), (slice(2, 3, None), slice(0, 100, None))]
        >>> len(_blocks(1, 100, 30))
        4
    """
    if pixels <= most:
        pieces = -(-views // (most // pixels))
        step = -(-views // pieces)
        return [(slice(k, min(k + step, views)), slice(0, pixels)) for k in range(0, views, step)]
    pieces = -(-pixels // most)
    step = -(-pixels // pieces)
    cuts = [slice(k, min(k + step, pixels)) for k in range(0, pixels, step)]
    return [(slice(v, v + 1), cut) for v in range(views) for cut in cuts]


def _turned(outward: Tensor, cameras: Cameras, size: tuple[int, ...]) -> Tensor:
    """Normals from optical to world axes."""
    import torch

    axes = torch.as_tensor(cameras.rotation, dtype=outward.dtype, device=outward.device)
    flat = outward.reshape(*size[:2], -1, 3)
    return (flat @ axes.transpose(-1, -2)).reshape(*size, 3)


def _check_device(device: str) -> None:
    """Refuse a missing torch or card."""
    with optional_import(
        "viewer=raycast needs torch",
        "Install it: pip install 'aam-seals[learn]'; or draw with viewer=tiny",
    ):
        import torch
    if device.startswith("cuda"):
        count = torch.cuda.device_count() if torch.cuda.is_available() else 0
        number = device.partition(":")[2] or "0"
        if not number.isdigit() or int(number) >= count:
            raise ConfigError(
                f"device={device}: torch {torch.__version__} sees {count} graphics cards.\n"
                "Draw on the processor: viewer.device=cpu"
            )
