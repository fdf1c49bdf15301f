"""Reductions and matrix products on grids of tensor entries."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.tensor_compiler.grids import MOST, Grid, filled_with
from seals.tensor_compiler.moving import unsqueeze

if TYPE_CHECKING:
    from torch.fx import Node

    from seals.tensor_compiler.columns import Columns

Join = Callable[["Columns", list[Any], Any], Any]
"""Entries of one type as one entry."""


def total(c: Columns, entries: list[Any], kind: Any) -> Any:
    """Return the sum of entries."""
    return c.total(entries)


def by(name: str) -> Join:
    """Return a reduction of many entries by a binary operation."""

    def join(c: Columns, entries: list[Any], kind: Any) -> Any:
        operation = functools.partial(c.call, operator.attrgetter(name)(c.aten))
        return functools.reduce(operation, (c.column(x, kind) for x in entries))

    return join


def reduced(join: Join) -> Callable[..., Grid | None]:
    """Return a reduction along some axes other than the batch."""

    def form(c: Columns, node: Node, x: Grid, *how: Any, **more: Any) -> Grid | None:
        import torch

        dim, keep = (*how, *(None, False)[len(how) :])[:2]
        count, kind = x.entries.ndim, node.meta["val"].dtype
        # of bytes "any" is a byte
        if not count or not x.entries.size or kind == torch.uint8:
            return None
        dims = [dim] if isinstance(dim, int) else dim or range(count)
        gone = sorted({d % count for d in dims})
        if x.axis in gone:
            return None
        kept = [k for k in range(count) if k not in gone]
        table = x.entries.transpose(kept + gone)
        table = table.reshape(*table.shape[: len(kept)], -1)

        def one(index: tuple[int, ...]) -> Any:
            return join(c, [_as(c, entry, x.kind, kind) for entry in table[index]], kind)

        axis = None if x.axis is None else kept.index(x.axis)
        found = Grid(filled_with(table.shape[:-1], one), axis, kind)
        return functools.reduce(lambda y, k: unsqueeze(c, node, y, k), gone if keep else [], found)

    return form


def _as(c: Columns, entry: Any, kind: Any, wanted: Any) -> Any:
    """Convert an entry to another type."""
    if kind == wanted:
        return entry
    return c.call(c.aten._to_copy.default, c.column(entry, kind), dtype=wanted)


def matmul(c: Columns, node: Node, a: Grid, b: Grid) -> Grid | None:
    """Multiply matrices row by row of the batch, or one constant matrix with the batch."""
    kind = node.meta["val"].dtype
    flat = a.entries.ndim == 2
    axes: dict[Any, int | None] = {(0, None): 0, (None, 1): 1, (None, None): None}
    axes = axes if flat else {(0, 0): 0}
    form = (*a.entries.shape[:-1], b.entries.shape[-1])
    work = int(np.prod(form)) * a.entries.shape[-1]
    if (a.axis, b.axis) not in axes or a.kind != kind or b.kind != kind or work > MOST:
        return None

    def one(index: tuple[int, ...]) -> Any:
        place: tuple[Any, ...] = (*index[:-2], slice(None), index[-1])
        left, right = a.entries[index[:-1]], b.entries[place]
        return c.total([c.product(x, y, kind) for x, y in zip(left, right, strict=True)])

    return Grid(filled_with(form, one), axes[a.axis, b.axis], kind)
