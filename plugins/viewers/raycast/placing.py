"""Transformation of primitives to the axes of every camera."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Array
from seals.plugins.viewers.raycast.solids import Tables
from seals.rendering.camera import Cameras
from seals.rendering.scene import Poses

Tensor = Any
"""A torch tensor; torch is imported when a scene is opened."""


class Fixed(NamedTuple):
    """Constant part of a scene as tensors on the device; shapes as in `Tables`.

    ``sky`` is the displayed colour of what nothing covers, shape (3,).
    """

    half: Tensor
    position: Tensor
    rotation: Tensor
    colour: Tensor
    part: Tensor
    frame: Tensor
    normals: Tensor
    offsets: Tensor
    tile: Tensor
    sky: Tensor

    def place(
        self, planes: int, poses: Poses, cameras: Cameras, sun: tuple[float, float, float]
    ) -> Placed:
        """Return the primitives in the axes of all cameras, environment by environment.

        Differences of places are taken in double precision: a scene may lie far from the origin.

        Args:
            planes: how many of them, at the end, are planes.
            poses: of the frames.
            cameras: C in each of N environments.
            sun: direction to the sun, world axes.
        """
        import torch

        device, double = self.half.device, torch.float64

        def tensor(values: Array) -> Tensor:
            return torch.as_tensor(values, dtype=double, device=device)

        origin, axes = tensor(cameras.origin), tensor(cameras.rotation)
        position, rotation = tensor(poses.position), tensor(poses.rotation)
        count = origin.shape[0]
        # the frame that stands still comes last
        position = torch.cat([position, position.new_zeros(count, 1, 3)], dim=1)
        still = torch.eye(3, dtype=double, device=device).expand(count, 1, 3, 3)
        rotation = torch.cat([rotation, still], dim=1)
        carried = rotation[:, self.frame]
        centre = position[:, self.frame] + (carried @ self.position[..., None])[..., 0]
        turn = carried @ self.rotation
        back = axes.transpose(-1, -2)
        seen = (centre[:, None] - origin[:, :, None]) @ axes
        to_own = turn.transpose(-1, -2)[:, None] @ axes[:, :, None]
        heights = self.position[self.position.shape[0] - planes :, 2]
        tiles = self.tile[self.position.shape[0] - planes :].to(double)
        span = 2.0 * torch.where(tiles > 0.0, tiles, torch.ones_like(tiles))
        start = torch.remainder(origin[:, :, None, :2], span[:, None])
        single = torch.float32
        whole = origin.shape[0] * origin.shape[1]

        def rows(values: Tensor) -> Tensor:
            return values.to(single).reshape(whole, *values.shape[2:]).contiguous()

        return Placed(
            centre=rows(seen),
            turn=rows(to_own),
            up=rows(back[..., 2]),
            sun=rows(back @ tensor(np.array(sun))),
            level=rows(axes[..., :2, :]),
            start=rows(start),
            above=rows(origin[..., 2:] - heights),
        )


class Placed(NamedTuple):
    """Primitives in the axes of M cameras, single precision.

    Args:
        centre: optical axes [m], shape (M, K, 3).
        turn: R_KO, from optical axes to those of the primitive, shape (M, K, 3, 3).
        up: world z in optical axes, shape (M, 3).
        sun: direction to the sun, optical axes, shape (M, 3).
        level: first two rows of R_WO, shape (M, 2, 3).
        start: place of the camera above every plane, modulo two of its tiles [m], (M, Kp, 2).
        above: height of the camera above every plane [m], shape (M, Kp).
    """

    centre: Tensor
    turn: Tensor
    up: Tensor
    sun: Tensor
    level: Tensor
    start: Tensor
    above: Tensor

    def of(self, cut: slice) -> Placed:
        """Return the primitives of some of the cameras."""
        return Placed(*(x[cut] for x in self))


def fixed_of(tables: Tables, sky: tuple[float, float, float], device: str) -> Fixed:
    """Return the tables as tensors; positions in double precision."""
    import torch

    def tensor(values: Any, kind: Any) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(values), dtype=kind, device=device)

    return Fixed(
        half=tensor(tables.half, torch.float32),
        position=tensor(tables.position, torch.float64),
        rotation=tensor(tables.rotation, torch.float64),
        colour=tensor(tables.colour, torch.float32),
        part=tensor(tables.part, torch.int32),
        frame=tensor(tables.frame, torch.int64),
        normals=tensor(tables.normals, torch.float32),
        offsets=tensor(tables.offsets, torch.float32),
        tile=tensor(tables.tile, torch.float32),
        sky=tensor(sky, torch.float32),
    )
