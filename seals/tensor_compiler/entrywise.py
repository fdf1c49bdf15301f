"""Scalarisation of a traced function: each entry of a small tensor becomes a column.

Columns of one length are what a compiler joins into few kernels; nothing small is stored between.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.tensor_compiler import adding, moving
from seals.tensor_compiler.columns import SAME, Columns
from seals.tensor_compiler.grids import Grid, along, broadcast, filled_with, splits

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule, Node

FEWEST = 64
"""Rows of the smallest batch that is worth it."""
PLAIN = SAME | {"aten._to_copy.default"}
"""Operations that do the same with every entry, though PyTorch does not say so."""
FORMS: Mapping[str, Callable[..., Any]] = {
    "aten.view.default": moving.view,
    "aten._unsafe_view.default": moving.view,
    "aten.reshape.default": moving.view,
    "aten.permute.default": moving.permute,
    "aten.unsqueeze.default": moving.unsqueeze,
    "aten.squeeze.dim": moving.squeeze,
    "aten.squeeze.dims": moving.squeeze,
    "aten.select.int": moving.select,
    "aten.slice.Tensor": moving.cut,
    "aten.expand.default": moving.expand,
    "aten.cat.default": moving.cat,
    "aten.stack.default": moving.stack,
    "aten.unbind.int": moving.unbind,
    "aten.zeros.default": moving.filled,
    "aten.zeros_like.default": moving.filled,
    "aten.ones.default": moving.filled,
    "aten.ones_like.default": moving.filled,
    "aten.full.default": moving.filled,
    "aten.fill.Scalar": moving.filled,
    "aten.scalar_tensor.default": moving.filled,
    "aten.diagonal.default": moving.diagonal,
    "aten.diagonal_scatter.default": moving.with_diagonal,
    "aten.sum.dim_IntList": adding.reduced(adding.total),
    "aten.amax.default": adding.reduced(adding.by("maximum.default")),
    "aten.amin.default": adding.reduced(adding.by("minimum.default")),
    "aten.any.dim": adding.reduced(adding.by("bitwise_or.Tensor")),
    "aten.all.dim": adding.reduced(adding.by("bitwise_and.Tensor")),
    "aten.mm.default": adding.matmul,
    "aten.bmm.default": adding.matmul,
}
"""Operations by name, as what they do to grids."""


def entrywise(graph: GraphModule, constants: Mapping[Node, Tensor], batch: int) -> GraphModule:
    """Return the scalarised graph; results are equal for finite numbers, up to the sign of zero.

    Products with a constant 0 are 0, whatever the other factor; sums are of the same terms.

    Args:
        graph: nodes with their results in `meta`, as PyTorch's tracing leaves them.
        constants: values of the nodes that hold constants.
        batch: rows B; an index whose size is a multiple of it runs along the batch.
    """
    import torch
    from torch.fx.node import map_arg

    writing = _Writing(Columns(graph, batch), constants)
    for node in graph.graph.nodes:
        if node.op == "output":
            writing.columns.graph.output(map_arg(node.args[0], writing.whole))
        else:
            writing.found[node] = writing.written(node)
    return torch.fx.GraphModule(graph, writing.columns.graph)


class _Writing:
    """Nodes of a graph as grids, as nodes of the new graph, or as lists of either."""

    def __init__(self, columns: Columns, constants: Mapping[Node, Tensor]) -> None:
        self.columns, self.constants = columns, constants
        self.found: dict[Node, Any] = {}

    def whole(self, node: Node) -> Any:
        """Return a result as one tensor."""
        return self.columns.whole(self.found[node])

    def written(self, node: Node) -> Any:
        """Return the result of a node, entry by entry where that is implemented."""
        import torch

        if node.op != "call_function":
            new = self.columns.graph.node_copy(node, self.found.__getitem__)
            if node in self.constants:
                self.columns.constant(new, self.constants[node])
            return new
        target: Any = node.target
        given: Any = node.args
        name, made = str(target), None
        if target is operator.getitem and isinstance(self.found[given[0]], list):
            return self.found[given[0]][given[1]]
        if name == "aten.index_select.default":
            made = self._looked_up(node, *given)
        elif name in FORMS:
            made = self._formed(node, FORMS[name])
        elif name in PLAIN or torch.Tag.pointwise in getattr(target, "tags", ()):
            made = self._pointwise(node)
        return self._as_it_was(node) if made is None else made

    def _as_it_was(self, node: Node) -> Any:
        """Return the unchanged operation on whole tensors."""
        import torch

        new = self.columns.graph.node_copy(node, self.whole)
        if str(new.target).startswith("aten.as_strided"):
            raise ConfigError(
                "this law cannot be fused: it asks where numbers lie in memory (as_strided).\n"
                "Write it with indices, or leave out backend.fused, or fused=True"
            )
        if str(new.target) in {"aten.view.default", "aten._unsafe_view.default"}:
            # what was made of columns lies otherwise in memory
            new.target = torch.ops.aten.reshape.default
        return new

    def _grid(self, node: Node) -> Grid | None:
        """Return the entries of a result; None for too many entries or no tensor."""
        found = self.found[node]
        return found if isinstance(found, Grid) else self.columns.apart(found)

    def _formed(self, node: Node, form: Callable[..., Any]) -> Any:
        """Apply an operation that rearranges or concatenates entries."""
        from torch.fx.node import map_arg

        grids: dict[Node, Any] = {x: self._grid(x) for x in node.all_input_nodes}
        if any(grid is None for grid in grids.values()):
            return None
        args: Any = map_arg(node.args, grids.__getitem__)
        more: Any = map_arg(node.kwargs, grids.__getitem__)
        made = form(self.columns, node, *args, **more)
        if isinstance(made, Grid) and made.axis is None:
            # an index that has grown as long as the batch would be taken for it
            return None if along(made.entries.shape, self.columns.batch) is not None else made
        return made

    def _pointwise(self, node: Node) -> Grid | None:
        """Apply a pointwise operation to every entry."""
        import torch

        if not isinstance(node.meta["val"], torch.Tensor):
            return None
        grids = [self._grid(x) for x in node.all_input_nodes]
        known = [grid for grid in grids if grid is not None]
        both = broadcast(known) if known and len(known) == len(grids) else None
        if both is None or not splits(both[0][0].shape):
            return None
        entries, axis = both
        kinds, result = [grid.kind for grid in known], node.meta["val"].dtype

        def one(index: tuple[int, ...]) -> Any:
            return self.columns.apply(node, [x[index] for x in entries], kinds, result)

        return Grid(filled_with(entries[0].shape, one), axis, result)

    def _looked_up(self, node: Node, table: Node, dim: int, index: Node) -> Grid | None:
        """Look up entries of a table, kept whole, by indices entry by entry."""
        places, value = self._grid(index), node.meta["val"]
        if places is None or places.axis is None or value.ndim != 1:
            return None
        columns, whole = self.columns, self.whole(table)

        def one(k: tuple[int, ...]) -> Any:
            rows = columns.full(places.entries[k], places.kind)
            return columns.call(node.target, whole, dim, rows)

        return Grid(filled_with(places.entries.shape, one), places.axis, value.dtype)
