"""Hydrostatics of many poses at once for batch dynamics, on any array library and device.

Tables are shared by hulls of equal shape, and what was cut for them is kept between runs.
"""

from __future__ import annotations

import hashlib
import weakref
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
from array_api_compat import array_namespace

from seals.errors import RobotError
from seals.hydrostatics.compound import HullCompound
from seals.hydrostatics.octahedron import Cuttable, OctahedralTable
from seals.hydrostatics.placed import HullPlaced
from seals.hydrostatics.wetted import EMPTY_SHARE, Column, Hull, Sums

RECENT = 4
"""Tables kept though no hull uses them: building one takes seconds, and it holds up to 70 MB."""

TABLES = "_hull_tables"
"""Attribute in which a hull keeps its own tables; no part of its shape."""

_SHARED: weakref.WeakValueDictionary[tuple[str, int, int], OctahedralTable]
_SHARED = weakref.WeakValueDictionary()
_RECENT: deque[OctahedralTable] = deque(maxlen=RECENT)


def _shared_table(hull: Cuttable, *, cells: int, depths: int) -> OctahedralTable:
    """Return the table of a hull, built only if no hull of the same numbers has one.

    Args:
        hull: what to tabulate.
        cells: cells along an octahedron edge.
        depths: depth cells.
    """
    try:
        shape = shape_digest(hull)
    except TypeError:
        return OctahedralTable(hull, cells=cells, depths=depths)
    key = (shape, cells, depths)
    table = _SHARED.get(key)
    if table is None:
        table = _SHARED[key] = OctahedralTable(hull, cells=cells, depths=depths, shape=shape)
    if table in _RECENT:
        _RECENT.remove(table)
    _RECENT.append(table)
    return table


def shape_digest(hull: object) -> str:
    """Return a digest of all numbers of a hull, equal for equal shapes.

    Raises:
        TypeError: the hull holds something that is neither number, text, array nor a nest of
            these, such as a function; then nobody can say whether another one is its equal.

    Example:
        >>> from seals.hydrostatics import HullSphere
        >>> one, same, other = (HullSphere(radius=r) for r in (0.1, 0.1, 0.2))
        >>> shape_digest(one) == shape_digest(same), shape_digest(one) == shape_digest(other)
        (True, False)
    """
    digest = hashlib.sha256()
    _add(digest, hull)
    return digest.hexdigest()


def _add(digest: Any, value: object) -> None:
    """Add a value with its type to a digest, so that different values never collide."""
    digest.update(f"{type(value).__module__}.{type(value).__qualname__};".encode())
    if value is None or isinstance(value, bool | int | float | str | np.generic):
        digest.update(f"{value!r};".encode())
    elif isinstance(value, np.ndarray) and value.dtype != object:
        digest.update(f"{value.dtype.str}{value.shape};".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, tuple | list):
        digest.update(f"{len(value)};".encode())
        for part in value:
            _add(digest, part)
    elif isinstance(value, Mapping):
        _add(digest, sorted(value.items()))
    elif (
        type(value).__module__ != "builtins" and hasattr(value, "__dict__") and not callable(value)
    ):
        _add(digest, {name: x for name, x in vars(value).items() if name != TABLES})
    else:
        raise TypeError(f"a {type(value).__name__} has no digest")


Law = Callable[[Any, Column, Column, Column, Column], Sums]
RESOLUTION = ((150, 40, 32), (800, 32, 24), (3000, 24, 24))
"""Faces or samples up to which a table has so many cells and depths: coarse meshes have sharp edges
and are cheap to cut, fine ones are smooth. Chosen so that a build takes about one second."""
COARSEST = (16, 20)


class HullTable:
    """Wetted volume, centroid and waterplane of a hull for a batch of poses.

    Sphere, box, cylinder and capsule are evaluated by their closed forms (no table could be as
    accurate), a compound as the sum of its parts, meshes and samples from a table over normal and
    depth. In each case the waterplane area is the derivative of the volume by the level.

    Attributes:
        law: the hull's sums by array namespace, normal and level, see `HullPlaced.sums`.
        hull: what the table is of.
        volume: of the whole hull [m^3].

    Limitations: across depth and normal a mesh's table is within 0.1 % of the whole volume; the
        area of a mesh with flat faces, held within a degree of parallel to the surface, is smeared.

    Example:
        >>> import numpy as np
        >>> from seals.hydrostatics import HullBox
        >>> table = HullTable.build(HullBox(size=(0.4, 0.2, 0.1)))
        >>> volume, _, area, _ = table.lookup(np.array([[0.0, 0.0, 1.0]]), np.array([[0.0]]))
        >>> round(volume.item(), 9), round(area.item(), 9)
        (0.004, 0.08)
    """

    def __init__(self, law: Law, hull: Hull) -> None:
        self.law, self.hull = law, hull
        self.volume = hull.volume

    @classmethod
    def build(cls, hull: Hull, *, cells: int | None = None, depths: int | None = None) -> HullTable:
        """Return the table of a hull, from the cache where one of equal shape exists.

        Args:
            hull: what to prepare.
            cells: cells along an octahedron edge, for meshes and samples; None chooses.
            depths: depth cells, likewise.

        Raises:
            RobotError: the hull has neither a closed form nor a way to be cut in bulk.
        """
        cache: dict[tuple[int | None, int | None], HullTable] = hull.__dict__.setdefault(TABLES, {})
        if (cells, depths) not in cache:
            cache[cells, depths] = cls(_law_of(hull, cells, depths), hull)
        return cache[cells, depths]

    def lookup(self, up: Any, level: Any) -> tuple[Any, Any, Any, Any]:
        """Return wetted volume, centroid, waterplane area and waterplane centroid.

        Args:
            up: unit normals of the surface, link axes, shape (N, 3).
            level: heights of the surface above the link origin along the normals [m], shape (N, 1).

        Returns:
            volume [m^3] (N, 1), centroid [m] (N, 3), area [m^2] (N, 1), area centroid [m] (N, 3).
        """
        xp = array_namespace(up, level)
        kind = up.dtype
        if kind != xp.float64:
            # differences of nearly equal volumes need double precision inside
            up, level = xp.astype(up, xp.float64), xp.astype(level, xp.float64)
        sums = self.law(xp, up[:, 0], up[:, 1], up[:, 2], level[:, 0])
        found = centred(xp, sums, self.volume)
        if kind == xp.float64:
            return found
        return cast(tuple[Any, Any, Any, Any], tuple(xp.astype(array, kind) for array in found))


def centred(xp: Any, sums: Sums, whole: Any) -> tuple[Any, Any, Any, Any]:
    """Return volume, centroid, area and its centroid from sums; nothing of what is hardly wet.

    Args:
        xp: array namespace.
        sums: columns, shape (N,).
        whole: volume of the whole hulls [m^3], a number or (N,).
    """
    volume, mx, my, mz, area, ax, ay, az = sums
    least, little = EMPTY_SHARE * whole, EMPTY_SHARE * whole ** (2.0 / 3.0)
    wet = xp.astype(volume > least, volume.dtype)
    # nothing is divided by nothing: dry rows have share zero
    share = wet / xp.maximum(volume, 0.0 * volume + least)
    flat = wet * xp.astype(area > little, volume.dtype)
    part = flat / xp.maximum(area, 0.0 * volume + little)
    volume, area = volume * wet, area * flat
    return (
        volume[:, None],
        xp.stack((mx * share, my * share, mz * share)).T,
        area[:, None],
        xp.stack((ax * part, ay * part, az * part)).T,
    )


def _law_of(hull: Hull, cells: int | None = None, depths: int | None = None) -> Law:
    """Return the batched hydrostatics of a hull: exact in closed form, else by a table."""
    if isinstance(hull, HullPlaced):
        return hull.sums
    if isinstance(hull, HullCompound):
        return _compound_law(hull, [_law_of(part, cells, depths) for part in hull.parts])
    if not (hasattr(hull, "cut") and hasattr(hull, "extents")):
        raise RobotError(
            f"{type(hull).__name__} has no batched form.\n"
            "Implement cut(ups, levels) and extents(ups), as in HullMesh."
        )
    body = cast(Cuttable, hull)
    fits = [(c, d) for most, c, d in RESOLUTION if body.grain <= most] or [COARSEST]
    own = body.resolution or fits[0]
    return _shared_table(body, cells=cells or own[0], depths=depths or own[1]).sums


def _compound_law(hull: HullCompound, laws: list[Law]) -> Law:
    """Return the sum of the parts' laws, scaled and shifted as the compound states."""
    lx, ly, lz = hull.lift.tolist()
    sx, sy, sz = (hull.lift + hull.shift).tolist()
    k = hull.scale

    def law(xp: Any, ux: Column, uy: Column, uz: Column, level: Column) -> Sums:
        # `HullCompound.wetted` over a batch
        below = level - (ux * lx + uy * ly + uz * lz)
        parts = [part(xp, ux, uy, uz, below) for part in laws]
        v, mx, my, mz, a, ax, ay, az = (sum(c[1:], c[0]) * k for c in zip(*parts, strict=True))
        return Sums(
            v, mx + v * sx, my + v * sy, mz + v * sz, a, ax + a * lx, ay + a * ly, az + a * lz
        )

    return law
