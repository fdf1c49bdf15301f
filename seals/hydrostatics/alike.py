"""Hydrostatics of many hulls at once: the parts of one form are evaluated together."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np

from seals.arrays import Array, as_like, index_on, namespace
from seals.hydrostatics.compound import HullCompound
from seals.hydrostatics.placed import HullPlaced
from seals.hydrostatics.wetted import Hull

NUMBERS = (float, tuple)
"""Attributes of a primitive that its closed form may read."""


class HullsAlike:
    """Sums over the wetted parts of several hulls made of closed forms.

    Equation:
        s_l = k_l sum_{p of l} s_p, moments shifted as `HullCompound` states; s_p of all parts of
        one form by one evaluation, whose sizes and places are columns (P, 1) instead of numbers.

    Args:
        hulls: primitives, and compounds of primitives that stay in place; see `fits`.
    """

    def __init__(self, hulls: Sequence[Hull]) -> None:
        parts = [(row, part) for row, hull in enumerate(hulls) for part in _parts(hull)]
        self._forms: list[tuple[Any, Any]] = []
        links: list[int] = []
        for form in dict.fromkeys(type(part) for _, part in parts):
            own = [(row, part) for row, part in parts if type(part) is form]
            rows = [row for row, _ in own]
            self._forms.append((np.array(rows), [part for _, part in own]))
            links += rows
        # row of a hull: k_l at the columns of its parts, zero elsewhere
        self._gather = 1.0 * (np.arange(len(hulls))[:, None] == np.array(links))
        self._shift = np.zeros((3, len(hulls)))
        for row, hull in enumerate(hulls):
            if isinstance(hull, HullCompound):
                self._gather[row] *= hull.scale
                self._shift[:, row] = hull.shift
        self._kept: dict[Any, tuple[Array, Array | None, list[HullPlaced]]] = {}

    @staticmethod
    def fits(hull: Hull) -> bool:
        """Return whether a hull is made of closed forms, none of them moved."""
        if isinstance(hull, HullCompound) and hull.lift.any():
            return False
        return all(isinstance(part, HullPlaced) for part in _parts(hull))

    def sums(self, up: Array, level: Array) -> Array:
        """Return volume, its moments, area and its moments, shape (8, L, B).

        Args:
            up: unit normals of the surface, link axes, shape (L, B, 3).
            level: heights above the link origins along the normals [m], shape (L, B).
        """
        xp, found = namespace(level), []
        key = level.dtype, level.device
        if key not in self._kept:
            moved = as_like(self._shift[:, :, None], level) if self._shift.any() else None
            hulls = [_stacked(parts, level) for _, parts in self._forms]
            self._kept[key] = as_like(self._gather, level), moved, hulls
        gather, shift, forms = self._kept[key]
        for (rows, _), hull in zip(self._forms, forms, strict=True):
            places = index_on(rows, level)
            own, height = xp.take(up, places, axis=0), xp.take(level, places, axis=0)
            sums = hull.sums(xp, own[:, :, 0], own[:, :, 1], own[:, :, 2], height)
            found.append(xp.stack(sums))
        total = xp.matmul(gather, xp.concat(found, axis=1))
        if shift is None:
            return total
        # sum v (x + shift) = sum v x + V shift; the waterplane stays where it is
        moved = total[1:4] + shift * total[:1]
        return xp.concat((total[:1], moved, total[4:]), axis=0)


def _parts(hull: Hull) -> tuple[Hull, ...]:
    return hull.parts if isinstance(hull, HullCompound) else (hull,)


def _stacked(hulls: Sequence[HullPlaced], like: Array) -> HullPlaced:
    """Return primitives of one form as one whose sizes and places are columns, shape (P, 1)."""
    many = copy.copy(hulls[0])
    for name, value in vars(hulls[0]).items():
        # names with an underscore hold what follows from these, and no form reads it
        if isinstance(value, NUMBERS) and not name.startswith("_"):
            vars(many)[name] = _columns([vars(hull)[name] for hull in hulls], like)
    return many


def _columns(values: Sequence[Any], like: Array) -> Any:
    """Return numbers as one column, nested tuples entry by entry."""
    if isinstance(values[0], tuple):
        return tuple(_columns(entries, like) for entries in zip(*values, strict=True))
    return as_like(np.array(values, dtype=float)[:, None], like)
