"""Tracing of a function into an operator graph, without data-dependent branches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from seals.arrays import undecided
from seals.errors import ConfigError, line_in_law
from seals.tensor_compiler.constants import draws, moved, worked_out
from seals.tensor_compiler.entrywise import FEWEST, entrywise

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule, Node

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
            f"this robot cannot be fused: {line_in_law(problem, _FOLLOWERS)}, asks for a number to "
            "decide what comes next.\nWrite it without branches on numbers (seals.arrays.some), or "
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
