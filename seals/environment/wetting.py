"""Submerged part of each hull, exactly or from tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from seals.arrays import Array, Floats, as_like, deciding, doubt, fixed, namespace
from seals.hydrostatics import Hull, HullTable
from seals.hydrostatics.alike import HullsAlike
from seals.hydrostatics.table import centred
from seals.hydrostatics.wetted import Sums

DEEP = 1e6
"""Depth at which every hull is under water [m]."""
POINT_RADIUS = 0.01
"""Radius of the sphere that stands for a link without a hull [m]."""


class Wet(NamedTuple):
    """Submerged part of the hulls, link axes about the link origin, shape (N, k).

    Args:
        volume: [m^3], (N, 1).
        centre: centroid of the submerged volume [m], (N, 3).
        area: waterplane area [m^2], (N, 1); None when no hull is cut by the surface.
        area_centre: centroid of the waterplane [m], (N, 3); None likewise.
    """

    volume: Array
    centre: Array
    area: Array | None
    area_centre: Array | None


class Wetting(Protocol):
    """Interface to compute the submerged part of every hull."""

    def wet(self, normal: Array, level: Array) -> Wet:
        """Return the submerged part, where normal . x <= level.

        Args:
            normal: in link axes [1], shape (N, 3).
            level: [m], shape (N, 1).
        """


class WettingExact:
    """Exact clipping of hulls, for the links of one scene.

    Args:
        hulls: one hull per link.

    Attributes:
        longest: reach of the longest hull from its link's origin [m].
    """

    def __init__(self, hulls: Sequence[Hull]) -> None:
        self.hulls = tuple(hulls)
        self._reach = np.array([[h.reach] for h in hulls])
        self.longest = float(self._reach.max())
        self._volume = np.array([[h.volume] for h in hulls])
        self._centre = np.array([h.centroid for h in hulls])
        self._submerged = Wet(self._volume, self._centre, None, None)
        self._dry = Wet(self._volume * 0.0, self._centre * 0.0, None, None)

    def whole(self, *, under: bool) -> Wet:
        """Return the submerged parts of hulls that are all under water, or all above it."""
        return self._submerged if under else self._dry

    def wet(self, normal: Array, level: Array) -> Wet:
        """Return the submerged part of every hull; dry and fully submerged ones are not clipped."""
        levels = level.ravel().tolist()
        if max(levels) <= -self.longest:
            return self._dry
        if min(levels) >= self.longest:
            return self._submerged
        under = level >= self._reach
        if under.all():
            return self._submerged
        cut = (level > -self._reach) & ~under
        if not cut.any():
            if not under.any():
                return self._dry
            return Wet(self._volume * under, self._centre * under, None, None)
        volume, centre = self._volume * under, self._centre * under
        area, area_centre = np.zeros_like(volume), np.zeros_like(centre)
        for k in np.flatnonzero(cut[:, 0]):
            part = self.hulls[k].wetted(normal[k], float(level[k, 0]))
            volume[k, 0], centre[k], area[k, 0], area_centre[k] = part
        return Wet(volume, centre, area, area_centre)


class WettingWhole:
    """Hulls that are under water or above it as a whole, on any array library, for one robot.

    Args:
        hulls: one hull per link.
    """

    def __init__(self, hulls: Sequence[Hull]) -> None:
        # as `WettingTable` has them
        self._tables = [HullTable.build(hull) for hull in hulls]
        self._reach = np.array([[float(hull.reach)] for hull in hulls])

    def wet(self, normal: Array, level: Array) -> Wet:
        """Return the submerged part of every hull: all of it, or nothing.

        A hull near the surface is a `seals.arrays.doubt`.
        """
        xp = namespace(level)
        whole = [deep(table, np.float64) for table in self._tables]
        reach = fixed(self._reach, level)
        under = xp.astype(level >= reach, level.dtype)
        doubt(xp.any(xp.abs(level) < reach))
        volume, centre = (
            fixed(np.concatenate([np.reshape(x, (1, -1)) for x in column]), level) * under
            for column in zip(*whole, strict=True)
        )
        return Wet(volume, centre, None, None)


class WettingTable:
    """Interpolated hulls for batches, rows ordered link by link.

    Args:
        tables: one table per link.
        reach: largest distance of each hull's points from its link's origin [m]; on NumPy, what
            lies deeper or higher costs no lookup.
    """

    def __init__(self, tables: Sequence[HullTable], *, reach: Sequence[float] = ()) -> None:
        self.tables = tuple(tables)
        self.reach = tuple(reach) or (math.inf,) * len(self.tables)
        self._whole: list[tuple[Floats, Floats]] = []
        hulls = [table.hull for table in self.tables]
        alike = all(map(HullsAlike.fits, hulls)) and len(hulls) > 1
        self._alike = HullsAlike(hulls) if alike else None
        self._volumes = np.array([[hull.volume] for hull in hulls])

    def wet(self, normal: Array, level: Array) -> Wet:
        """Return the submerged part of every hull; rows are links x batch."""
        batch = level.shape[0] // len(self.tables)
        cuts = [slice(k * batch, (k + 1) * batch) for k in range(len(self.tables))]
        if type(level) is np.ndarray:
            return self._where_cut(normal, level, cuts)
        # a compiler takes numbers of single hulls into its programs, and joins their laws itself
        if self._alike is not None and deciding():
            return self._together(self._alike, normal, level)
        parts = [t.lookup(normal[c], level[c]) for t, c in zip(self.tables, cuts, strict=True)]
        xp = namespace(level)
        return Wet(*(xp.concat(list(column), axis=0) for column in zip(*parts, strict=True)))

    def _together(self, alike: HullsAlike, normal: Array, level: Array) -> Wet:
        """Evaluate the hulls form by form, in double precision, see `HullTable.lookup`."""
        xp, kind, count = namespace(level), level.dtype, len(self.tables)
        up = xp.reshape(xp.astype(normal, xp.float64), (count, -1, 3))
        height = xp.reshape(xp.astype(level, xp.float64), (count, -1))
        sums = xp.reshape(alike.sums(up, height), (8, -1))
        whole = xp.broadcast_to(fixed(self._volumes, height), height.shape)
        found = centred(xp, Sums(*(sums[k] for k in range(8))), xp.reshape(whole, (-1,)))
        return Wet(*(xp.astype(column, kind) for column in found))

    def _where_cut(self, normal: Floats, level: Floats, cuts: Sequence[slice]) -> Wet:
        """Look up only hulls that the surface may cut; the others are wet or dry as a whole."""
        volume, centre, area, middle = (
            np.zeros((len(level), k), level.dtype) for k in (1, 3, 1, 3)
        )
        if not self._whole:
            self._whole = [deep(table, level.dtype) for table in self.tables]
        cut_at_all = False
        for k, cut in enumerate(cuts):
            heights, reach = level[cut, 0], self.reach[k]
            (near,) = (np.abs(heights) < reach).nonzero()
            if len(near) < len(heights):
                under = heights >= reach
                volume[cut][under], centre[cut][under] = self._whole[k]
            if len(near):
                cut_at_all = True
                parts = self.tables[k].lookup(normal[cut][near], level[cut][near])
                for column, part in zip((volume, centre, area, middle), parts, strict=True):
                    column[cut][near] = part
        return Wet(volume, centre, area, middle) if cut_at_all else Wet(volume, centre, None, None)


def deep(table: HullTable, kind: Any) -> tuple[Floats, Floats]:
    """Return volume and centroid that a table gives far under water, shapes (1, 1) and (1, 3)."""
    up = np.array([[0.0, 0.0, 1.0]], dtype=kind)
    volume, centre, *_ = table.lookup(up, np.full((1, 1), DEEP, dtype=kind))
    return volume, centre


class WettingNone:
    """Wetting without water."""

    def wet(self, normal: Array, level: Array) -> Wet:
        """Return an empty submerged part."""
        return Wet(as_like(np.zeros((1, 1)), level), as_like(np.zeros((1, 3)), level), None, None)
