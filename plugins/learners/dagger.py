"""Imitation of the scripted policy in the states that the learner itself reaches (DAgger)."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.learn.batched import vector
from seals.learn.learner import MOST, Spaces, need_torch
from seals.learn.network_agent import settled
from seals.plugins.learners.bc import CloningAgent
from seals.schema import count, setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult

CHOSEN = "chosen"


@dataclass(kw_only=True)
class Dagger:
    """Behaviour cloning of an expert that is queried at every step (DAgger).

    Equation:
        loss = mean over numbers of (tanh f(s) - a*)^2 over the states s that learner and expert
        have met, a* what the scripted policy of the task does in them

    The expert acts in all environments at first, and in a share of them for good; the learner acts
    in the others. The policy that is kept has the mean weights of the last updates.

    Args:
        hidden: widths of the hidden layers.
        learning_rate: of Adam [1].
        weight_decay: of Adam [1].
        batch: steps in an update.
        ratio: updates after a control step of all environments.
        capacity: steps that are remembered; the oldest are forgotten.
        led: control steps of every environment in which the expert acts alone at first.
        share: of the environments in which the expert acts for good [1].
        mean: share of the mean weights that an update keeps [1].
        settle: control steps over which the learning rate falls to a tenth; 0 for never.

    Assumptions:
        The task has a scripted policy; it reads the full state, the learner the observation.

    References:
        Ross, Gordon and Bagnell 2011, arXiv 1011.0686.
    """

    hidden: list[int] = field(default_factory=lambda: [256, 256, 256])
    learning_rate: float = setting(1e-3, "1", bounds=(0.0, 1.0), source=CHOSEN)
    weight_decay: float = setting(1e-3, "1", bounds=(0.0, 1.0), source=CHOSEN)
    batch: int = count(8192, bounds=(1, MOST))
    ratio: int = count(8, bounds=(1, MOST))
    capacity: int = count(3_000_000, bounds=(1, MOST))
    led: int = count(200, bounds=(1, MOST))
    share: float = setting(0.2, "1", bounds=(0.0, 1.0), source=CHOSEN)
    mean: float = setting(0.998, "1", bounds=(0.0, 1.0), source=CHOSEN)
    settle: int = count(0, bounds=(0, MOST))

    def start(self, spaces: Spaces, *, device: str, seed: int) -> DaggerAgent:
        """Return a fresh agent."""
        need_torch()
        return DaggerAgent(self, spaces, device, seed)


class DaggerAgent(CloningAgent):
    """Agent that imitates the scripted policy; see `seals.learn.learner.Advised`."""

    parts = ("body", "averaged", "optimiser", "norm", "generator")
    plain = ("stored", "steps", "owed", "advice")
    reports = ("loss", "remembered")

    def __init__(self, learner: Dagger, spaces: Spaces, device: str, seed: int) -> None:
        import torch

        super().__init__(learner, spaces, device, seed)
        size, actions = spaces.observation_size, spaces.action_size
        self.averaged = copy.deepcopy(self.body)
        rounds = max(1, learner.capacity // spaces.count)
        self.memory = {
            "observation": torch.zeros(rounds, spaces.count, size, device=device),
            "action": torch.zeros(rounds, spaces.count, actions, device=device),
        }
        self.stored = self.steps = self.owed = 0
        self.advice: Any = None

    def state(self) -> dict[str, Any]:
        """Return the complete state; of the memory the part that is filled."""
        kept = {key: rows[: self.stored].clone() for key, rows in self.memory.items()}
        return {**super().state(), "rows": kept}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore what `state` returned.

        Raises:
            ValueError: the memory is of another size than this one can have.
        """
        super().load(state)
        for key, rows in self.memory.items():
            kept = state["rows"][key]
            if len(kept) != self.stored or kept.shape[1:] != rows.shape[1:]:
                raise ValueError(f"the memory holds {list(kept.shape)} numbers of {key}")
            rows[: self.stored] = kept

    def advise(self, action: Tensor) -> None:
        """Receive what the expert would do in the present states, shape (N, a)."""
        self.advice = action.to(self.device).clamp(-1.0, 1.0)

    def act(self, observation: Any, *, explore: bool) -> Tensor:
        """Return the actions of the learner; in exploration the expert's in some environments."""
        import torch

        with torch.no_grad():
            body = self.body if explore else self.averaged
            own = self.action_of(body, vector(observation))
            if not explore or self.advice is None:
                return own
            if self.steps < self.learner.led:
                return self.advice.clone()
            led = int(self.learner.share * len(own))
            own[:led] = self.advice[:led]
            return own

    def observe(self, observation: Any, action: Tensor, result: StepResult) -> None:
        """Remember the states and what the expert would have done in them."""
        seen = vector(observation)
        row = self.steps % len(self.memory["action"])
        self.memory["observation"][row] = seen
        self.memory["action"][row] = action if self.advice is None else self.advice
        self.norm.update(seen)
        self.steps += 1
        self.stored = min(self.steps, len(self.memory["action"]))
        self.owed += self.learner.ratio

    def due(self) -> int:
        """Return the number of updates that the last steps allow."""
        return self.owed

    def update(self) -> dict[str, Tensor]:
        """Run one gradient step."""
        import torch

        self.owed -= 1
        if self.learner.settle:
            share = settled(self.steps * self.spaces.count, self.learner.settle)
            for group in self.optimiser.param_groups:
                group["lr"] = self.learner.learning_rate * share
        remembered = self.stored * self.spaces.count
        index = torch.randint(
            remembered, (self.learner.batch,), generator=self.generator, device=self.device
        )
        rows = {key: value.flatten(0, 1)[index] for key, value in self.memory.items()}
        loss = (self.action_of(self.body, rows["observation"]) - rows["action"]).square().mean()
        self.fit(loss)
        with torch.no_grad():
            for kept, new in zip(self.averaged.parameters(), self.body.parameters(), strict=True):
                kept.lerp_(new, 1.0 - self.learner.mean)
        return {"loss": loss.detach(), "remembered": torch.tensor(float(remembered))}

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the policy with the mean weights."""
        return self.policy_with(self.averaged)
