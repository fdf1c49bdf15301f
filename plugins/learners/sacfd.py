"""Soft actor-critic from demonstrations: prioritised replay, n-step returns, pretraining."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from seals.learn.learner import Spaces, need_torch, whole
from seals.learn.replay.returns import Returns
from seals.learn.replay.samplers import Prioritised
from seals.plugins.learners.sac import SAC, SacAgent
from seals.schema import setting

if TYPE_CHECKING:
    from torch import Tensor

GIVEN = "Vecerik et al. 2017, arXiv 1707.08817"
PRIORITY = "Schaul et al. 2016, arXiv 1511.05952"


@dataclass(kw_only=True)
class SACfD(SAC):
    """Soft actor-critic pretrained on demonstrations, sampled more often than its own steps.

    Equation:
        critics: w ((Q - y_1)^2 + mix (Q - y_n)^2) / (1 + mix)
        priority: (|Q - y| / running mean + epsilon + bonus if demonstrated)^alpha

    Demonstrations are never overwritten. `pretrain` updates are made on them alone before the first
    step. Errors are measured in units of their running mean, so the bonus means the same under any
    scale of reward.

    Args:
        alpha: how much priority counts, 0 for not at all [1].
        beta: correction for it at first; it rises to 1 [1].
        anneal: updates over which it rises.
        epsilon: least priority, in units of the mean error [1].
        bonus: of demonstrations, in units of the mean error [1].
        mix: weight of the return over ``steps`` steps beside that over one [1].
        pretrain: updates on demonstrations before the first step.

    Limitations:
        The published form adds the actor's gradient to the priority; here it is the critics' error
        alone. The temperature is learned in pretraining, too.

    References:
        Vecerik et al. 2017, arXiv 1707.08817; Schaul et al. 2016, arXiv 1511.05952.
    """

    demonstrations: str = "buffer"
    steps: int = 3
    alpha: float = setting(0.6, "1", bounds=(0.0, 1.0), source=f"{PRIORITY}, table 3")
    beta: float = setting(0.4, "1", bounds=(0.0, 1.0), source=f"{PRIORITY}, table 3")
    anneal: int = 25_000
    epsilon: float = setting(1e-3, "1", bounds=(0.0, 10.0), source=f"{GIVEN}, section 4")
    bonus: float = setting(1.0, "1", bounds=(0.0, 100.0), source="chosen")
    mix: float = setting(1.0, "1", bounds=(0.0, 10.0), source=f"{GIVEN}, section 4")
    pretrain: int = 1000

    def __post_init__(self) -> None:
        """Refuse sizes out of range and unknown words."""
        super().__post_init__()
        whole(anneal=(self.anneal, 1), pretrain=(self.pretrain, 0))

    def start(self, spaces: Spaces, *, device: str, seed: int) -> SacfdAgent:
        """Return a fresh agent."""
        need_torch()
        sampler = Prioritised(
            alpha=self.alpha,
            beta=self.beta,
            anneal=self.anneal,
            epsilon=self.epsilon,
            bonus=self.bonus,
        )
        wants = "no" if self.demonstrations == "none" else "must"
        return SacfdAgent(self, spaces, device, seed, sampler=sampler, wants=wants)


class SacfdAgent(SacAgent):
    """Agent of SACfD: pretraining, and one-step and n-step returns."""

    learner: SACfD

    def _fresh_returns(self) -> Returns:
        both = self.learner.steps > 1
        return Returns(length=self.learner.steps, gamma=self.learner.gamma, both=both)

    def due(self) -> int:
        """Return the number of updates due: pretraining first, then by the configured ratio."""
        wanted = self.learner.pretrain if self.memory.protected else 0
        if self.updates < wanted:
            return wanted - self.updates
        return self._updates_earned() - (self.updates - wanted)

    def _td_targets(self, batch: Any) -> list[tuple[float, Tensor]]:
        if self.learner.steps == 1:
            return super()._td_targets(batch)
        step = batch["step_reward"], batch["step_discount"], batch["step_next_observation"]
        many = batch["reward"], batch["discount"], batch["next_observation"]
        mix = self.learner.mix
        found = [(1.0 / (1.0 + mix), self._td_target(*step))]
        return [*found, (mix / (1.0 + mix), self._td_target(*many))] if mix > 0.0 else found
