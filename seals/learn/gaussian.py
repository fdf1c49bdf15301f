"""Normal actions squashed into [-1, 1], with their log density."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Generator, Tensor

LOWEST, HIGHEST = -5.0, 2.0
"""Bounds of the logarithm of the deviation before squashing."""


def squashed(output: Tensor, generator: Generator) -> tuple[Tensor, Tensor]:
    """Draw an action and return it with its log density.

    Equation:
        u = mean + deviation * noise,  action = tanh u
        log density = log N(u) - sum over numbers of log(1 - tanh^2 u)

    Args:
        output: mean and raw deviation of each number, shape (batch, 2 a).
        generator: source of the noise.

    References:
        Haarnoja et al. 2018, arXiv 1812.05905, appendix C.
    """
    import torch
    from torch.nn.functional import softplus

    mean, raw = output.chunk(2, -1)
    log_deviation = LOWEST + 0.5 * (HIGHEST - LOWEST) * (torch.tanh(raw) + 1.0)
    noise = torch.randn(mean.shape, generator=generator, device=mean.device, dtype=mean.dtype)
    before = mean + log_deviation.exp() * noise
    # log(1 - tanh^2 u) = 2 (log 2 - u - softplus(-2 u)), which does not underflow
    shrink = 2.0 * (math.log(2.0) - before - softplus(-2.0 * before))
    density = -0.5 * noise**2 - log_deviation - 0.5 * math.log(2.0 * math.pi) - shrink
    return torch.tanh(before), density.sum(-1)
