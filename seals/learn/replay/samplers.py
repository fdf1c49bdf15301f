"""Samplers of a replay buffer: uniform, with a fixed share of demonstrations, or by priority.

The logic lies in plain classes; `as_torchrl_sampler` ties one to TorchRL's base class of samplers
when a buffer is made, so that this module is read without TorchRL.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seals.learn.replay.sums import SumTree

if TYPE_CHECKING:
    from torch import Generator, Tensor


class Uniform:
    """Uniform sampling, or a fixed share of demonstrations.

    Args:
        share: of a batch that comes from the protected demonstrations, from 0 to 1; None draws
            demonstrations and experience alike, in proportion to their number.
    """

    protected = 0
    generator: Generator | None = None

    def __init__(self, *, share: float | None = None) -> None:
        """Store the share."""
        self.share = share

    def allocate(self, size: int, device: str) -> None:
        """Do nothing: uniform sampling has no priorities."""

    def update_priorities(self, index: Tensor, error: Tensor) -> None:
        """Do nothing: uniform sampling has no priorities to update."""

    def sample(self, storage: Any, batch_size: int) -> tuple[Tensor, dict[str, Any]]:
        """Return indices (batch,), in the form of TorchRL."""
        import torch

        stored, kept = len(storage), self.protected
        draw = functools.partial(
            torch.randint, generator=self.generator, device=_device(self.generator)
        )
        if self.share is None or kept in (0, stored):
            return draw(0, stored, (batch_size,)), {}
        shown = round(self.share * batch_size)
        return torch.cat([draw(0, kept, (shown,)), draw(kept, stored, (batch_size - shown,))]), {}

    def extend(self, index: Tensor) -> None:
        """Do nothing: uniform sampling keeps no record of transitions."""

    def state_dict(self) -> dict[str, Any]:
        """Return an empty state."""
        return {}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Do nothing: there is no state."""


class Prioritised:
    """Prioritised sampling by temporal-difference error, with a bonus for demonstrations.

    Equation:
        p_i = (|delta_i| / s + epsilon + epsilon_d d_i)^alpha,  P(i) = p_i / sum p
        w_i = (n P(i))^-beta / max_j w_j

    s is a running mean of |delta|: the bonus epsilon_d of demonstrations (d_i = 1) then has the
    same meaning whatever the size of the reward. A new transition has the largest |delta| / s seen
    of late.

    Args:
        alpha: 0 draws all alike, 1 in proportion to the error.
        beta: correction of the bias at first, from 0 to 1; it rises to 1.
        anneal: updates over which it rises.
        epsilon: added to every error, in units of the mean error.
        bonus: added to that of a demonstration, in units of the mean error.

    References:
        Schaul et al. 2016, arXiv 1511.05952; Vecerik et al. 2017, arXiv 1707.08817.
    """

    protected = 0
    generator: Generator | None = None
    MEMORY = 0.999
    """Share of the running mean of |delta| that stays from one batch to the next."""

    def __init__(
        self, *, alpha: float, beta: float, anneal: int, epsilon: float, bonus: float
    ) -> None:
        """Store the parameters; the tree is allocated with the first transition."""
        self.alpha, self.beta, self.anneal = alpha, beta, anneal
        self.epsilon, self.bonus = epsilon, bonus
        self.tree: SumTree | None = None
        self.updates = 0
        self._weight = 0.0
        self._largest: Tensor | float = 1.0
        self._scale: Tensor | float = 0.0

    def allocate(self, size: int, device: str) -> None:
        """Allocate the priorities of ``size`` transitions."""
        self.tree = SumTree(size, device)

    def sample(self, storage: Any, batch_size: int) -> tuple[Tensor, dict[str, Any]]:
        """Return indices (batch,) and their weights, in the form of TorchRL."""
        import torch

        tree = self._allocated()
        device = _device(self.generator)
        at = torch.rand(batch_size, generator=self.generator, device=device, dtype=torch.float64)
        total = tree.total
        index = tree.draw(at * total)
        share = tree.get(index) / total
        rise = min(1.0, self.updates / max(self.anneal, 1))
        weight = (len(storage) * share) ** -(self.beta + (1.0 - self.beta) * rise)
        return index, {"weight": (weight / weight.max()).float()}

    def extend(self, index: Tensor) -> None:
        """Give new transitions the largest recent error."""
        import torch

        tree = self._allocated()
        index = torch.as_tensor(index, device=tree.levels[0].device).reshape(-1)
        error = torch.ones(index.shape, dtype=torch.float64, device=index.device) * self._largest
        tree.put(index, self._priority(index, error))

    def update_priorities(self, index: Tensor, error: Tensor) -> None:
        """Update the priorities of drawn transitions by their errors (batch,)."""
        import torch

        size = error.detach().double().abs()
        self._scale = self.MEMORY * self._scale + (1.0 - self.MEMORY) * size.mean()
        self._weight = self.MEMORY * self._weight + (1.0 - self.MEMORY)
        mean = torch.as_tensor(self._scale) / self._weight
        scaled = size / mean.clamp(min=1e-12)
        self._largest = torch.maximum(scaled.max(), 0.999 * torch.as_tensor(self._largest))
        self._allocated().put(index, self._priority(index, scaled))
        self.updates += 1

    def _priority(self, index: Tensor, scaled: Tensor) -> Tensor:
        shown = (index < self.protected).to(scaled.dtype)
        found: Tensor = (scaled + self.epsilon + self.bonus * shown) ** self.alpha
        return found

    def _allocated(self) -> SumTree:
        if self.tree is None:
            raise RuntimeError("a prioritised sampler is used before its buffer was made")
        return self.tree

    def state_dict(self) -> dict[str, Any]:
        """Return the priorities and the running figures."""
        import torch

        return {
            "leaves": self._allocated().leaves(),
            "updates": self.updates,
            "largest": torch.as_tensor(self._largest, dtype=torch.float64).clone(),
            "scale": torch.as_tensor(self._scale, dtype=torch.float64).clone(),
            "weight": self._weight,
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Restore that state."""
        tree = self._allocated()
        tree.fill(state["leaves"])
        device = tree.levels[0].device
        self.updates, self._weight = int(state["updates"]), float(state["weight"])
        self._largest = state["largest"].to(device)
        self._scale = state["scale"].to(device)


def as_torchrl_sampler(cls: type, **options: Any) -> Any:
    """Return a sampler of a class of this module as a ``Sampler`` of TorchRL.

    Example:
        >>> import pytest
        >>> samplers = pytest.importorskip("torchrl.data.replay_buffers.samplers")
        >>> isinstance(as_torchrl_sampler(Uniform, share=0.5), samplers.Sampler)
        True
    """
    return _bound_class(cls)(**options)


@functools.cache
def _bound_class(cls: type) -> type:
    from torchrl.data.replay_buffers.samplers import Sampler

    def nothing(self: Any, *_: Any) -> None:
        """Keep nothing on disk: the state goes into the checkpoint."""

    unused = dict.fromkeys(("_empty", "dumps", "loads"), nothing)
    return type(f"Sampler{cls.__name__}", (cls, Sampler), unused)


def _device(generator: Generator | None) -> Any:
    return "cpu" if generator is None else generator.device
