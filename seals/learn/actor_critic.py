"""Actor, critics, target critics and temperature of a soft actor-critic.

Actions are normally distributed and squashed into [-1, 1] by tanh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from seals.learn import networks
from seals.learn.stateful import Stateful

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


class ActorCriticNetworks(Stateful):
    """Actor, critics, target critics and temperature, each with its optimiser.

    Make it inside `seals.learn.starts.first_weights`.

    Args:
        features: numbers that the actor takes.
        actions: numbers in an action.
        hidden: widths of the hidden layers.
        layer_norm: whether those of the critics are normalised.
        critics: number of critics.
        learning_rate: of Adam, for all of them.
        temperature: at first.
        encoders: layers of a picture by the loss that they learn from, ``"critics"`` or
            ``"actor"``; those of the critics have a slow copy, as the critics have.
        device: where all of it lies.
        critic_features: numbers that the critics take beside an action, None for those of the
            actor.
    """

    parts = ("modules", "optimisers", "log_alpha")

    def __init__(
        self,
        *,
        features: int,
        actions: int,
        hidden: Sequence[int],
        layer_norm: bool,
        critics: int,
        learning_rate: float,
        temperature: float,
        encoders: Mapping[str, Any],
        device: str,
        critic_features: int | None = None,
    ) -> None:
        """Draw the first weights; slow critics begin as copies."""
        import copy

        import torch

        def values() -> Any:
            taken = (features if critic_features is None else critic_features) + actions
            each = [networks.mlp(taken, 1, hidden, layer_norm=layer_norm) for _ in range(critics)]
            return torch.nn.ModuleList(each).to(device)

        self.actor = networks.mlp(features, 2 * actions, hidden).to(device)
        self.critics, self.slow = values(), values()
        self.slow.load_state_dict(self.critics.state_dict())
        self.slow.requires_grad_(False)
        self.log_alpha = torch.tensor(temperature, device=device).log().requires_grad_()
        self.modules = {"actor": self.actor, "critics": self.critics, "slow": self.slow}
        self.modules |= {f"{name}_encoder": encoder for name, encoder in encoders.items()}
        self.slow_encoder = None
        if "critics" in encoders:
            self.slow_encoder = copy.deepcopy(encoders["critics"]).requires_grad_(False)
            self.modules["slow_encoder"] = self.slow_encoder
        self._learned: dict[str, list[Tensor]] = {
            "critics": list(self.critics.parameters()),
            "actor": list(self.actor.parameters()),
            "alpha": [self.log_alpha],
        }
        for name, encoder in encoders.items():
            self._learned[name] += encoder.parameters()
        # in the same order: the slow copies follow one by one
        self._fast = list(self._learned["critics"])
        self._slow = list(self.slow.parameters())
        self._slow += [] if self.slow_encoder is None else self.slow_encoder.parameters()
        # what is recorded on an accelerator reads its learning rate there
        there = torch.device(device).type != "cpu"
        self.optimisers = {
            name: torch.optim.Adam(
                learned,
                lr=torch.tensor(learning_rate, device=device) if there else learning_rate,
                fused=True,
                capturable=there,
            )
            for name, learned in self._learned.items()
        }

    @property
    def alpha(self) -> Tensor:
        """Return the temperature, without gradient."""
        return self.log_alpha.detach().exp()

    def values(self, seen: Tensor, action: Tensor, *, slow: bool = False) -> Tensor:
        """Return the values of an action by each critic, shape (critics, batch)."""
        import torch

        both = torch.cat([seen, action], -1)
        critics = self.slow if slow else self.critics
        return torch.stack([critic(both).squeeze(-1) for critic in critics])

    def step(self, name: str, loss: Tensor) -> None:
        """Take one gradient step of ``critics``, ``actor`` or ``alpha`` alone."""
        optimiser = self.optimisers[name]
        optimiser.zero_grad(set_to_none=True)
        # the actor's loss goes through the critics, whose own slopes would be work for nothing
        loss.backward(inputs=self._learned[name])
        optimiser.step()

    def set_learning_rate(self, learning_rate: float) -> None:
        """Set the learning rate of the steps to come."""
        for optimiser in self.optimisers.values():
            for group in optimiser.param_groups:
                if isinstance(group["lr"], float):
                    group["lr"] = learning_rate
                else:
                    group["lr"].fill_(learning_rate)

    def polyak_update(self, tau: float) -> None:
        """Update the target critics by Polyak averaging with the share ``tau``."""
        import torch

        with torch.no_grad():
            torch._foreach_lerp_(self._slow, self._fast, tau)

    def updated_tensors(self) -> list[Tensor]:
        """Return all tensors that an update changes, those of the optimisers at the end."""
        found = [*self._slow, *(x for part in self._learned.values() for x in part)]
        for optimiser in self.optimisers.values():
            for kept in optimiser.state.values():
                found += (tensor for tensor in kept.values() if hasattr(tensor, "copy_"))
        return found

    def restore_tensors(self, before: Sequence[Tensor]) -> None:
        """Restore the tensors of `updated_tensors`; those made since then were zero."""
        import torch

        with torch.no_grad():
            now = self.updated_tensors()
            for tensor, earlier in zip(now, before, strict=False):
                tensor.copy_(earlier)
            for tensor in now[len(before) :]:
                tensor.zero_()
