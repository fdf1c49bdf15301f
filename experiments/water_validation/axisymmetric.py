"""Reference of an entry without data: ideal flow about a body of revolution on a fine grid."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from seals.arrays import Floats

WIDE, DEEP, ABOVE = 5.0, 4.0, 1.5
"""Radius and depth of the water, and room above it [radii]."""
COURANT = 0.5
"""Way of the water in a step, of a cell [1]."""
LIVELY = 0.98
"""Share of a particle's velocity that it keeps; the rest is that of the grid [1]."""
LEAST = 0.05
"""Least distance of a cell from the surface, of a cell [1]: the pressure there is zero."""
BESIDE = 0.3
"""Distance of a cell's middle from the body within which water fills it [cells]: half a cell would
hold the water at the cylinder above the edge, which it has left."""
FACE, LEVEL = (0.0, 0.5), (0.5, 0.0)
"""Places of the velocities along r and z in a cell [1]."""

Mask = NDArray[np.bool_]


class _Grid(NamedTuple):
    """Cells of a half plane through the axis; lengths in radii of the body.

    Args:
        size: of a cell.
        low: z of the bottom; the lowest point of the body is at zero.
        middles: r of the cells, shape (nr, 1).
        sides: r of their sides, shape (nr + 1, 1).
        open_r: share of the sides at constant r outside of the body, shape (nr + 1, nz).
        open_z: the same of those at constant z, shape (nr, nz + 1).
        inside: distance of the cells' middles from the body, below zero in it, shape (nr, nz).
        places: r and z of the middles, shape (nr, nz, 2).
    """

    size: float
    low: float
    middles: Floats
    sides: Floats
    open_r: Floats
    open_z: Floats
    inside: Floats
    places: Floats

    def cells(self, places: Floats, offset: tuple[float, float]) -> Floats:
        """Return places in cells, counted from the first node of a field."""
        return (places - (0.0, self.low)) / self.size - offset

    def projected(self, surface: Floats, u: Floats, w: Floats) -> tuple[Floats, Floats, float]:
        """Return the velocities without divergence, and the impulse on the body.

        Equation: div (a grad p) = div (a u), a the open areas of the sides (Batty et al. 2007); the
        impulse is the sum of p over the closed area of each cell, seen along z.
        """
        area_r, area_z = self.sides * self.open_r, self.middles * self.open_z
        whole = area_r[1:] + area_r[:-1] + area_z[:, 1:] + area_z[:, :-1]
        wet = (surface < 0.0) & (whole > 1e-8)
        sides = (
            _Sides.of(surface, wet, area_r[1:-1], 0),
            _Sides.of(surface, wet, area_z[:, 1:-1], 1),
        )
        flow = np.diff(area_r * u, axis=0) + np.diff(area_z * w, axis=1)
        p = _pressure(sides, wet, flow)
        u, known_u = _pushed(u, p, sides[0], 0)
        w, known_w = _pushed(w, p, sides[1], 1)
        known_u[[0, -1]], known_w[:, 0] = True, True
        closed = self.middles * (self.open_z[:, :-1] - self.open_z[:, 1:])
        impulse = 2.0 * math.pi * self.size**2 * float((p * closed).sum())
        return _extended(u, known_u), _extended(w, known_w), impulse

    def fields(self, places: Floats, velocity: Floats) -> tuple[Floats, Floats]:
        """Return the velocities at the sides of the cells, by those of the particles."""
        nr, nz = self.inside.shape
        u, known_u = _spread(self.cells(places, FACE), velocity[:, 0], (nr + 1, nz))
        w, known_w = _spread(self.cells(places, LEVEL), velocity[:, 1], (nr, nz + 1))
        u[[0, -1]], w[:, 0] = 0.0, 1.0
        known_u[[0, -1]], known_w[:, 0] = True, True
        return _extended(u, known_u), _extended(w, known_w)

    def sampled(self, fields: tuple[Floats, Floats], places: Floats) -> Floats:
        """Return the velocities of the grid at some places, linear between the sides."""
        both = zip(fields, (FACE, LEVEL), strict=True)
        found = [
            map_coordinates(field, self.cells(places, offset).T, order=1, mode="nearest")
            for field, offset in both
        ]
        return np.stack(found, -1)

    def lattice(self, rows: int) -> Floats:
        """Return places of four particles in each cell of the lowest rows, shape (count, 2)."""
        half = (np.arange(2) + 0.5) / 2.0
        r = ((np.arange(len(self.middles))[:, None] + half) * self.size).ravel()
        z = self.low + ((np.arange(rows)[:, None] + half) * self.size).ravel()
        return np.stack(np.meshgrid(r, z, indexing="ij"), -1).reshape(-1, 2)


def _distance(slope: float | None, r: Floats, z: Floats) -> Floats:
    """Return the distance from a sphere (no slope) or a cylinder with a cone below, both R = 1."""
    if slope is None:
        return np.hypot(r, z - 1.0) - 1.0
    return np.maximum((r * slope - z) / math.hypot(1.0, slope), r - 1.0)


def _grid(slope: float | None, cells: int) -> _Grid:
    """Return the grid with the open shares of its sides, by 16 points on each."""
    size, low = 1.0 / cells, -DEEP
    nr, nz = round(WIDE * cells), round((DEEP + ABOVE) * cells)
    part = (np.arange(16) + 0.5) / 16.0
    r: Floats = size * np.arange(nr + 1, dtype=np.float64)
    z: Floats = low + size * np.arange(nz + 1, dtype=np.float64)
    along = low + (np.arange(nz)[:, None] + part) * size
    out = (np.arange(nr)[:, None] + part) * size
    shape_r, shape_z = (nr + 1, nz, 16), (nr, nz + 1, 16)
    over = np.broadcast_to(along[None], shape_r)
    open_r = (_distance(slope, np.broadcast_to(r[:, None, None], shape_r), over) > 0.0).mean(-1)
    open_r[-1] = 0.0
    rings = np.broadcast_to(out[:, None], shape_z)
    free = _distance(slope, rings, np.broadcast_to(z[:, None], shape_z)) > 0.0
    open_z = (free * rings).sum(-1) / rings.sum(-1)
    middles = r[:-1] + 0.5 * size
    places = np.stack(np.meshgrid(middles, z[:-1] + 0.5 * size, indexing="ij"), -1)
    inside = _distance(slope, places[..., 0], places[..., 1])
    return _Grid(size, low, middles[:, None], r[:, None], open_r, open_z, inside, places)


def _spread(cells: Floats, values: Floats, shape: tuple[int, int]) -> tuple[Floats, Mask]:
    """Return the mean of the particles' values at the nodes, and where there is one."""
    first = np.floor(cells).astype(int)
    part = cells - first
    total, weight = np.zeros(shape[0] * shape[1]), np.zeros(shape[0] * shape[1])
    for a in (0, 1):
        for b in (0, 1):
            share = np.abs(1 - a - part[:, 0]) * np.abs(1 - b - part[:, 1])
            i, j = first[:, 0] + a, first[:, 1] + b
            row = (i >= 0) & (i < shape[0]) & (j >= 0) & (j < shape[1])
            at = i[row] * shape[1] + j[row]
            total += np.bincount(at, share[row] * values[row], len(total))
            weight += np.bincount(at, share[row], len(total))
    known = weight > 1e-9
    found = np.where(known, total / np.maximum(weight, 1e-9), 0.0)
    return found.reshape(shape), known.reshape(shape)


def _extended(field: Floats, known: Mask) -> Floats:
    """Return a field with the nearest known value where there is none."""
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    found: Floats = field[tuple(nearest)]
    return found


class _Sides(NamedTuple):
    """Sides between neighbours along one axis.

    Args:
        low: selects their cells before them.
        high: selects their cells behind them.
        area: open, for each radian.
        both: whether both cells are wet.
        out: whether the water ends behind them.
        back: whether it ends before them.
        way: from the wet middle to the pressure of the other cell, or to the surface [cells].
    """

    low: tuple[slice, slice]
    high: tuple[slice, slice]
    area: Floats
    both: Mask
    out: Mask
    back: Mask
    way: Floats

    @classmethod
    def of(cls, surface: Floats, wet: Mask, area: Floats, axis: int) -> _Sides:
        """Return the sides along an axis; the surface may lie within a cell (Gibou et al. 2002)."""
        low = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        high = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
        both = wet[low] & wet[high] & (area > 0.0)
        out, back = wet[low] & ~wet[high], wet[high] & ~wet[low]
        own = np.where(out, surface[low], surface[high])
        other = np.where(out, surface[high], surface[low])
        ends = (out | back) & (own < other)
        part = np.clip(own / np.where(ends, own - other, 1.0), LEAST, 1.0)
        return cls(low, high, area, both, out, back, np.where(ends, part, 1.0))


def _pressure(sides: tuple[_Sides, _Sides], wet: Mask, flow: Floats) -> Floats:
    """Return pressure times step over size, which takes the flow out of each cell back.

    Equation: sum of area (p - p') / way = -flow, p' of the neighbour, zero at the surface.
    """
    index = np.cumsum(wet).reshape(wet.shape) - 1
    diagonal, rows, columns, values = np.zeros(wet.shape), [], [], []
    for side in sides:
        share = side.area / side.way
        diagonal[side.low] += np.where(side.both | side.out, share, 0.0)
        diagonal[side.high] += np.where(side.both | side.back, share, 0.0)
        before, behind = index[side.low][side.both], index[side.high][side.both]
        rows += [before, behind]
        columns += [behind, before]
        values += [-side.area[side.both]] * 2
    alone = diagonal < 1e-12
    count = int(wet.sum())
    rows.append(np.arange(count))
    columns.append(np.arange(count))
    values.append(np.where(alone, 1.0, diagonal)[wet])
    places = (np.concatenate(rows), np.concatenate(columns))
    matrix = csr_matrix((np.concatenate(values), places), shape=(count, count)).tocsc()
    solver = splu(
        matrix,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    found = np.zeros(wet.shape)
    found[wet] = solver.solve(np.where(alone, 0.0, -flow)[wet])
    return found


def _pushed(field: Floats, p: Floats, side: _Sides, axis: int) -> tuple[Floats, Mask]:
    """Return velocities after the pressure, and where they are those of water."""
    ahead = np.where(side.out, -p[side.low] / side.way, p[side.high] - p[side.low])
    ahead = np.where(side.back, p[side.high] / side.way, ahead)
    inner = (slice(1, -1), slice(None)) if axis == 0 else (slice(None), slice(1, -1))
    after, known = field.copy(), np.zeros(field.shape, dtype=bool)
    after[inner] -= ahead
    known[inner] = (side.both | side.out | side.back) & (side.area > 0.0)
    return after, known


def _outside(slope: float | None, places: Floats) -> Floats:
    """Return places with those in the body at its face, and none beyond axis or wall."""
    found = np.stack((np.minimum(np.abs(places[:, 0]), WIDE - 1e-9), places[:, 1]), -1)
    r, z = found.T
    depth = -np.asarray(_distance(slope, r, z))
    small = 1e-4
    ahead = [
        _distance(slope, r + small * a, z + small * (1.0 - a))
        - _distance(slope, r - small * a, z - small * (1.0 - a))
        for a in (1.0, 0.0)
    ]
    way = 1.01 * np.maximum(depth, 0.0) / (2.0 * small)
    return found + way[:, None] * np.stack(ahead, -1)


def enter(slope: float | None, cells: int, *, deepest: float) -> tuple[Floats, Floats]:
    """Let water rise at a body at rest, at speed one; return the course of the impulse.

    Ideal flow without weight: particles carry the velocity, a grid takes its divergence (FLIP,
    Zhu and Bridson 2005). The water touches the lowest point of the body at first.

    Args:
        slope: of a cone at the end of a cylinder, 0 for a flat one; None for a sphere.
        cells: in the radius of the body.
        deepest: way into the water [radii].

    Returns:
        Depth [radii] and impulse [rho R^3 V], shape (steps,) each.
    """
    grid = _grid(slope, cells)
    places, new_row = grid.lattice(round(DEEP * cells)), grid.lattice(1)
    velocity, upward = np.tile([0.0, 1.0], (len(places), 1)), np.array([0.0, 1.0])
    depth, impulse, rise, rows = 0.0, 0.0, 0.0, []
    top = grid.low + (grid.inside.shape[1] - 1) * grid.size
    while depth < deepest:
        fastest = float(np.quantile(np.hypot(*velocity.T), 0.9995))
        step = COURANT * grid.size / max(1.0, fastest)
        before = grid.fields(places, velocity)
        # the distance of the cells' middles from the water, below zero in it [cells]
        far = 3.0 * grid.size
        near, _ = cKDTree(places).query(grid.places.reshape(-1, 2), distance_upper_bound=far)
        found = np.minimum(near, far).reshape(grid.inside.shape) / grid.size - 0.5
        # the face of the body is no surface of the water
        beside = (grid.inside < BESIDE * grid.size) & (found < 0.8)
        *after, pushed = grid.projected(np.where(beside, np.minimum(found, -0.3), found), *before)
        fields = (after[0], after[1])
        impulse, depth, rise = impulse + pushed, depth + step, rise + step
        rows.append((depth, impulse))
        new = grid.sampled(fields, places)
        kept = velocity + new - grid.sampled(before, places)
        velocity = LIVELY * kept + (1.0 - LIVELY) * new
        places = _outside(slope, places + step * grid.sampled(fields, places + 0.5 * step * new))
        if rise > grid.size:
            rise -= grid.size
            places = np.concatenate((places, new_row))
            velocity = np.concatenate((velocity, np.tile(upward, (len(new_row), 1))))
        stays = places[:, 1] < top
        places, velocity = places[stays], velocity[stays]
    depths, impulses = np.array(rows).T
    return depths, impulses
