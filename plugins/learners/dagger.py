"""Imitation of the scripted policy in the states that the learner itself reaches (DAgger)."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.field_roles import roles
from seals.learn.batched import vector
from seals.learn.learner import MOST, Spaces, need_torch
from seals.learn.network_agent import settled
from seals.plugins.learners.bc import CloningAgent
from seals.schema import count, setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult

CHOSEN = "chosen"


@roles(data="use_pixels")
@dataclass(kw_only=True)
class Dagger:
    """Behaviour cloning of an expert that is queried at every step (DAgger).

    Equation:
        loss = mean over numbers of (tanh f(s) - a*)^2 over the states s that learner and expert
        have met, a* what the scripted policy of the task does in them

    The expert acts in all environments at first, and in a share of them afterwards; the learner
    acts in the others. With ``turn`` it is drawn anew from time to time who acts in an environment:
    then the learner also meets the later phases of a task whose first one it cannot do yet. Where
    the environment has cameras, the policy sees their pictures beside its numbers. The policy that
    is kept has the mean weights of the last updates.

    Args:
        hidden: widths of the hidden layers.
        learning_rate: of Adam [1].
        weight_decay: of Adam [1].
        batch: steps in an update.
        ratio: updates after a control step of all environments.
        capacity: steps that are remembered; the oldest are forgotten.
        led: control steps of every environment in which the expert acts alone at first.
        share: of the environments in which the expert acts afterwards [1].
        turn: control steps, in the mean, until it is drawn anew who acts in an environment, the
            expert with the probability ``share``; 0 for never.
        mean: share of the mean weights that an update keeps [1].
        settle: control steps over which the learning rate falls to a tenth; 0 for never.
        use_pixels: whether pictures are looked at where there are any.
        channels: of each convolution.
        strides: of the convolutions, 3 x 3 pixels each.
        features: numbers that a picture becomes, by the places where its maps respond.

    Assumptions:
        The task has a scripted policy; it reads the full state, the learner the observation.

    Limitations:
        With pictures the memory holds each of them: ``capacity`` times 25 kB at 64 x 64 x 6.

    References:
        Ross, Gordon and Bagnell 2011, arXiv 1011.0686; Levine et al. 2016, arXiv 1504.00702
        (places).
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
    turn: int = count(0, bounds=(0, MOST))
    settle: int = count(0, bounds=(0, MOST))
    use_pixels: bool = True
    channels: int = count(32, bounds=(1, 4096))
    strides: list[int] = field(default_factory=lambda: [2, 2, 1, 1])
    features: int = count(64, bounds=(1, 65_536))

    def start(self, spaces: Spaces, *, device: str, seed: int) -> DaggerAgent:
        """Return a fresh agent."""
        need_torch()
        return DaggerAgent(self, spaces, device, seed)


class DaggerAgent(CloningAgent):
    """Agent that imitates the scripted policy; see `seals.learn.learner.Advised`."""

    parts = ("body", "averaged", "encoder", "eyes", "optimiser", "norm", "generator")
    plain = ("stored", "steps", "owed", "advice", "led")
    reports = ("loss", "remembered")

    def __init__(self, learner: Dagger, spaces: Spaces, device: str, seed: int) -> None:
        import torch

        seen = learner.use_pixels and spaces.pixels is not None
        self._pixels = _encoder_options(learner, spaces) if seen else None
        super().__init__(learner, spaces, device, seed, pixels=self._pixels)
        self.averaged, self.eyes = copy.deepcopy(self.body), copy.deepcopy(self.encoder)
        rounds = max(1, learner.capacity // spaces.count)
        shapes = {"observation": (spaces.observation_size,), "action": (spaces.action_size,)}
        self.memory = {
            key: torch.zeros(rounds, spaces.count, *shape, device=device)
            for key, shape in shapes.items()
        }
        if self._pixels is not None:
            self.memory["pixels"] = torch.zeros(
                rounds, spaces.count, *self._pixels["shape"], dtype=torch.uint8, device=device
            )
        self.stored = self.steps = self.owed = 0
        self.advice: Any = None
        # environments in which the expert acts
        first = int(learner.share * spaces.count)
        self.led = torch.arange(spaces.count, device=device) < first

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
            nets = (self.body, self.encoder) if explore else (self.averaged, self.eyes)
            own = self.action_of(nets[0], self._given(observation), encoder=nets[1])
            if not explore or self.advice is None:
                return own
            if self.steps < self.learner.led:
                return self.advice.clone()
            return torch.where(self.led[:, None], self.advice, own)

    def _given(self, observation: Any) -> Any:
        """Return what the networks look at of an observation."""
        return vector(observation) if self._pixels is None else observation

    def observe(self, observation: Any, action: Tensor, result: StepResult) -> None:
        """Remember the states and what the expert would have done in them."""
        seen = vector(observation)
        row = self.steps % len(self.memory["action"])
        self.memory["observation"][row] = seen
        self.memory["action"][row] = action if self.advice is None else self.advice
        if self._pixels is not None:
            self.memory["pixels"][row] = observation["pixels"]
        self.norm.update(seen)
        self._take_turns()
        self.steps += 1
        self.stored = min(self.steps, len(self.memory["action"]))
        self.owed += self.learner.ratio

    def _take_turns(self) -> None:
        """Draw anew who acts in some environments."""
        import torch

        if not self.learner.turn:
            return
        chance = torch.rand(2, len(self.led), generator=self.generator, device=self.device)
        anew = chance[0] * self.learner.turn < 1.0
        self.led = torch.where(anew, chance[1] < self.learner.share, self.led)

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
        seen = {"state": rows["observation"], **rows}
        found = self.action_of(self.body, self._given(seen), encoder=self.encoder)
        loss = (found - rows["action"]).square().mean()
        self.fit(loss)
        pairs: list[tuple[Any, Any]] = [(self.averaged, self.body)]
        pairs += [(self.eyes, self.encoder)] if self.encoder is not None else []
        with torch.no_grad():
            for slow, fast in pairs:
                for kept, new in zip(slow.parameters(), fast.parameters(), strict=True):
                    kept.lerp_(new, 1.0 - self.learner.mean)
        return {"loss": loss.detach(), "remembered": torch.tensor(float(remembered))}

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the policy with the mean weights."""
        described = {} if self._pixels is None else {"pixels": self._pixels}
        return self.policy_with(self.averaged, encoder=self.eyes, **described)


def _encoder_options(learner: Dagger, spaces: Spaces) -> dict[str, Any]:
    """Return what `seals.learn.networks.encoder_of` takes."""
    return {
        "shape": [int(size) for size in spaces.pixels or ()],
        "channels": learner.channels,
        "strides": [int(stride) for stride in learner.strides],
        "pool": "places",
        "features": learner.features,
        "use_pixels": True,
        "use_state": True,
    }
