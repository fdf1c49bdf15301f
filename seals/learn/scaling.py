"""Observation normalisation by running statistics, and reward transforms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from seals.learn.networks import normaliser_of
from seals.learn.stateful import Stateful

if TYPE_CHECKING:
    from torch import Tensor

FORMS = ("plain", "symlog", "clip")
"""Forms of a reward: as it is, the logarithm of its size, or cut off at -1 and 1."""

PRIOR = 0.01
"""Observations that mean 0 and variance 1 count for before the first real one."""


def transform_reward(reward: Tensor, *, scale: float, form: str) -> Tensor:
    """Scale a reward and transform it by symlog or clipping.

    Args:
        reward: as the task gives it.
        scale: multiplies it first.
        form: of `FORMS`; ``"symlog"`` is sign(r) log(1 + |r|), for rewards over many decades.

    References:
        Hafner et al. 2023, arXiv 2301.04104 (symlog).
    """
    scaled = reward * scale
    if form == "symlog":
        return scaled.sign() * scaled.abs().log1p()
    return scaled.clamp(-1.0, 1.0) if form == "clip" else scaled


class RunningNormaliser(Stateful):
    """Running mean and variance of observations, stored in the normalisation layer.

    References:
        Chan, Golub and LeVeque 1983, doi 10.1080/00031305.1983.10483115 (joining of variances).
    """

    parts, plain = ("layer",), ("count",)

    def __init__(self, size: int, device: str) -> None:
        """Start with mean 0 and variance 1, at the weight of a hundredth of an observation."""
        self.layer: Any = normaliser_of(size).to(device)
        self.count = PRIOR

    def update(self, batch: Tensor) -> None:
        """Update mean and variance with a batch (N, d) of observations."""
        import torch

        with torch.no_grad():
            mean, variance = self.layer.running_mean, self.layer.running_var
            new = float(batch.shape[0])
            total = self.count + new
            offset = batch.mean(0) - mean
            spread = batch.var(0, unbiased=False)
            variance.copy_(
                (self.count * variance + new * spread + self.count * new / total * offset**2)
                / total
            )
            mean.add_(offset * (new / total))
            self.count = total
