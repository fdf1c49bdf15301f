"""Batched environments as learners see them, and operations on their observations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast, runtime_checkable

from seals.arrays import Array, namespace
from seals.pytree import mapped

if TYPE_CHECKING:
    from torch import Tensor


class StepResult(NamedTuple):
    """Result of one step of N environments; ended episodes are reset at once.

    Args:
        observation: that the next action answers, the first of the next episode where one ended;
            a tensor (N, d), or a mapping with ``state`` (N, d) and ``pixels`` (N, C, H, W) uint8.
        reward: (N,).
        terminated: whether the task ended the episode, bool (N,).
        truncated: whether its time was over, bool (N,).
        final: observation that this step reached; the same as ``observation`` where no episode
            ended.
        success: whether the episode that ended had succeeded, bool (N,).
        facts: further numbers of this step by name, (N,) each.
    """

    observation: Any
    reward: Tensor
    terminated: Tensor
    truncated: Tensor
    final: Any
    success: Tensor
    facts: Mapping[str, Tensor]


@runtime_checkable
class Batched(Protocol):
    """N environments of one kind, on one device, in float32.

    Attributes:
        count: N.
        observation_size: numbers in an observation; of ``state`` where there are pixels.
        action_size: numbers in an action, each from -1 to 1.
        pixels: channels, height and width of the picture, or None.
        device: of all tensors.
    """

    count: int
    observation_size: int
    action_size: int
    pixels: tuple[int, int, int] | None
    device: str

    def reset(self, seeds: Sequence[int] | None = None) -> Any:
        """Reset all environments and return the observations.

        Args:
            seeds: of the N episodes; None draws them from the environments' own random state.
        """

    def step(self, action: Tensor) -> StepResult:
        """Step all environments with actions of shape (N, action_size)."""

    def scripted_policy(self) -> Tensor:
        """Return the actions of the task's scripted policy, shape (N, action_size)."""

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors.

        Raises:
            NotImplementedError: the engine behind it cannot be put back.
        """

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""

    def close(self) -> None:
        """Release all resources."""


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
