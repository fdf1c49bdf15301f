"""Simplification of a traced graph: common subexpressions, constants, scalar columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from seals.tensor_compiler.constants import draws, moved, worked_out
from seals.tensor_compiler.entrywise import FEWEST, entrywise

if TYPE_CHECKING:
    from torch.fx import GraphModule, Node


def tidied(graph: GraphModule, device: Any) -> GraphModule:
    """Return the simplified graph with equal results, its constants on a device.

    The same but for rounding, the sign of zero, and what is not finite, see `entrywise`.
    """
    graph.graph.eliminate_dead_code()
    moved(graph, device)
    constants = worked_out(graph)
    given = (x.meta["val"] for x in graph.graph.find_nodes(op="placeholder"))
    batch = max((len(value) for value in given if value.ndim), default=0)
    if batch >= FEWEST:
        graph = entrywise(graph, constants, batch)
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
