"""Algebraic simplification: products with 0, 1 and -1, sums with 0, equal alternatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from seals.tensor_compiler.grids import is_node

if TYPE_CHECKING:
    from torch import dtype

Negated = Callable[[Any], Any]
"""An entry to its negative."""


def shortened(
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
