"""Ray casting: the nearest hit of every ray, its normal and colour.

One batched function intersects rays with each kind of primitive. A ray is (x, y, 1) in optical
axes, so its parameter is the depth. These functions return the depth at which a ray enters, shape
(M, R, K), infinite where it passes by; what is entered nearer than the lens sees is not seen. All
arrays are in single precision.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from seals.plugins.viewers.raycast.placing import Fixed, Placed
from seals.rendering.light import CONTRAST

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


def _spheres(rays: tuple[Tensor, Tensor], centre: Tensor, half: Tensor, near: float) -> Tensor:
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


def _cylinders(
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


def _levels(rays: tuple[Tensor, Tensor], up: Tensor, above: Tensor, near: float) -> Tensor:
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


class Setting(NamedTuple):
    """Constants of a compiled program.

    Args:
        counts: primitives of each kind.
        hulls: convex ones and their planes, group by group.
        near: nearest depth that is seen [m].
        far: farthest depth that is seen [m].
        ambient: share of the light that comes from everywhere [1].
        tiled: whether planes have squares.
        normals: whether normals are wanted.
    """

    counts: tuple[int, ...]
    hulls: tuple[tuple[int, int], ...]
    near: float
    far: float
    ambient: float
    tiled: bool
    normals: bool


def trace(
    rays: tuple[Tensor, Tensor], placed: Placed, fixed: Fixed, setting: Setting
) -> tuple[Tensor, Tensor, Tensor, Tensor | None]:
    """Return colour (M, R, 3), depth (M, R), parts (M, R), and normals (M, R, 3) or None.

    Args:
        rays: x and y of the rays in optical axes at depth 1, shape (R,) each.
        placed: primitives as M cameras see them.
        fixed: what never changes of them.
        setting: light and lens.
    """
    import torch

    depth, which, plane = _nearest(rays, placed, fixed, setting)
    met = depth <= setting.far
    which, safe = torch.where(met, which, 0), torch.where(met, depth, 1.0)
    points = rays[0] * safe, rays[1] * safe, safe
    normal = _normals(points, (which, plane), placed, fixed, setting.counts)
    facing = sum(normal[i] * placed.sun[:, None, i] for i in range(3))
    shade = setting.ambient + (1.0 - setting.ambient) * torch.clamp(facing, min=0.0)
    if setting.tiled:
        shade = shade * _squares(points, which, placed, fixed.tile)
    shown = torch.where(met[..., None], fixed.colour[which] * shade[..., None], fixed.sky)
    outward = None
    if setting.normals:
        outward = torch.stack(normal, dim=-1) * met[..., None]
    parts = torch.where(met, fixed.part[which], 0)
    return _linear(shown), torch.where(met, depth, torch.inf), parts, outward


def _nearest(
    rays: tuple[Tensor, Tensor], placed: Placed, fixed: Fixed, setting: Setting
) -> tuple[Tensor, Tensor, Tensor | None]:
    """Depth, number of the primitive, and the plane through which a convex one is entered."""
    import torch

    near, first = setting.near, 0
    depth: Tensor | None = None
    which: Tensor | None = None
    plane: Tensor | None = None
    for kind, count in enumerate(setting.counts):
        if not count:
            continue
        cut = slice(first, first + count)
        centre, turn, half = placed.centre[:, cut], placed.turn[:, cut], fixed.half[cut]
        through: Tensor | None = None
        if kind == 0:
            depths = _spheres(rays, centre, half, near)
        elif kind == 1:
            depths = boxes(rays, centre, turn, half, near)
        elif kind == 2:
            depths = _cylinders(rays, centre, turn, half, near)
        elif kind == 3:
            depths, through = _convex(rays, centre, turn, fixed, setting)
        else:
            depths = _levels(rays, placed.up, placed.above, near)
        nearest, number = depths.min(dim=-1)
        if through is not None:
            plane = torch.gather(through, -1, number[..., None])[..., 0]
        number = number + first
        if depth is not None and which is not None:
            number = torch.where(nearest < depth, number, which)
            nearest = torch.minimum(nearest, depth)
        depth, which = nearest, number
        first += count
    if depth is None or which is None:
        shape = (placed.up.shape[0], rays[0].shape[0])
        depth = torch.full(shape, torch.inf, device=placed.up.device)
        which = torch.zeros(shape, dtype=torch.int64, device=placed.up.device)
    return depth, which, plane


def _convex(
    rays: tuple[Tensor, Tensor], centre: Tensor, turn: Tensor, fixed: Fixed, setting: Setting
) -> tuple[Tensor, Tensor]:
    """Intersect rays with convex solids, group by group; planes are numbered across all groups."""
    import torch

    depths, through, first, row = [], [], 0, 0
    for count, size in setting.hulls:
        cut, rows = slice(first, first + count), slice(row, row + count * size)
        planes = fixed.normals[rows].view(count, size, 3), fixed.offsets[rows].view(count, size)
        depth, plane = hulls(rays, centre[:, cut], turn[:, cut], planes, setting.near)
        start = torch.arange(count, device=plane.device) * size + row
        depths.append(depth)
        through.append(plane + start)
        first, row = first + count, row + count * size
    return torch.cat(depths, dim=-1), torch.cat(through, dim=-1)


def _normals(
    points: tuple[Tensor, Tensor, Tensor],
    hit: tuple[Tensor, Tensor | None],
    placed: Placed,
    fixed: Fixed,
    counts: tuple[int, ...],
) -> list[Tensor]:
    """Outward normals in optical axes, three components of shape (M, R)."""
    import torch

    which, plane = hit
    balls, boxes, rods, convex, levels = counts
    solid = balls + boxes + rods + convex
    up = [placed.up[:, None, i].expand(which.shape) for i in range(3)]
    if not solid:
        return up
    inside = torch.clamp(which, max=solid - 1)
    turn = _picked(placed.turn.flatten(2), inside)
    away = _picked(placed.centre, inside)
    offset = [points[j] - away[..., j] for j in range(3)]
    point = [sum(turn[..., 3 * i + j] * offset[j] for j in range(3)) for i in range(3)]
    half = fixed.half[inside]
    own = [p / half[..., 0] for p in point]
    if boxes or rods:
        flat = _flat(point, half, inside < balls + boxes)
        own = [torch.where(inside >= balls, f, o) for f, o in zip(flat, own, strict=True)]
    if convex and plane is not None:
        face = fixed.normals[plane]
        many = inside >= solid - convex
        own = [torch.where(many, face[..., i], own[i]) for i in range(3)]
    seen = [sum(turn[..., 3 * i + j] * own[i] for i in range(3)) for j in range(3)]
    if not levels:
        return seen
    return [torch.where(which < solid, s, u) for s, u in zip(seen, up, strict=True)]


def _picked(table: Tensor, number: Tensor) -> Tensor:
    """Rows of a table (M, K, n) by number (M, R)."""
    import torch

    wide = number[..., None].expand(*number.shape, table.shape[-1])
    return torch.gather(table, 1, wide)


def _flat(point: list[Tensor], half: Tensor, box: Tensor) -> list[Tensor]:
    """Normals of boxes and cylinders: that of the side nearest to the point."""
    import torch

    x, y, z = point
    a, b, c = (torch.abs(point[i]) / half[..., i] for i in range(3))
    out = torch.clamp(torch.sqrt(x * x + y * y), min=1e-12)
    mantle = out / half[..., 0]
    end = c > torch.where(box, torch.maximum(a, b), mantle)
    wide = a > b
    none = torch.zeros_like(x)
    return [
        torch.where(end, none, torch.where(box, torch.where(wide, torch.sign(x), none), x / out)),
        torch.where(end, none, torch.where(box, torch.where(wide, none, torch.sign(y)), y / out)),
        torch.where(end, torch.sign(z), none),
    ]


def _squares(
    points: tuple[Tensor, Tensor, Tensor], which: Tensor, placed: Placed, tiles: Tensor
) -> Tensor:
    """Brightness of a plane's squares, 1 elsewhere [1]."""
    import torch

    count = placed.above.shape[1]
    first = tiles.shape[0] - count
    bright = torch.ones_like(points[2])
    for k in range(count):
        tile = torch.where(tiles[first + k] > 0.0, tiles[first + k], torch.inf)
        cells = [
            torch.floor(
                (
                    sum(placed.level[:, i, j, None] * points[j] for j in range(3))
                    + placed.start[:, k, i, None]
                )
                / tile
            )
            for i in range(2)
        ]
        dark = torch.remainder(cells[0] + cells[1], 2.0) > 0.5
        bright = torch.where((which == first + k) & dark, 1.0 - CONTRAST, bright)
    return bright


def _linear(shown: Tensor) -> Tensor:
    """Convert sRGB to linear values, as `seals.rendering.optics.to_linear`, compilable."""
    import torch

    steep = ((torch.clamp(shown, min=0.04) + 0.055) / 1.055) ** 2.4
    return torch.where(shown <= 0.04045, shown / 12.92, steep)
