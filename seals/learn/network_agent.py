"""What agents on networks share: normalised observations, reward transforms, their policy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from seals.learn import networks
from seals.learn.learner import Spaces
from seals.learn.starts import generator_of
from seals.learn.stateful import Stateful

if TYPE_CHECKING:
    from torch import Tensor

FORMS = ("plain", "symlog", "clip")
"""Forms of a reward: as it is, the logarithm of its size, or cut off at -1 and 1."""

PRIOR = 0.01
"""Observations that mean 0 and variance 1 count for before the first real one."""
SETTLED = 0.1
"""Share of the learning rate that is left when a learner has settled."""


def settled(steps: int, settle: int) -> float:
    """Return the share of the learning rate after some of the control steps over which it falls.

    Example:
        >>> settled(30, 60), settled(90, 60)
        (0.5, 0.1)
    """
    return max(SETTLED, 1.0 - steps / settle)


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
        self.layer: Any = networks.normaliser_of(size).to(device)
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


class NetworkAgent(Stateful):
    """Agent on networks: its random numbers, its inputs, and the policy that it hands over.

    Args:
        learner: the hyper-parameters, ``hidden`` among them.
        spaces: sizes of observation and action.
        device: of networks and memory.
        seed: of the first weights and of all draws.
        normalise: whether observations are brought to mean 0 and deviation 1.
    """

    interactive = True
    wants = "no"

    def __init__(
        self, learner: Any, spaces: Spaces, device: str, seed: int, *, normalise: bool = True
    ) -> None:
        self.learner, self.spaces, self.device = learner, spaces, device
        self.generator = generator_of(seed, device)
        self.norm: Any = RunningNormaliser(spaces.observation_size, device) if normalise else None

    def add_demonstrations(self, columns: Mapping[str, Any]) -> None:
        """Ignore demonstrations, unless a learner says otherwise."""

    def inputs(self, observation: Any, **options: Any) -> Tensor:
        """Return the inputs of dense layers; for options see `seals.learn.networks`."""
        given = {"encoder": None, **options}
        return networks.network_inputs(observation, norm=self._layer, **given)

    def policy_with(
        self, body: Any, *, encoder: Any = None, **described: Any
    ) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the policy of dense layers and an encoder: its description and its tensors."""
        network = networks.description(
            observation=self.spaces.observation_size,
            action=self.spaces.action_size,
            hidden=self.learner.hidden,
            normalise=self.norm is not None,
            **described,
        )
        return networks.policy_of(network, body=body, norm=self._layer, encoder=encoder)

    @property
    def _layer(self) -> Any:
        return None if self.norm is None else self.norm.layer
