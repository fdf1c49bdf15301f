"""Ray-primitive intersection: one batched function for each kind of primitive.

A ray is (x, y, 1) in optical axes, so its parameter is the depth. Every function returns the depth
at which a ray enters, shape (M, R, K), infinite where it passes by; what is entered nearer than the
lens sees is not seen. All arrays are in single precision.
"""

from __future__ import annotations

from typing import Any

Tensor = Any
SMALL = 1e-20
"""Stands for a direction of zero [1]."""


def _local(
    rays: tuple[Tensor, Tensor], centre: Tensor, turn: Tensor
) -> tuple[list[Tensor], list[Tensor]]:
    """Return directions (M, R, K) and starts (M, 1, K) in axes of the primitives, by component.

    Args:
        rays: x and y of the rays, shape (R,) each.
        centre: shape (M, K, 3).
        turn: R_KO, shape (M, K, 3, 3).
    """
    x, y = (r[None, :, None] for r in rays)
    rows = turn[:, None]
    along = [rows[..., i, 0] * x + rows[..., i, 1] * y + rows[..., i, 2] for i in range(3)]
    start = -(turn @ centre[..., None])[..., 0][:, None]
    return along, [start[..., i] for i in range(3)]


def spheres(rays: tuple[Tensor, Tensor], centre: Tensor, half: Tensor, near: float) -> Tensor:
    """Return entry distances of spheres.

    b^2 - 4 a c loses digits for small spheres far away; this form does not (Haines et al. 2019, Ray
    Tracing Gems, ch. 7).
    """
    import torch

    x, y = (r[None, :, None] for r in rays)
    cx, cy, cz = (centre[:, None, :, i] for i in range(3))
    square = x * x + y * y + 1.0
    middle = (x * cx + y * cy + cz) / square
    aside = (cx - middle * x) ** 2 + (cy - middle * y) ** 2 + (cz - middle) ** 2
    inside = half[:, 0] ** 2 - aside
    depth = middle - torch.sqrt(torch.clamp(inside, min=0.0) / square)
    return torch.where((inside > 0.0) & (depth >= near), depth, torch.inf)


def boxes(
    rays: tuple[Tensor, Tensor], centre: Tensor, turn: Tensor, half: Tensor, near: float
) -> Tensor:
    """Return entry distances of boxes, by the slab method."""
    import torch

    along, start = _local(rays, centre, turn)
    into, out = [], []
    for i in range(3):
        scale = 1.0 / _apart(along[i])
        middle, reach = -start[i] * scale, half[:, i] * torch.abs(scale)
        into.append(middle - reach)
        out.append(middle + reach)
    first = torch.maximum(torch.maximum(into[0], into[1]), into[2])
    last = torch.minimum(torch.minimum(out[0], out[1]), out[2])
    return torch.where((first <= last) & (first >= near), first, torch.inf)


def cylinders(
    rays: tuple[Tensor, Tensor], centre: Tensor, turn: Tensor, half: Tensor, near: float
) -> Tensor:
    """Return entry distances of cylinders: side and caps."""
    import torch

    (dx, dy, dz), (ox, oy, oz) = _local(rays, centre, turn)
    square = torch.clamp(dx * dx + dy * dy, min=SMALL)
    middle = -(ox * dx + oy * dy) / square
    aside = (ox + middle * dx) ** 2 + (oy + middle * dy) ** 2
    inside = half[:, 0] ** 2 - aside
    chord = torch.sqrt(torch.clamp(inside, min=0.0) / square)
    scale = 1.0 / _apart(dz)
    level, reach = -oz * scale, half[:, 2] * torch.abs(scale)
    first = torch.maximum(middle - chord, level - reach)
    last = torch.minimum(middle + chord, level + reach)
    met = (inside > 0.0) & (first <= last) & (first >= near)
    return torch.where(met, first, torch.inf)


def hulls(
    rays: tuple[Tensor, Tensor],
    centre: Tensor,
    turn: Tensor,
    planes: tuple[Tensor, Tensor],
    near: float,
) -> tuple[Tensor, Tensor]:
    """Return entry distances of convex solids of P planes, and the plane hit, (M, R, K).

    Args:
        rays: x and y of the rays.
        centre: shape (M, K, 3).
        turn: R_KO, shape (M, K, 3, 3).
        planes: normals (K, P, 3) and offsets (K, P).
        near: nearest depth that is seen [m].
    """
    import torch

    normals, offsets = planes
    # in optical axes, (M, K, P, 3): inside is n . (depth ray - centre) <= offset
    n = normals @ turn
    room = offsets + (n @ centre[..., None])[..., 0]
    x, y = (r[None, :, None, None] for r in rays)
    n, room = n[:, None], room[:, None]
    slope = n[..., 0] * x + n[..., 1] * y + n[..., 2]
    depth = room / _apart(slope)
    into = torch.where(slope < 0.0, depth, -torch.inf)
    out = torch.where(slope >= 0.0, depth, torch.inf)
    first, through = into.max(dim=-1)
    last = out.amin(dim=-1)
    met = (first <= last) & (first >= near)
    return torch.where(met, first, torch.inf), through


def levels(rays: tuple[Tensor, Tensor], up: Tensor, above: Tensor, near: float) -> Tensor:
    """Return distances to level planes from above, shape (M, R, Kp).

    Args:
        rays: x and y of the rays.
        up: world z in optical axes, shape (M, 3).
        above: height of the camera above the planes [m], shape (M, Kp).
        near: nearest depth that is seen [m].
    """
    import torch

    x, y = rays
    down = -(up[:, None, 0] * x + up[:, None, 1] * y + up[:, None, 2])[..., None]
    height = above[:, None]
    depth = height / torch.clamp(down, min=SMALL)
    return torch.where((down > SMALL) & (height > 0.0) & (depth >= near), depth, torch.inf)


def _apart(values: Tensor) -> Tensor:
    """Return values clamped away from zero, signs kept."""
    import torch

    return torch.where(torch.abs(values) < SMALL, SMALL, values)
