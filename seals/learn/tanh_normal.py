"""Normal distribution of actions squashed into [-1, 1] by tanh, with its log-probability."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Generator, Tensor

LOWEST, HIGHEST = -5.0, 2.0
"""Bounds of the logarithm of the standard deviation before squashing."""


class TanhNormal:
    """Distribution of tanh(u), u normal with independent components.

    TorchRL's class of this name draws from the global random state; this one takes a generator.

    Equation:
        u = mean + deviation * noise,  action = tanh u
        log_prob = log N(u) - sum over components of log(1 - tanh^2 u)

    Args:
        output: mean and raw deviation of each component, shape (batch, 2 a).

    References:
        Haarnoja et al. 2018, arXiv 1812.05905, appendix C.
    """

    def __init__(self, output: Tensor) -> None:
        """Split the output of a network into mean and deviation."""
        self._mean, self._raw = output.chunk(2, -1)

    @property
    def mode(self) -> Tensor:
        """Most likely action, without noise, shape (batch, a)."""
        return self._mean.tanh()

    def sample(self, generator: Generator) -> tuple[Tensor, Tensor]:
        """Draw an action (batch, a), differentiably, and return it with its log_prob (batch,).

        Args:
            generator: source of the noise.
        """
        import torch
        from torch.nn.functional import softplus

        mean = self._mean
        log_deviation = LOWEST + 0.5 * (HIGHEST - LOWEST) * (torch.tanh(self._raw) + 1.0)
        noise = torch.randn(mean.shape, generator=generator, device=mean.device, dtype=mean.dtype)
        before = mean + log_deviation.exp() * noise
        # log(1 - tanh^2 u) = 2 (log 2 - u - softplus(-2 u)), which does not underflow
        shrink = 2.0 * (math.log(2.0) - before - softplus(-2.0 * before))
        log_prob = -0.5 * noise**2 - log_deviation - 0.5 * math.log(2.0 * math.pi) - shrink
        return torch.tanh(before), log_prob.sum(-1)
