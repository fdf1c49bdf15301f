"""Samplers of a replay buffer: uniform, with a fixed share of demonstrations, or by priority."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from seals.learn.stateful import Stateful

if TYPE_CHECKING:
    from torch import Generator, Tensor


class Sampler(Stateful):
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

    def sample(self, stored: int, count: int) -> tuple[Tensor, Tensor | None]:
        """Return indices (count,) of so many stored transitions, and weights or None."""
        import torch

        kept = self.protected
        draw = functools.partial(
            torch.randint, generator=self.generator, device=_device(self.generator)
        )
        if self.share is None or kept in (0, stored):
            return draw(0, stored, (count,)), None
        shown = round(self.share * count)
        return torch.cat([draw(0, kept, (shown,)), draw(kept, stored, (count - shown,))]), None

    def extend(self, index: Tensor) -> None:
        """Do nothing: uniform sampling keeps no record of transitions."""


class Prioritised(Sampler):
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

    parts = ("priorities", "largest", "scale")
    plain = ("updates", "weight")
    MEMORY = 0.999
    """Share of the running mean of |delta| that stays from one batch to the next."""

    def __init__(
        self, *, alpha: float, beta: float, anneal: int, epsilon: float, bonus: float
    ) -> None:
        """Store the parameters; priorities are allocated with the first transition."""
        super().__init__()
        self.alpha, self.beta, self.anneal = alpha, beta, anneal
        self.epsilon, self.bonus = epsilon, bonus
        self.priorities: Any = None
        self.updates = 0
        self.weight = 0.0
        self.largest: Any = None
        self.scale: Any = None

    def allocate(self, size: int, device: str) -> None:
        """Allocate the priorities of ``size`` transitions, all zero."""
        import torch

        self.priorities = torch.zeros(size, dtype=torch.float64, device=device)
        self.largest, self.scale = self.priorities.new_ones(()), self.priorities.new_zeros(())

    def sample(self, stored: int, count: int) -> tuple[Tensor, Tensor | None]:
        """Return indices (count,) and their weights, largest 1.

        Running sums of all priorities are made anew for each batch: one pass over the memory, and
        nothing that could drift.
        """
        import torch

        device = _device(self.generator)
        at = torch.rand(count, generator=self.generator, device=device, dtype=torch.float64)
        sums = self.priorities[:stored].cumsum(0)
        index = torch.searchsorted(sums, at * sums[-1], right=True).clamp(max=stored - 1)
        share = self.priorities[index] / sums[-1]
        rise = min(1.0, self.updates / max(self.anneal, 1))
        weight = (stored * share) ** -(self.beta + (1.0 - self.beta) * rise)
        return index, (weight / weight.max()).float()

    def extend(self, index: Tensor) -> None:
        """Give new transitions the largest recent error."""
        self.priorities[index] = self._priority(index, self.largest.expand(index.shape))

    def update_priorities(self, index: Tensor, error: Tensor) -> None:
        """Update the priorities of drawn transitions by their errors (batch,)."""
        import torch

        size = error.detach().double().abs()
        self.scale = self.MEMORY * self.scale + (1.0 - self.MEMORY) * size.mean()
        self.weight = self.MEMORY * self.weight + (1.0 - self.MEMORY)
        scaled = size / (self.scale / self.weight).clamp(min=1e-12)
        self.largest = torch.maximum(scaled.max(), 0.999 * self.largest)
        self.priorities[index] = self._priority(index, scaled)
        self.updates += 1

    def _priority(self, index: Tensor, scaled: Tensor) -> Tensor:
        shown = (index < self.protected).to(scaled.dtype)
        return (scaled + self.epsilon + self.bonus * shown) ** self.alpha


def _device(generator: Generator | None) -> Any:
    return "cpu" if generator is None else generator.device
