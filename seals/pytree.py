"""Mapping and flattening of nested tuples and mappings of tensors, without PyTorch."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from torch import Tensor


def leaves(value: Any) -> Iterator[Any]:
    """Return the leaves: values other than tuples, mappings and None, in order.

    Example:
        >>> list(leaves((1, {"a": None, "b": (2,)})))
        [1, 2]
    """
    found: list[Any] = []
    _collect(value, found)
    return iter(found)


def _collect(value: Any, found: list[Any]) -> None:
    """Append the leaves; a tenth of the time of nested generators."""
    if type(value) is np.ndarray:
        found.append(value)
    elif isinstance(value, tuple):
        for part in value:
            _collect(part, found)
    elif isinstance(value, Mapping):
        for part in value.values():
            _collect(part, found)
    elif value is not None:
        found.append(value)


def tensors(value: Any) -> Iterator[Tensor]:
    """Yield the tensors among the leaves, in order."""
    return (leaf for leaf in leaves(value) if is_tensor(leaf))


def is_tensor(value: Any) -> bool:
    """Return whether a value is a PyTorch tensor, without importing PyTorch.

    Example:
        >>> is_tensor(1.0)
        False
    """
    return hasattr(value, "untyped_storage")


def mapped(value: Any, change: Callable[..., Any], *others: Any) -> Any:
    """Return the nest with every leaf changed, given the same leaves of other nests of its form.

    Example:
        >>> mapped((1, {"a": None, "b": (2,)}), lambda x: 10 * x)
        (10, {'a': None, 'b': (20,)})
        >>> mapped({"a": 1, "b": (2,)}, lambda x, y: x + y, {"a": 10, "b": [20]})
        {'a': 11, 'b': (22,)}
    """
    if isinstance(value, Mapping):
        return {
            name: mapped(part, change, *(other[name] for other in others))
            for name, part in value.items()
        }
    if isinstance(value, tuple):
        parts = [mapped(part, change, *more) for part, *more in zip(value, *others, strict=True)]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value if value is None else change(value, *others)


def copied(value: Any) -> Any:
    """Return a deep copy of a nest, tensors included."""
    return mapped(value, lambda leaf: leaf.clone())


def put(source: Any, target: Any) -> None:
    """Copy all tensors of one nest into those of another of the same form."""
    for new, old in zip(leaves(source), leaves(target), strict=True):
        old.copy_(new)


def filled(value: Any, others: Iterator[Tensor]) -> Any:
    """Return the nest with its tensors replaced by others, in order."""
    return mapped(value, lambda leaf: next(others) if is_tensor(leaf) else leaf)


def form_of(value: Any) -> Hashable:
    """Return the structure of a nested value as a key: shapes, types and constants.

    Example:
        >>> form_of((1.0, {"a": None})) == form_of((1.0, {"a": None}))
        True
        >>> form_of((1.0,)) in (form_of((2.0,)), form_of((1,)))
        False
    """
    if isinstance(value, Mapping):
        return Mapping, tuple((name, form_of(part)) for name, part in value.items())
    if isinstance(value, tuple):
        return type(value), tuple(form_of(part) for part in value)
    if is_tensor(value):
        shape = tuple(value.shape)
        # a step along an index of one place, or in an empty tensor, may be anything
        steps = tuple(s for s, n in zip(value.stride(), shape, strict=True) if n > 1 and all(shape))
        return shape, steps, value.dtype, str(value.device)
    kept: Hashable = value
    return type(value), kept
