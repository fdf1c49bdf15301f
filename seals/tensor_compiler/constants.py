"""Constant folding of traced functions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor
    from torch.fx import GraphModule, Node

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


def worked_out(graph: GraphModule) -> dict[Node, Tensor]:
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
