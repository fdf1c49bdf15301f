"""Scalar columns of a graph over the batch, grids of them, and their assembly to tensors."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from torch import Tensor, dtype
    from torch.fx import GraphModule, Node


MOST = 256
"""Entries of the largest grid: a larger tensor stays whole."""
LONGEST = 15
"""Entries along the longest index of a grid: a loop over a longer one, such as the strips of a hull
or the points of a face, compiles in a third of the time of its entries and runs as fast."""


class Grid(NamedTuple):
    """Entries of a tensor.

    Args:
        entries: nodes of tensors of shape (B,) or without an index, or numbers that are the same in
            the whole batch; the index along the batch counts blocks of B rows.
        axis: index that runs along the batch; None where no one does.
        kind: type of the entries.
    """

    entries: NDArray[Any]
    axis: int | None
    kind: dtype

    def shape(self, batch: int) -> tuple[int, ...]:
        """Return the shape of the tensor."""
        return tuple(n * batch if k == self.axis else n for k, n in enumerate(self.entries.shape))


def along(shape: tuple[int, ...], batch: int) -> int | None:
    """Return the axis of a shape that runs along the batch, or None.

    Example:
        >>> along((3, 128), 64), along((3, 4), 64)
        (1, None)
    """
    return next((k for k, n in enumerate(shape) if n and n % batch == 0), None)


def blocks(shape: tuple[int, ...], axis: int | None, batch: int) -> tuple[int, ...]:
    """Return the shape of the grid of a tensor."""
    return tuple(n // batch if k == axis else n for k, n in enumerate(shape))


def splits(form: tuple[int, ...]) -> bool:
    """Return whether a tensor whose grid has this shape is taken apart.

    Example:
        >>> splits((1, 6, 6)), splits((1, 48, 3)), splits((17, 17))
        (True, False, False)
    """
    return int(np.prod(form)) <= MOST and max(form, default=0) <= LONGEST


def reshaped(grid: Grid, shape: tuple[int, ...], batch: int) -> Grid | None:
    """Return the grid reshaped; None where batch rows would mix.

    Example:
        >>> import numpy as np
        >>> grid = Grid(np.arange(6.0).reshape(1, 2, 3), 0, None)
        >>> reshaped(grid, (64, 6), 64).entries.tolist()
        [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]]
        >>> reshaped(grid, (128, 3), 64) is None
        True
    """
    if grid.axis is None:
        axis = along(shape, batch)
        return None if axis is not None else Grid(grid.entries.reshape(shape), None, grid.kind)
    before = int(np.prod(grid.entries.shape[: grid.axis + 1]))
    for axis, n in enumerate(shape):
        if n and n % batch == 0 and int(np.prod(shape[:axis])) * (n // batch) == before:
            return Grid(grid.entries.reshape(blocks(shape, axis, batch)), axis, grid.kind)
    return None


def broadcast(grids: list[Grid]) -> tuple[list[NDArray[Any]], int | None] | None:
    """Broadcast grids; return their entries side by side, and the batch axis.

    None where two run along the batch by different indices.
    """
    most = max(grid.entries.ndim for grid in grids)
    axes = {g.axis + most - g.entries.ndim for g in grids if g.axis is not None}
    if len(axes) > 1:
        return None
    return list(np.broadcast_arrays(*(g.entries for g in grids))), next(iter(axes), None)


def filled_with(shape: tuple[int, ...], make: Any) -> NDArray[Any]:
    """Return an array filled by a function of the index."""
    out = np.empty(shape, dtype=object)
    for index in np.ndindex(shape):
        out[index] = make(index)
    return out


def is_node(entry: Any) -> bool:
    """Return whether an entry may vary within the batch."""
    return not isinstance(entry, bool | int | float)


SAME = frozenset({"aten.clone.default", "aten.alias.default", "aten.detach.default"})
"""Operations that give back what they were given."""
Negated = Callable[[Any], Any]
"""An entry to its negative."""


class Columns:
    """Builder of a graph of scalar columns, with known constants.

    Args:
        old: the graph that is written anew.
        batch: rows B.
    """

    def __init__(self, old: GraphModule, batch: int) -> None:
        import torch

        self.graph, self.batch = torch.fx.Graph(), batch
        self.aten = torch.ops.aten
        given = old.graph.find_nodes(op="placeholder")
        self._device = next(x.meta["val"].device for x in given)
        self._apart: dict[Node, Grid | None] = {}

    def call(self, target: Any, *args: Any, **more: Any) -> Any:
        """Add an operation and return its result; duplicates are merged later."""
        return self.graph.call_function(target, args, more)

    def constant(self, node: Node, value: Tensor) -> None:
        """Register the value of a constant; equal entries in the whole batch become numbers."""
        node.meta["val"] = value
        if along(tuple(value.shape), self.batch) is None and splits(tuple(value.shape)):
            numbers = np.array(value.tolist(), dtype=object).reshape(tuple(value.shape))
            self._apart[node] = Grid(numbers, None, value.dtype)

    def apart(self, node: Node) -> Grid | None:
        """Split a tensor into its entries; None if they are too many."""
        if node not in self._apart:
            self._apart[node] = self._taken_apart(node)
        return self._apart[node]

    def _taken_apart(self, node: Node) -> Grid | None:
        import torch

        value = node.meta.get("val")
        if not isinstance(value, torch.Tensor):
            return None
        shape = tuple(value.shape)
        axis = along(shape, self.batch)
        form = blocks(shape, axis, self.batch)
        if not splits(form):
            return None

        def entry(index: tuple[int, ...]) -> Any:
            found = node
            for k in reversed(range(len(index))):
                if k != axis:
                    found = self.call(self.aten.select.int, found, k, index[k])
            if axis is not None and form[axis] > 1:
                low = index[axis] * self.batch
                found = self.call(self.aten.slice.Tensor, found, 0, low, low + self.batch)
            return found

        return Grid(filled_with(form, entry), axis, value.dtype)

    def column(self, entry: Any, kind: dtype) -> Any:
        """Return an entry as a tensor; a number becomes a 0-dimensional one."""
        if is_node(entry):
            return entry
        return self.call(self.aten.full.default, [], entry, dtype=kind, device=self._device)

    def full(self, entry: Any, kind: dtype) -> Any:
        """Return an entry as a column of B rows."""
        return self.call(self.aten.expand.default, self.column(entry, kind), [self.batch])

    def whole(self, found: Any) -> Any:
        """Return a grid as one tensor, the batch axis fastest in memory; other values unchanged."""
        import torch

        if not isinstance(found, Grid):
            return found
        aten, shape = self.aten, found.shape(self.batch)
        if not found.entries.size:
            return self.call(aten.zeros.default, list(shape), dtype=found.kind, device=self._device)
        if found.axis is None:
            flat = [self.column(x, found.kind) for x in found.entries.flat]
            joined = self.call(aten.stack.default, flat, 0)
            return self.call(aten.reshape.default, joined, list(shape))
        last = np.moveaxis(found.entries, found.axis, -1)
        rows = []
        for index in np.ndindex(last.shape[:-1]):
            parts = [self.full(x, found.kind) for x in last[index]]
            rows.append(parts[0] if len(parts) == 1 else self.call(aten.cat.default, parts, 0))
        if last.ndim == 1:
            return self.call(aten.clone.default, rows[0], memory_format=torch.contiguous_format)
        table = self.call(aten.stack.default, rows, 0)
        long = self.call(aten.reshape.default, table, [*last.shape[:-1], shape[found.axis]])
        order = [*(k for k in range(last.ndim) if k != found.axis), found.axis]
        return self.call(aten.permute.default, long, [order.index(k) for k in range(last.ndim)])

    def apply(
        self, node: Node, entries: Sequence[Any], kinds: Sequence[dtype], result: dtype
    ) -> Any:
        """Apply a pointwise operation to one entry of each input.

        Args:
            node: that calls it with whole tensors.
            entries: of its inputs, in the order of `all_input_nodes`.
            kinds: types of the inputs.
            result: type of the result.
        """
        from torch.fx.node import map_arg

        target: Any = node.target
        if str(target) in SAME:
            return entries[0]
        if not any(is_node(x) for x in entries):
            return self._number(node, entries, kinds)
        places = {x: k for k, x in enumerate(node.all_input_nodes)}
        if not node.kwargs:
            given = map_arg(node.args, lambda x: entries[places[x]])
            short = _shortened(str(target), given, result, kinds, self._negated)
            if short is not None:
                return short
        columns = self._alike(node, entries, kinds)
        if target is self.aten._to_copy.default:
            return self.call(target, columns[0], dtype=result)
        args = map_arg(node.args, lambda x: columns[places[x]])
        return self.call(target, *args, **node.kwargs)

    def _alike(self, node: Node, entries: Sequence[Any], kinds: Sequence[dtype]) -> list[Any]:
        """Convert entries to the type to which PyTorch promotes the whole inputs.

        That depends on which of them have an index, and columns have other indices than the whole.
        """
        import torch

        columns = [self.column(x, kind) for x, kind in zip(entries, kinds, strict=True)]
        numbers = {kind for kind in kinds if kind != torch.bool}
        if len(numbers) < 2:
            return columns
        whole = [x.meta["val"] for x in node.all_input_nodes]
        joined = _joined_type([x for x in whole if x.dtype != torch.bool])
        copy = self.aten._to_copy.default
        return [
            x if kind in {torch.bool, joined} else self.call(copy, x, dtype=joined)
            for x, kind in zip(columns, kinds, strict=True)
        ]

    def _number(self, node: Node, entries: Sequence[Any], kinds: Sequence[dtype]) -> Any:
        """Return the result of a pointwise operation on numbers."""
        import torch
        from torch.fx.node import map_arg

        values = {
            x: torch.tensor(entry, dtype=kind)
            for x, entry, kind in zip(node.all_input_nodes, entries, kinds, strict=True)
        }
        args: Any = map_arg(node.args, values.__getitem__)
        more: Any = map_arg(node.kwargs, values.__getitem__)
        target: Any = node.target
        return target(*args, **{k: v for k, v in more.items() if k != "device"}).item()

    def _negated(self, entry: Any) -> Any:
        return self.call(self.aten.neg.default, entry) if is_node(entry) else -entry

    def total(self, entries: Sequence[Any]) -> Any:
        """Return the sum of entries of one floating type."""
        number = sum(x for x in entries if not is_node(x))
        terms = [x for x in entries if is_node(x)]
        if number != 0 or not terms:
            terms.append(number)
        return functools.reduce(functools.partial(self.call, self.aten.add.Tensor), terms)

    def product(self, one: Any, other: Any, kind: dtype) -> Any:
        """Return the product of two entries of one floating type."""
        if not is_node(one) and not is_node(other):
            return one * other
        short = _shortened("aten.mul.Tensor", (one, other), kind, (kind,), self._negated)
        if short is not None:
            return short
        return self.call(self.aten.mul.Tensor, *((one, other) if is_node(one) else (other, one)))


def _joined_type(values: Sequence[Tensor]) -> dtype:
    """Return PyTorch's result type; 0-dimensional tensors do not promote it.

    Example:
        >>> import torch
        >>> _joined_type([torch.zeros(2, dtype=torch.float32), torch.tensor(1.0).double()])
        torch.float32
    """
    import torch

    sides = ([x.dtype for x in values if x.ndim], [x.dtype for x in values if not x.ndim])
    many, one = (functools.reduce(torch.promote_types, side) if side else None for side in sides)
    if many is None or one is None:
        found = many or one
        assert found is not None
        return found
    return torch.result_type(torch.empty(1, dtype=many), torch.empty((), dtype=one))


def _shortened(
    name: str, given: Sequence[Any], result: dtype, kinds: Sequence[dtype], negated: Negated
) -> Any:
    """Return the result of an operation that needs no computation, otherwise None.

    Args:
        name: of the operation.
        given: entries and numbers.
        result: type of the result.
        kinds: types of the entries.
        negated: makes the negative of an entry.
    """
    if any(kind.is_floating_point and kind != result for kind in kinds):
        return None
    if name == "aten.where.self":
        return None if is_node(given[0]) else _choice(given, result, kinds[1:])
    plain = result.is_floating_point and all(kind == result for kind in kinds)
    law = _LAWS.get(name)
    return law(given[0], given[1], negated) if law and plain and len(given) == 2 else None


def _choice(given: Sequence[Any], result: dtype, kinds: Sequence[dtype]) -> Any:
    """Return the branch that a constant mask selects, if its type fits the result."""
    import torch

    chosen = given[1 if given[0] else 2]
    strange = isinstance(chosen, bool) and result != torch.bool
    return None if strange or any(kind != result for kind in kinds) else chosen


def _product(one: Any, other: Any, negated: Negated) -> Any:
    for x, factor in ((one, other), (other, one)):
        if not is_node(factor) and factor in {0.0, 1.0, -1.0}:
            return 0.0 if factor == 0.0 else x if factor == 1.0 else negated(x)
    return None


def _sum(one: Any, other: Any, negated: Negated) -> Any:
    for x, term in ((one, other), (other, one)):
        if not is_node(term) and term == 0.0:
            return x
    return None


def _difference(one: Any, other: Any, negated: Negated) -> Any:
    if not is_node(other) and other == 0.0:
        return one
    return negated(other) if not is_node(one) and one == 0.0 else None


_LAWS: Mapping[str, Callable[[Any, Any, Negated], Any]] = {
    "aten.mul.Tensor": _product,
    "aten.add.Tensor": _sum,
    "aten.sub.Tensor": _difference,
}
