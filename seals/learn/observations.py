"""Operations on observations that are a tensor or a mapping of tensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from torch import Tensor


def each(function: Callable[..., Any], first: Any, *others: Any) -> Any:
    """Apply a function to each leaf of observations of equal structure.

    Example:
        >>> each(lambda a, b: a + b, {"state": 1, "pixels": 2}, {"state": 10, "pixels": 20})
        {'state': 11, 'pixels': 22}
        >>> each(abs, -3)
        3
    """
    if isinstance(first, Mapping):
        return {
            key: function(leaf, *(other[key] for other in others)) for key, leaf in first.items()
        }
    return function(first, *others)


def where(condition: Tensor, chosen: Any, other: Any) -> Any:
    """Return rows of one observation or of another, by a condition (N,)."""
    import torch

    def leaf(a: Tensor, b: Tensor) -> Tensor:
        return torch.where(condition.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return each(leaf, chosen, other)


def vector(observation: Any) -> Tensor:
    """Return the state vector of an observation, without its images."""
    found = observation["state"] if isinstance(observation, Mapping) else observation
    return cast("Tensor", found)


def tensors(columns: Mapping[str, Any], device: str) -> dict[str, Any]:
    """Return columns of arrays as tensors on a device, real numbers as float32."""
    import torch

    def leaf(value: Any) -> Tensor:
        found = torch.as_tensor(value, device=device)
        return found.float() if found.dtype == torch.float64 else found

    return {key: each(leaf, value) for key, value in columns.items()}
