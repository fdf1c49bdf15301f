"""RLPD: soft actor-critic with prior data, half of every batch from demonstrations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from seals.errors import ConfigError
from seals.learn.learner import Spaces, need_torch, whole
from seals.learn.replay.samplers import Sampler
from seals.plugins.learners.sac import SAC, SacAgent
from seals.schema import setting

if TYPE_CHECKING:
    from torch import Tensor

PRIOR = "Ball et al. 2023, arXiv 2302.02948"


@dataclass(kw_only=True)
class RLPD(SAC):
    """Soft actor-critic whose batches are half demonstrations, without pretraining.

    The paper takes ten critics and twenty updates a step; two critics and the update ratio of the
    other learners fit one core of a CPU, and make the comparison one of equal work.

    Args:
        share: of a batch that comes from demonstrations [1].
        subset: critics, drawn anew for each update, of which the lowest is the target.

    References:
        Ball et al. 2023, arXiv 2302.02948 (ICML).
    """

    demonstrations: str = "buffer"
    layer_norm: bool = True
    share: float = setting(0.5, "1", bounds=(0.0, 1.0), source=f"{PRIOR}, section 4.1")
    subset: int = 2

    def __post_init__(self) -> None:
        """Refuse sizes out of range and unknown words."""
        super().__post_init__()
        whole(subset=(self.subset, 1))
        if self.subset > self.critics:
            raise ConfigError(
                f"learner.subset={self.subset} is more than learner.critics={self.critics}.\n"
                f"Allowed: from 1 to {self.critics}."
            )

    def start(self, spaces: Spaces, *, device: str, seed: int) -> RlpdAgent:
        """Return a fresh agent."""
        need_torch()
        sampler = Sampler(share=self.share)
        wants = "no" if self.demonstrations == "none" else "must"
        return RlpdAgent(self, spaces, device, seed, sampler=sampler, wants=wants)


class RlpdAgent(SacAgent):
    """Agent of RLPD: target values from a random subset of the critics."""

    learner: RLPD

    def _recordable(self) -> bool:
        return super()._recordable() and self.learner.subset == self.learner.critics

    def _pessimistic_value(self, values: Tensor) -> Tensor:
        import torch

        if self.learner.subset < self.learner.critics:
            order = torch.randperm(
                self.learner.critics, generator=self.generator, device=self.device
            )
            values = values[order[: self.learner.subset]]
        return values.min(0).values
