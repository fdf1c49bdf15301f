"""A traced law made shorter: nothing twice, no work on constants, no calls for small matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule, Node

LARGEST = 4096
"""Entries of the largest constant that is worked out: a larger one is cheaper made than read."""
ENTRIES = 200
"""Entries of the largest constant matrix whose products are written out."""


def tidied(graph: GraphModule, device: Any) -> GraphModule:
    """Return the graph with the same results, its constants on a device."""
    graph.graph.eliminate_dead_code()
    _move(graph, device)
    constants = worked_out(graph)
    _write_out(graph, constants)
    _join_equals(graph)
    graph.graph.eliminate_dead_code()
    graph.graph.lint()
    graph.recompile()
    return graph


def _move(graph: GraphModule, device: Any) -> None:
    """Put every constant on a device: a recording cannot fetch what lies elsewhere."""
    for k, node in enumerate(list(graph.graph.find_nodes(op="get_attr"))):
        value = _attribute(graph, node.target)
        if value.device != device:
            graph.register_buffer(f"moved_{k}", value.to(device))
            node.target = f"moved_{k}"


def worked_out(graph: GraphModule) -> dict[Node, Tensor]:
    """Replace what depends on constants alone by its value; return all constants by their node."""
    from torch import Tensor
    from torch.fx.node import map_arg

    known: dict[Node, Tensor] = {}
    for node in list(graph.graph.nodes):
        if node.op == "get_attr":
            known[node] = _attribute(graph, node.target)
        elif node.op == "call_function" and node.all_input_nodes:
            if not all(part in known for part in node.all_input_nodes):
                continue
            args = map_arg(node.args, known.__getitem__)
            more = map_arg(node.kwargs, known.__getitem__)
            value = node.target(*args, **more)
            if not isinstance(value, Tensor) or value.numel() > LARGEST:
                continue
            name = f"worked_out_{len(known)}"
            graph.register_buffer(name, value.detach().clone())
            with graph.graph.inserting_before(node):
                constant = graph.graph.get_attr(name)
            node.replace_all_uses_with(constant)
            graph.graph.erase_node(node)
            known[constant] = value
    return known


def _attribute(graph: GraphModule, path: str) -> Any:
    found: Any = graph
    for part in path.split("."):
        found = getattr(found, part)
    return found


def _write_out(graph: GraphModule, constants: dict[Node, Tensor]) -> None:
    """Write products with small constant matrices as sums of columns; zeros take no part."""
    import torch

    aten = torch.ops.aten
    for node in list(graph.graph.nodes):
        if node.op != "call_function" or node.target is not aten.mm.default:
            continue
        left, right = node.args
        if right in constants and constants[right].numel() <= ENTRIES:
            rows, given, axis = constants[right].T.tolist(), left, 1
        elif left in constants and constants[left].numel() <= ENTRIES:
            rows, given, axis = constants[left].tolist(), right, 0
        else:
            continue
        with graph.graph.inserting_before(node):
            sums = [_sum(graph, given, axis, row) for row in rows]
            whole = graph.graph.call_function(aten.stack.default, (sums, axis))
        node.replace_all_uses_with(whole)
        graph.graph.erase_node(node)


def _sum(graph: GraphModule, given: Node, axis: int, weights: list[float]) -> Node:
    """A weighted sum of the columns (axis 1) or rows (axis 0) of a matrix."""
    import torch

    aten, call = torch.ops.aten, graph.graph.call_function
    total = None
    for k, weight in enumerate(weights):
        if weight == 0.0:
            continue
        part = call(aten.select.int, (given, axis, k))
        if weight == -1.0:
            part = call(aten.neg.default, (part,))
        elif weight != 1.0:
            part = call(aten.mul.Tensor, (part, weight))
        total = part if total is None else call(aten.add.Tensor, (total, part))
    if total is None:
        part = call(aten.select.int, (given, axis, 0))
        total = call(aten.mul.Tensor, (part, 0.0))
    return total


def _join_equals(graph: GraphModule) -> None:
    """Let what is done twice to the same numbers be done once; nothing here draws or writes."""
    seen: dict[Any, Node] = {}
    for node in list(graph.graph.nodes):
        if node.op not in {"call_function", "get_attr"}:
            continue
        # nodes are written by their names, which are each one's own, and numbers with their type
        key = (node.op, str(node.target), repr(node.args), repr(node.kwargs))
        before = seen.setdefault(key, node)
        if before is not node:
            node.replace_all_uses_with(before)
            graph.graph.erase_node(node)
