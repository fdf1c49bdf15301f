"""Operations on observations that are a tensor or a mapping of tensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from seals.arrays import Array, namespace
from seals.pytree import mapped

if TYPE_CHECKING:
    from torch import Tensor


def picked(fresh: Any, other: Any, ended: Array) -> Any:
    """Select rows of one nest of tuples and mappings by the mask ``ended`` (N,), else of another.

    Example:
        >>> import numpy as np
        >>> picked(
        ...     (np.ones(2), {"a": np.ones(2)}),
        ...     (np.zeros(2), {"a": np.zeros(2)}),
        ...     np.array([True, False]),
        ... )
        (array([1., 0.]), {'a': array([1., 0.])})
    """
    xp = namespace(ended)

    def leaf(old: Array, new: Array) -> Array:
        return xp.where(xp.reshape(ended, (-1, *[1] * (old.ndim - 1))), new, old)

    return mapped(other, leaf, fresh)


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

    return {key: mapped(value, leaf) for key, value in columns.items()}
