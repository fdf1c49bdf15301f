"""Interpolation table of wetted volume and moments over surface normal and depth."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import math
from importlib.resources import files
from typing import Any, Protocol

import numpy as np

from seals.caches import cache_folder, keep, kept
from seals.hydrostatics.wetted import Column, Sums, Vector

INSET = 1e-7
"""Share of the depth range by which the end nodes lie inside, to read the area of flat ends."""
BEND = 1.37
"""Half the arc [rad] whose sine spaces the depth nodes: 1/5 as far apart at the ends as in the
middle, because bodies with flat faces change fastest near their lowest and highest points."""
LEAST_SPREAD = 1e-6
"""Least ratio of the squared spreads of a flat body, against a singular stretch."""
CHUNK = 100_000
"""Faces times levels cut at once, to bound memory."""


class Cuttable(Protocol):
    """Interface of hulls without a closed form, cut at many normals and levels at once."""

    volume: float
    centroid: Vector

    @property
    def resolution(self) -> tuple[int, int] | None:
        """Cells along an octahedron edge and depths of its table; None lets its grain choose."""

    @property
    def grain(self) -> int:
        """Cost of one cut: number of faces or samples."""

    def spread(self) -> Vector:
        """Return the second moments of the volume about its centroid, per volume [m^2], (3, 3)."""

    def extents(self, ups: Vector) -> tuple[Vector, Vector]:
        """Return lowest and highest level of the hull along each normal [m], shape (N,) each."""

    def cut(self, ups: Vector, levels: Vector) -> Vector:
        """Return volume, moments, area and area moments, shape (normals, levels, 8)."""


class OctahedralTable:
    """Volume and first moments over surface normal and depth.

    Equation: the body is first stretched to equal spread along its principal axes (a plane stays a
        plane, shares of volume stay what they are). Normals then lie on an octahedron, each face a
        triangle of nodes, with linear weights between three of them; depth runs from 0 to 1 between
        the lowest and the highest point along the normal, in cubic Hermite pieces whose slopes are
        the waterplane area and its moments. The area returned is the derivative of the volume
        returned, exactly.

    Args:
        hull: what to tabulate.
        cells: cells along an octahedron edge.
        depths: depth cells.
        shape: digest of all numbers of the hull, by which its cuts are found again in the cache
            ``tables``; None keeps them nowhere.
    """

    def __init__(
        self, hull: Cuttable, *, cells: int, depths: int, shape: str | None = None
    ) -> None:
        self.cells, self.depths = cells, depths
        sizes, axes = np.linalg.eigh(hull.spread())
        stretch = axes * np.sqrt(np.maximum(sizes, sizes.max() * LEAST_SPREAD))
        self._stretch, self._centre = stretch.T.tolist(), hull.centroid.tolist()
        ups = _octant_nodes(cells) @ np.linalg.inv(stretch)
        ups /= np.sqrt((ups * ups).sum(axis=1))[:, None]
        cuts = _cuts_of(hull, ups, depths, shape)
        low, high = cuts[: 2 * len(ups)].reshape(2, -1)
        # upper octants and lower ones, written in place: a fine table is 70 MB
        table = np.empty((2, len(ups), depths + 1, 8))
        nodes, turned = table
        nodes[:] = cuts[2 * len(ups) :].reshape(nodes.shape)
        stride = BEND / (np.sin(BEND) * depths) * np.cos(np.linspace(-BEND, BEND, depths + 1))
        nodes[..., 4:] *= ((high - low)[:, None] * stride)[..., None]
        whole = np.array((1.0, *hull.centroid)) * hull.volume
        nodes[:, 0, :4], nodes[:, -1, :4] = 0.0, whole
        # a surface seen from below: what was wet is dry
        quarter = len(ups) // 4
        for k in range(4):
            here, there = (slice(j * quarter, (j + 1) * quarter) for j in (k, 3 - k))
            turned[there] = nodes[here, ::-1]
        np.subtract(whole, turned[..., :4], out=turned[..., :4])
        self._rows: Vector = table.reshape(-1, 8)
        bounds = np.stack((low, high), axis=-1) - (ups @ hull.centroid)[:, None]
        bounds /= np.sqrt(((ups @ stretch) ** 2).sum(axis=1))[:, None]
        self._bounds: Vector = np.concatenate((bounds, _opposite(-bounds[:, ::-1])))
        self._copies: dict[str, tuple[Any, Any]] = {}

    def tables(self, xp: Any, like: Column) -> tuple[Any, Any]:
        """Return rows and bounds in the caller's array library and on its device."""
        device = getattr(like, "device", None)
        key = f"{xp.__name__} {device}"
        if key not in self._copies:
            # what follows a law once keeps tables as they are, in place of each of their numbers
            whole = hasattr(xp, "table")
            rows, low, high = (
                xp.table(array) if whole else xp.asarray(array, dtype=xp.float64, device=device)
                for array in (self._rows, self._bounds[:, 0].copy(), self._bounds[:, 1].copy())
            )
            self._copies[key] = rows, (low, high)
        return self._copies[key]

    def sums(self, xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        """Return interpolated volume, area and first moments, columns (N,)."""
        rows, bounds = self.tables(xp, level)
        (px, py, pz), stretch = self._centre, self._stretch
        # depth is measured from the centroid, about which the table was stretched
        level = level - (ux * px + uy * py + uz * pz)
        wx, wy, wz = (ux * a + uy * b + uz * c for a, b, c in stretch)
        norm = xp.sqrt(wx * wx + wy * wy + wz * wz)
        nodes, weights = self._nodes(xp, wx, wy, wz)
        low, high = (
            sum(xp.take(bound, n, axis=0) * w for n, w in zip(nodes, weights, strict=True))
            for bound in bounds
        )
        height = high - low
        share = (level / norm - low) / height
        one = 0.0 * share + 1.0
        inside = xp.astype((share > 0.0) & (share < 1.0), share.dtype)
        bend = xp.maximum(xp.minimum(2.0 * share - 1.0, one), -one) * math.sin(BEND)
        place = (xp.asin(bend) * (0.5 / BEND) + 0.5) * self.depths
        cell = xp.minimum(xp.floor(place), one * (self.depths - 1.0))
        stride = xp.sqrt(1.0 - bend * bend) * (BEND / (math.sin(BEND) * self.depths))
        k = xp.astype(cell, xp.int64)
        below = [node * (self.depths + 1) + k for node in nodes]
        row, after = (
            sum(
                xp.take(rows, n + end, axis=0) * w[:, None]
                for n, w in zip(below, weights, strict=True)
            )
            for end in (0, 1)
        )
        return _hermite(row, after, place - cell, height * norm * stride, inside)

    def _nodes(
        self, xp: Any, ux: Column, uy: Column, uz: Column
    ) -> tuple[list[Column], list[Column]]:
        """Return the three nodes around a normal, and their weights, columns (N,)."""
        m = self.cells
        x, y = xp.abs(ux), xp.abs(uy)
        scale = m / (x + y + xp.abs(uz))
        x, y = x * scale, y * scale
        most = 0.0 * x + (m - 1.0)
        i, j = xp.minimum(xp.floor(x), most), xp.minimum(xp.floor(y), most)
        fx, fy = x - i, y - j
        rest = 1.0 - fx - fy
        upper = rest < 0.0
        # nodes of one octant, row by row: row i begins at `first` and holds `last` + 1 of them;
        # nodes beyond the edge have weights of rounding size, and are those of the edge
        last = m - i
        first = i * (m + 1.0) - 0.5 * i * (i - 1.0)
        for side, octants in ((ux, 1.0), (uy, 2.0), (uz, 4.0)):
            octant = octants * (0.5 * (m + 1) * (m + 2))
            first = first + xp.astype(side < 0.0, first.dtype) * octant
        second = first + last + 1.0
        left, right = second + xp.minimum(j, last - 1.0), first + xp.minimum(j + 1.0, last)
        beyond = second + xp.minimum(j + 1.0, last - 1.0)
        corner = xp.where(upper, beyond, first + xp.minimum(j, last))
        weights = [xp.abs(rest), xp.where(upper, 1.0 - fy, fx), xp.where(upper, 1.0 - fx, fy)]
        return [xp.astype(node, xp.int64) for node in (corner, left, right)], weights


def _cuts_of(hull: Cuttable, ups: Vector, depths: int, shape: str | None) -> Vector:
    """Return the lowest levels, the highest, and the cuts between them, one after the other.

    A fine table takes seconds to cut, and the cuts depend on nothing but what names their file.
    """
    if shape is None:
        return _cut(hull, ups, depths)
    size = len(ups) * (2 + 8 * (depths + 1))
    digest = hashlib.sha256(f"{shape} {depths} {_law_digest()}".encode() + ups.tobytes())
    place = cache_folder("tables") / f"{digest.hexdigest()}.cuts"
    data = kept(place)
    if data is not None and len(data) == 8 * size:
        return np.frombuffer(data)
    found = _cut(hull, ups, depths)
    with contextlib.suppress(OSError):  # cut anew the next time
        keep(place, found.tobytes())
    return found


def _cut(hull: Cuttable, ups: Vector, depths: int) -> Vector:
    low, high = hull.extents(ups)
    bend = np.sin(np.linspace(-BEND, BEND, depths + 1)) / np.sin(BEND)
    shares = np.clip(0.5 + 0.5 * bend, INSET, 1.0 - INSET)
    levels = low[:, None] + (high - low)[:, None] * shares
    step = max(1, CHUNK // (hull.grain * (depths + 1)))
    cuts = [hull.cut(ups[k : k + step], levels[k : k + step]) for k in range(0, len(ups), step)]
    return np.concatenate([low, high, *(part.ravel() for part in cuts)])


@functools.cache
def _law_digest() -> str:
    """Digest of the laws by which hulls are cut: others cut otherwise."""
    digest = hashlib.sha256(np.__version__.encode())
    for file in sorted(files("seals.hydrostatics").iterdir(), key=lambda file: file.name):
        if file.name.endswith(".py"):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _octant_nodes(cells: int) -> Vector:
    """Return the nodes of the four upper octants.

    Args:
        cells: cells along an octahedron edge.

    Returns:
        unit normals, shape (4 (cells + 1)(cells + 2) / 2, 3): octants by the sign of x, then y; in
        each, rows of equal x from 0, y rising from 0 to the edge.
    """
    i, j = (grid.ravel() for grid in np.meshgrid(*[np.arange(cells + 1)] * 2, indexing="ij"))
    within = i + j <= cells
    x, y = i[within] / cells, j[within] / cells
    points = np.stack((x, y, np.maximum(1.0 - x - y, 0.0)), axis=-1)
    points /= np.sqrt((points * points).sum(axis=1))[:, None]
    signs = ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, 1))
    return np.concatenate([points * np.array(sign, dtype=np.float64) for sign in signs])


def _opposite(nodes: Vector) -> Vector:
    """Return nodes of the four upper octants in the order of the octants opposite to them."""
    return np.concatenate(np.split(nodes, 4)[::-1])


def _hermite(row: Column, after: Column, f: Column, step: Column, inside: Column) -> Sums:
    """Interpolate between two depths; ``step`` [m] is the cell's height there."""
    g = 1.0 - f
    fg = f * g
    # cubic Hermite: f^2 (3 - 2 f) of the rise, f (1 - f)^2 and -f^2 (1 - f) of the slopes
    rising, left, right = f * f * (1.0 + 2.0 * g), fg * g, fg * f
    rate = inside / step
    steep, first, last = 6.0 * fg * rate, g * (g - 2.0 * f) * rate, f * (f - 2.0 * g) * rate
    values, slopes = [], []
    # column by column: several times faster in NumPy than (N, 4) times (N, 1)
    for i in range(4):
        v0, s0, s1 = row[:, i], row[:, i + 4], after[:, i + 4]
        rise = after[:, i] - v0
        values.append(v0 + rising * rise + left * s0 - right * s1)
        slopes.append(steep * rise + first * s0 + last * s1)
    return Sums(*values, *slopes)
