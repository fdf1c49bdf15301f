"""Removal of in-place operations while tracing (functionalisation)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule, Node


def without_writes(law: Callable[..., list[Tensor]], given: Sequence[Tensor]) -> GraphModule:
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
