"""Tracing of a function into an operator graph, without data-dependent branches.

Constants are folded; then each entry of a small tensor becomes a column. Columns of one length are
what a compiler joins into few kernels; nothing small is stored between. Reductions and matrix
products work on grids of such entries.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import undecided
from seals.errors import ConfigError, line_in_law
from seals.tensor_compiler import moving
from seals.tensor_compiler.columns import (
    MOST,
    SAME,
    Columns,
    Grid,
    along,
    broadcast,
    filled_with,
    splits,
)
from seals.tensor_compiler.moving import unsqueeze

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule, Node


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


def _reduced(join: Join) -> Callable[..., Grid | None]:
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
            # convert an entry to another type
            return join(
                c,
                [
                    (
                        entry
                        if x.kind == kind
                        else c.call(c.aten._to_copy.default, c.column(entry, x.kind), dtype=kind)
                    )
                    for entry in table[index]
                ],
                kind,
            )

        axis = None if x.axis is None else kept.index(x.axis)
        found = Grid(filled_with(table.shape[:-1], one), axis, kind)
        return functools.reduce(lambda y, k: unsqueeze(c, node, y, k), gone if keep else [], found)

    return form


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
    "aten.sum.dim_IntList": _reduced(total),
    "aten.amax.default": _reduced(by("maximum.default")),
    "aten.amin.default": _reduced(by("minimum.default")),
    "aten.any.dim": _reduced(by("bitwise_or.Tensor")),
    "aten.all.dim": _reduced(by("bitwise_and.Tensor")),
    "aten.mm.default": matmul,
    "aten.bmm.default": matmul,
}
"""Operations by name, as what they do to grids."""


def _entrywise(graph: GraphModule, constants: Mapping[Node, Tensor], batch: int) -> GraphModule:
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
                "this law cannot be fused: it depends on the memory layout (as_strided).\n"
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


LARGEST = 4096
"""Entries of the largest constant that is always kept: a larger one may be cheaper made than read.
"""
WORTH = 8
"""Operations that a larger constant takes, at least, if reading it is cheaper than making it.

What is used twice on the way there counts twice.
"""


def moved(graph: GraphModule, device: Any) -> None:
    """Move every constant to a device."""
    for k, node in enumerate(list(graph.graph.find_nodes(op="get_attr"))):
        value = _attribute(graph, node.target)
        if value.device != device:
            graph.register_buffer(f"moved_{k}", value.to(device))
            node.target = f"moved_{k}"


def _worked_out(graph: GraphModule) -> dict[Node, Tensor]:
    """Evaluate nodes that depend on constants alone; return the values by node.

    Small ones are always replaced, larger ones where many operations lead to them.
    """
    known, effort = _known(graph)
    remaining: set[Node] = set()
    constants: dict[Node, Tensor] = {}
    for node in reversed(list(graph.graph.nodes)):
        if node not in known:
            remaining.add(node)
        elif node.op == "get_attr":
            constants[node] = known[node]
        elif not remaining.isdisjoint(node.users):
            value = known[node]
            if value.numel() <= LARGEST or effort[node] >= WORTH:
                constants[_constant(graph, node, value)] = value
            else:
                remaining.add(node)
    return constants


def _known(graph: GraphModule) -> tuple[dict[Node, Tensor], dict[Node, int]]:
    """Return the values of all nodes that depend on constants alone, and their costs."""
    import torch
    from torch.fx.node import map_arg

    products = {torch.ops.aten.mm.default, torch.ops.aten.bmm.default}
    known: dict[Node, Tensor] = {}
    effort: dict[Node, int] = {}
    for node in graph.graph.nodes:
        if node.op == "get_attr":
            known[node], effort[node] = _attribute(graph, node.target), 0
        elif node.op == "call_function" and node.all_input_nodes and not draws(node):
            if not all(part in known for part in node.all_input_nodes):
                continue
            args = map_arg(node.args, known.__getitem__)
            more = map_arg(node.kwargs, known.__getitem__)
            value = node.target(*args, **more)
            if not isinstance(value, torch.Tensor):
                continue
            known[node] = value
            stores = [known[x].untyped_storage().data_ptr() for x in node.all_input_nodes]
            new = value.untyped_storage().data_ptr() not in stores
            own = new * (known[node.args[0]].shape[-1] if node.target in products else 1)
            effort[node] = own + sum(effort[x] for x in node.all_input_nodes)
    return known, effort


def draws(node: Node) -> bool:
    """Return whether a node draws random numbers."""
    import torch

    return torch.Tag.nondeterministic_seeded in getattr(node.target, "tags", ())


def _constant(graph: GraphModule, node: Node, value: Tensor) -> Node:
    """Replace a node by a constant, stored once when all entries are equal."""
    import torch

    first = value.reshape(-1)[0].item() if value.numel() > LARGEST else None
    with graph.graph.inserting_before(node):
        if first is not None and bool((value == first).all()):
            constant = graph.graph.call_function(
                torch.ops.aten.full.default,
                (list(value.shape), first),
                {"dtype": value.dtype, "device": value.device},
            )
        else:
            name = f"worked_out_{node.name}"
            graph.register_buffer(name, value.detach().clone())
            constant = graph.graph.get_attr(name)
    constant.meta["val"] = value
    node.replace_all_uses_with(constant)
    graph.graph.erase_node(node)
    return constant


def _attribute(graph: GraphModule, path: str) -> Any:
    found: Any = graph
    for part in path.split("."):
        found = getattr(found, part)
    return found


_FOLLOWING: list[bool] = []
_FOLLOWERS = ("torch", "seals.tensor_compiler", "seals.arrays", "array_api_compat")


def following() -> bool:
    """Return whether a function is being traced, so that values are irrelevant."""
    return bool(_FOLLOWING)


def traced(law: Callable[..., list[Tensor]], given: Sequence[Tensor]) -> GraphModule:
    """Trace a function and return its graph, with constants folded.

    Args:
        law: of tensors, without memory; what it decides by numbers is decided as for an
            accelerator, see `seals.arrays.some`.
        given: tensors of the shapes, types and device that it will be given.

    Raises:
        ConfigError: the law asks for a number to decide what it does next.
    """
    import torch

    _FOLLOWING.append(True)
    try:
        with undecided(), torch.no_grad():
            graph = _without_writes(law, given)
    except RuntimeError as problem:
        if "tracing tensor" not in str(problem):
            raise
        raise ConfigError(
            f"this robot cannot be fused: {line_in_law(problem, _FOLLOWERS)}, branches on the "
            "value "
            "of a number.\nWrite it without branches on numbers (seals.arrays.some), or "
            "leave out backend.fused, or fused=True"
        ) from problem
    finally:
        _FOLLOWING.pop()
    return tidied(graph, given[0].device)


def _without_writes(law: Callable[..., list[Tensor]], given: Sequence[Tensor]) -> GraphModule:
    """Return the graph of a function without in-place operations.

    PyTorch turns writes into new tensors only where it knows the tensors: those that are given. A
    law holds others, and may write into a copy of one. So it is followed twice: the first graph
    names what it holds, the second one is given that as well.

    Args:
        law: of tensors, without memory.
        given: tensors of the shapes, types and device that it will be given.
    """
    import torch
    from torch.fx.experimental.proxy_tensor import make_fx

    first = make_fx(law)(*given)
    names = list(dict.fromkeys(str(node.target) for node in first.graph.find_nodes(op="get_attr")))
    held = [getattr(first, name) for name in names]

    def whole(*values: Tensor) -> Any:
        known = dict(zip(names, values[len(given) :], strict=True))
        return _interpreter(first, known).run(*values[: len(given)])

    graph: GraphModule = make_fx(torch.func.functionalize(whole))(*given, *held)
    places = list(graph.graph.find_nodes(op="placeholder"))[len(given) :]
    for node, name, value in zip(places, names, held, strict=True):
        _hold(graph, node, f"held_{name}", value)
    return graph


def _interpreter(graph: GraphModule, known: dict[str, Tensor]) -> Any:
    """Return an interpreter of a graph whose attributes are given."""
    import torch

    class Interpreter(torch.fx.Interpreter):
        """Takes attributes from what is known."""

        def get_attr(self, target: Any, args: Any, kwargs: Any) -> Any:
            return known[target]

    return Interpreter(graph)


def _hold(graph: GraphModule, node: Node, name: str, value: Tensor) -> None:
    """Store a tensor argument as a buffer of the graph."""
    graph.register_buffer(name, value)
    with graph.graph.inserting_before(node):
        new = graph.graph.get_attr(name)
    new.meta = dict(node.meta)
    node.replace_all_uses_with(new)
    graph.graph.erase_node(node)


def tidied(graph: GraphModule, device: Any) -> GraphModule:
    """Return the simplified graph with equal results, its constants on a device.

    The same but for rounding, the sign of zero, and what is not finite, see `_entrywise`.
    """
    graph.graph.eliminate_dead_code()
    moved(graph, device)
    constants = _worked_out(graph)
    given = (x.meta["val"] for x in graph.graph.find_nodes(op="placeholder"))
    batch = max((len(value) for value in given if value.ndim), default=0)
    if batch >= FEWEST:
        graph = _entrywise(graph, constants, batch)
    _join_equals(graph)
    graph.graph.eliminate_dead_code()
    graph.graph.lint()
    graph.recompile()
    return graph


def _join_equals(graph: GraphModule) -> None:
    """Merge common subexpressions; the graph has no in-place operations."""
    seen: dict[Any, Node] = {}
    for node in list(graph.graph.nodes):
        if node.op not in {"call_function", "get_attr"} or draws(node):
            continue
        # nodes are written by their names, which are each one's own, and numbers with their type
        key = (node.op, str(node.target), repr(node.args), repr(node.kwargs))
        before = seen.setdefault(key, node)
        if before is not node:
            node.replace_all_uses_with(before)
            graph.graph.erase_node(node)
