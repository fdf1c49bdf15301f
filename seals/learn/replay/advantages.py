"""Generalised advantage estimation over a rollout of many environments."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor


def advantages(
    *,
    reward: Tensor,
    value: Tensor,
    later: Tensor,
    terminated: Tensor,
    truncated: Tensor,
    gamma: float,
    decay: float,
) -> Tensor:
    """Return the generalised advantage of each step, shape (T, N).

    Equation:
        delta_t = r_t + gamma V(s'_t) (1 - terminated_t) - V(s_t)
        A_t = delta_t + gamma decay (1 - ended_t) A_(t+1)

    Args:
        reward: of each step, (T, N).
        value: of the state before it, (T, N).
        later: of the state that it reached in the same episode, (T, N).
        terminated: whether the episode ended for good, (T, N).
        truncated: whether it was cut off, (T, N).
        gamma: discount of one step.
        decay: lambda; 0 looks one step ahead, 1 to the end.

    References:
        Schulman et al. 2016, arXiv 1506.02438, equation 16.
    """
    import torch

    delta = reward + gamma * later * (~terminated).to(reward.dtype) - value
    goes_on = (~(terminated | truncated)).to(reward.dtype)
    found = torch.zeros_like(reward)
    running = torch.zeros_like(reward[0])
    for step in range(len(reward) - 1, -1, -1):
        running = delta[step] + gamma * decay * goes_on[step] * running
        found[step] = running
    return found
