"""Cache of look-up tables, shared by hulls of equal shape."""

from __future__ import annotations

import hashlib
import weakref
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.hydrostatics.octahedron import Cuttable, OctahedralTable

RECENT = 4
"""Tables kept though no hull uses them: building one takes seconds, and it holds up to 70 MB."""

TABLES = "_hull_tables"
"""Attribute in which a hull keeps its own tables; no part of its shape."""

_SHARED: weakref.WeakValueDictionary[tuple[str, int, int], OctahedralTable]
_SHARED = weakref.WeakValueDictionary()
_RECENT: deque[OctahedralTable] = deque(maxlen=RECENT)


def shared_table(hull: Cuttable, *, cells: int, depths: int) -> OctahedralTable:
    """Return the table of a hull, built only if no hull of the same numbers has one.

    Args:
        hull: what to tabulate.
        cells: cells along an octahedron edge.
        depths: depth cells.
    """
    try:
        key = (shape_digest(hull), cells, depths)
    except TypeError:
        return OctahedralTable(hull, cells=cells, depths=depths)
    table = _SHARED.get(key)
    if table is None:
        table = _SHARED[key] = OctahedralTable(hull, cells=cells, depths=depths)
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
