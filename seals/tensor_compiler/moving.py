"""Operations on grids that rearrange entries: views, slices, concatenation.

Every function takes the columns, the node and what the operation is given, tensors as grids; it
gives back None for what it does not know how to do entry by entry.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from seals.tensor_compiler.columns import (
    Grid,
    along,
    blocks,
    filled_with,
    is_node,
    reshaped,
    splits,
)

if TYPE_CHECKING:
    from torch.fx import Node

    from seals.tensor_compiler.columns import Columns


def view(c: Columns, node: Node, x: Grid, shape: Any) -> Grid | None:
    """Return the entries in another shape."""
    return reshaped(x, tuple(node.meta["val"].shape), c.batch)


def permute(c: Columns, node: Node, x: Grid, dims: Any) -> Grid:
    """Return a tensor with its indices permuted."""
    order = [d % x.entries.ndim for d in dims]
    axis = None if x.axis is None else order.index(x.axis)
    return x._replace(entries=x.entries.transpose(order), axis=axis)


def unsqueeze(c: Columns, node: Node, x: Grid, dim: int) -> Grid:
    """Insert an index of size one."""
    at = dim % (x.entries.ndim + 1)
    axis = x.axis if x.axis is None or x.axis < at else x.axis + 1
    return x._replace(entries=np.expand_dims(x.entries, at), axis=axis)


def squeeze(c: Columns, node: Node, x: Grid, dim: Any) -> Grid:
    """Remove indices of size one."""
    if not x.entries.ndim:
        return x
    dims = {d % x.entries.ndim for d in ([dim] if isinstance(dim, int) else dim)}
    gone = tuple(d for d in dims if x.entries.shape[d] == 1 and d != x.axis)
    axis = x.axis if x.axis is None else x.axis - sum(d < x.axis for d in gone)
    return x._replace(entries=np.squeeze(x.entries, gone), axis=axis)


def select(c: Columns, node: Node, x: Grid, dim: int, index: int) -> Grid | None:
    """Select one position of an index."""
    at = dim % x.entries.ndim
    if at == x.axis:
        return None
    picked = x.entries[_at(at, slice(index, index + 1 or None))]
    axis = x.axis if x.axis is None or x.axis < at else x.axis - 1
    return x._replace(entries=picked.squeeze(at), axis=axis)


def _at(dim: int, places: slice) -> tuple[Any, ...]:
    """Index of some positions along one dimension, all positions of those before."""
    return (*([slice(None)] * dim), places)


def cut(c: Columns, node: Node, x: Grid, *where: Any) -> Grid | None:
    """Slice an index; along the batch, in whole blocks."""
    usual: list[Any] = [0, None, None, 1]
    dim, start, end, step = [*where, *usual[len(where) :]]
    at = dim % x.entries.ndim
    unit = c.batch if at == x.axis else 1
    low, high, _ = slice(start, end).indices(x.entries.shape[at] * unit)
    if (unit > 1 and step != 1) or low % unit or high % unit:
        return None
    places = slice(low // unit, high // unit, step)
    return x._replace(entries=x.entries[_at(at, places)])


def expand(c: Columns, node: Node, x: Grid, size: Any, **more: Any) -> Grid | None:
    """Broadcast along an index."""
    shape = tuple(node.meta["val"].shape)
    more_places = len(shape) - x.entries.ndim
    axis = along(shape, c.batch) if x.axis is None else x.axis + more_places
    form = blocks(shape, axis, c.batch)
    if not splits(form):
        return None
    return x._replace(entries=np.broadcast_to(x.entries, form), axis=axis)


def cat(c: Columns, node: Node, parts: Any, dim: int = 0) -> Grid | None:
    """Concatenate tensors."""
    # the empty tensor of one index has no part in it, whatever the others look like
    kinds = {x.kind for x in parts}
    parts = [x for x in parts if x.entries.shape != (0,)]
    if len(kinds) != 1 or len({x.axis for x in parts}) != 1:
        return None
    at = dim % parts[0].entries.ndim
    entries = np.concatenate([x.entries for x in parts], axis=at)
    return parts[0]._replace(entries=entries) if splits(entries.shape) else None


def stack(c: Columns, node: Node, parts: Any, dim: int = 0) -> Grid | None:
    """Stack tensors along a new index."""
    at = dim % (parts[0].entries.ndim + 1)
    return cat(c, node, [unsqueeze(c, node, x, at) for x in parts], at)


def unbind(c: Columns, node: Node, x: Grid, dim: int = 0) -> list[Grid | None] | None:
    """Split a tensor along an index."""
    at = dim % x.entries.ndim
    if at == x.axis:
        return None
    return [select(c, node, x, at, k) for k in range(x.entries.shape[at])]


def filled(c: Columns, node: Node, *args: Any, **more: Any) -> Grid | None:
    """Return a constant tensor; zeros or ones according to the operation's name."""
    import torch

    value, name = node.meta["val"], str(node.target)
    number = 0 if "zeros" in name else 1 if "ones" in name else args[-1]
    shape = tuple(value.shape)
    axis = along(shape, c.batch)
    form = blocks(shape, axis, c.batch)
    if is_node(number) or not splits(form):
        return None
    entry = torch.tensor(number, dtype=value.dtype).item()
    return Grid(filled_with(form, lambda _: entry), axis, value.dtype)


def diagonal(c: Columns, node: Node, x: Grid, *how: Any) -> Grid | None:
    """Return the diagonal of a matrix that is equal in the whole batch."""
    return None if x.axis is not None else x._replace(entries=np.diagonal(x.entries, *how))


def with_diagonal(c: Columns, node: Node, x: Grid, part: Grid, *how: Any) -> Grid | None:
    """Return such a matrix with another diagonal."""
    if x.axis is not None or x.entries.ndim != 2 or how not in {(), (0,), (0, 0, 1)}:
        return None
    entries = x.entries.copy()
    np.fill_diagonal(entries, part.entries)
    return x._replace(entries=entries)
