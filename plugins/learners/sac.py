"""Soft actor-critic: off-policy, with a temperature that is learned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.learn import networks
from seals.learn.actor_critic import ActorCriticNetworks
from seals.learn.learner import Spaces, need_torch, one_of, whole
from seals.learn.observations import tensors, vector
from seals.learn.recorded import Recorded
from seals.learn.replay.memory import Memory
from seals.learn.replay.returns import Returns, of_episodes
from seals.learn.replay.samplers import Sampler
from seals.learn.scaling import FORMS, RunningNormaliser, transform_reward
from seals.learn.seeding import first_weights, generator_of
from seals.learn.stateful import Stateful
from seals.learn.tanh_normal import TanhNormal
from seals.schema import count, setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


PAPER = "Haarnoja et al. 2018, arXiv 1812.05905"
SHOWN = ("none", "buffer")
SETTLED = 0.1
"""Share of the learning rate that is left when a learner has settled."""


@dataclass(kw_only=True)
class SAC:
    """Soft actor-critic with two critics and a learned temperature.

    Equation:
        y = r + gamma^m (min_k Q'_k(s', a') - alpha log pi(a'|s')),  a' ~ pi(s')
        critics: (Q_k(s, a) - y)^2;  actor: alpha log pi(a|s) - min_k Q_k(s, a)
        temperature: -log alpha (log pi(a|s) + wanted entropy)

    Args:
        hidden: widths of the hidden layers.
        layer_norm: whether the critics' hidden layers are normalised.
        critics: number of critics.
        learning_rate: of critics, actor and temperature [1].
        gamma: discount of one control step [1].
        tau: share of the critics that goes into their slow copies at each update [1].
        batch: transitions in an update.
        capacity: transitions of experience kept.
        random_steps: control steps with random actions at first.
        ratio: updates per control step [1].
        temperature: at first [1].
        entropy: wanted entropy for each number of an action [1].
        settle: control steps over which the learning rate falls to a tenth; 0 for never.
        steps: most steps of a transition; more than one drops the entropy in between.
        demonstrations: ``none``, or ``buffer``: they lie in the memory and are drawn like the rest.
        reward_scale: multiplies the reward [1].
        reward_form: ``plain``, ``symlog`` or ``clip``.
        normalise: whether observations are brought to mean 0 and deviation 1 as they come.

    References:
        Haarnoja et al. 2018, arXiv 1812.05905.
    """

    hidden: list[int] = field(default_factory=lambda: [128, 128])
    layer_norm: bool = False
    critics: int = count(2, bounds=(1, 100))
    learning_rate: float = setting(3e-4, "1", bounds=(0.0, 1.0), source=f"{PAPER}, table 1")
    gamma: float = setting(0.99, "1", bounds=(0.0, 1.0), source=f"{PAPER}, table 1")
    tau: float = setting(0.005, "1", bounds=(0.0, 1.0), source=f"{PAPER}, table 1")
    batch: int = 256
    capacity: int = 100_000
    random_steps: int = 1000
    ratio: float = setting(0.5, "1", bounds=(0.0, 64.0), source="chosen: one CPU core")
    temperature: float = setting(0.1, "1", bounds=(1e-6, 100.0), source="chosen")
    entropy: float = setting(-1.0, "1", bounds=(-10.0, 1.0), source=f"{PAPER}, section 5")
    settle: int = 0
    steps: int = 1
    demonstrations: str = "none"
    reward_scale: float = setting(1.0, "1", bounds=(1e-9, 1e9), source="chosen")
    reward_form: str = "plain"
    normalise: bool = True

    def __post_init__(self) -> None:
        """Refuse sizes out of range and unknown words."""
        whole(
            critics=(self.critics, 1),
            batch=(self.batch, 1),
            capacity=(self.capacity, 1),
            random_steps=(self.random_steps, 0),
            settle=(self.settle, 0),
            steps=(self.steps, 1),
        )
        one_of("reward_form", self.reward_form, FORMS)
        one_of("demonstrations", self.demonstrations, SHOWN)

    def start(self, spaces: Spaces, *, device: str, seed: int) -> SacAgent:
        """Return a fresh agent."""
        need_torch()
        wants = "no" if self.demonstrations == "none" else "must"
        return SacAgent(self, spaces, device, seed, sampler=Sampler(), wants=wants)


class SacAgent(Stateful):
    """Agent of soft actor-critic; subclasses change inputs, sampling and targets.

    Args:
        learner: the hyper-parameters.
        spaces: sizes of observation and action.
        device: of networks and memory.
        seed: of the first weights and of all draws.
        sampler: which transitions a batch is made of.
        wants: demonstrations: ``no``, ``may`` or ``must``.
    """

    parts = ("nets", "memory", "returns", "norm", "generator")
    plain = ("steps", "updates")
    interactive = True
    encoder_loss = "critics"
    """Loss that updates the image encoder."""
    reports = (
        "critic_loss",
        "actor_loss",
        "temperature",
        "entropy",
        "value",
        "demonstration_share",
    )

    def __init__(
        self, learner: SAC, spaces: Spaces, device: str, seed: int, *, sampler: Any, wants: str
    ) -> None:
        """Make networks, optimisers and an empty memory."""
        self.learner, self.spaces, self.device, self.wants = learner, spaces, device, wants
        self.generator = generator_of(seed, device)
        self.memory = Memory(
            capacity=learner.capacity, sampler=sampler, device=device, generator=self.generator
        )
        self.returns = self._fresh_returns()
        self.steps = self.updates = 0
        self._recorded: Recorded | None = None
        self.norm = (
            RunningNormaliser(spaces.observation_size, device) if learner.normalise else None
        )
        with first_weights(seed):
            self.encoder = self._encoder()
            self.nets = ActorCriticNetworks(
                features=self._features(),
                actions=spaces.action_size,
                hidden=learner.hidden,
                layer_norm=learner.layer_norm,
                critics=learner.critics,
                learning_rate=learner.learning_rate,
                temperature=learner.temperature,
                encoder=self.encoder,
                device=device,
                critic_features=self._critic_input_size(),
                encoder_loss=self.encoder_loss,
            )

    # what relatives change

    def _fresh_returns(self) -> Returns:
        return Returns(length=self.learner.steps, gamma=self.learner.gamma)

    def _encoder(self) -> Any:
        """Return the image encoder; None, as this agent takes no images."""

    def _features(self) -> int:
        """Return the size of the actor's input."""
        return self.spaces.observation_size

    def _critic_input_size(self) -> int | None:
        """Return the size of the critics' input besides the action; None for the actor's."""

    def _actor_inputs(self, observation: Any, *, shift: bool = False) -> Tensor:
        """Return the actor's inputs; ``shift`` applies random shifts to images."""
        norm = None if self.norm is None else self.norm.layer
        return networks.network_inputs(observation, norm=norm, encoder=None)

    def _critic_inputs(self, observation: Any, seen: Tensor) -> Tensor:
        """Return the critics' inputs besides the action: those of the actor."""
        return seen

    def _recordable(self) -> bool:
        """Return True if an update can be recorded as a CUDA graph."""
        return True

    def _pessimistic_value(self, values: Tensor) -> Tensor:
        """Return the pessimistic value (batch,) of all target critics' values (k, batch)."""
        return values.min(0).values

    def _td_targets(self, batch: Any) -> list[tuple[float, Tensor]]:
        """Return the targets (batch,) of the critics, each with its share of the loss."""
        return [
            (1.0, self._td_target(batch["reward"], batch["discount"], batch["next_observation"]))
        ]

    # acting and remembering

    def act(self, observation: Any, *, explore: bool) -> Tensor:
        """Return random actions at first, then those of the policy."""
        import torch

        shape = (self.spaces.count, self.spaces.action_size)
        with torch.no_grad():
            if explore and self.steps < self.learner.random_steps:
                return torch.rand(shape, generator=self.generator, device=self.device) * 2.0 - 1.0
            output = self.nets.actor(self._actor_inputs(observation))
            if explore:
                return TanhNormal(output).sample(self.generator)[0]
            return TanhNormal(output).mode

    def observe(self, observation: Any, action: Tensor, result: StepResult) -> None:
        """Store one step of all environments in the replay buffer."""
        self.steps += action.shape[0]
        if self.norm is not None:
            self.norm.update(vector(observation))
        columns = self.returns.push(
            observation,
            action,
            reward=self._formed(result.reward),
            terminated=result.terminated,
            truncated=result.truncated,
            final=result.final,
        )
        if columns is not None:
            self.memory.add(columns)

    def add_demonstrations(self, columns: Mapping[str, Any]) -> None:
        """Add demonstrations to the protected part of the replay buffer."""
        given = tensors(columns, self.device)
        given["reward"] = self._formed(given["reward"].float())
        if self.norm is not None:
            self.norm.update(vector(given["observation"]))
        self.memory.protect(of_episodes(given, self._fresh_returns()))

    def _formed(self, reward: Tensor) -> Tensor:
        return transform_reward(
            reward, scale=self.learner.reward_scale, form=self.learner.reward_form
        )

    # learning

    def due(self) -> int:
        """Return the number of updates due at the configured ratio of updates to steps."""
        return self._updates_earned() - self.updates

    def _updates_earned(self) -> int:
        if self.memory.experience <= 0:
            return 0
        return int(self.learner.ratio * max(0, self.steps - self.learner.random_steps))

    def update(self) -> dict[str, Tensor]:
        """Update critics, actor and temperature on one batch."""
        if self.learner.settle:
            self.nets.set_learning_rate(self._learning_rate())
        batch = self.memory.sample(self.learner.batch)
        metrics = self._update_recorded(batch)
        self.memory.update_priorities(batch, metrics.pop("error"))
        self.updates += 1
        return {**metrics, "demonstration_share": self.memory.share(batch)}

    def _update_recorded(self, batch: Any) -> dict[str, Tensor]:
        """Update on a batch, on an accelerator by a CUDA graph of the first update."""
        if self.device == "cpu" or not self._recordable():
            return self._update_networks(batch)
        given = dict(batch.items())
        if self._recorded is None:
            before = [tensor.detach().clone() for tensor in self.nets.updated_tensors()]
            self._recorded = Recorded(
                lambda state, rows: (state, self._update_networks(rows)), (), given, self.generator
            )
            # what was improved while it was recorded does not count
            self.nets.restore_tensors(before)
        metrics: dict[str, Tensor] = self._recorded(given)
        return metrics

    def _update_networks(self, batch: Any) -> dict[str, Tensor]:
        seen = self._actor_inputs(batch["observation"], shift=True)
        known = self._critic_inputs(batch["observation"], seen)
        critic_loss, value, error = self._update_critics(batch, known)
        actor_loss, log_prob = self._update_actor(seen, known.detach())
        self.nets.polyak_update(self.learner.tau)
        return {
            "critic_loss": critic_loss,
            "actor_loss": actor_loss,
            "temperature": self.nets.alpha,
            "entropy": -log_prob,
            "value": value,
            "error": error,
        }

    def _learning_rate(self) -> float:
        """Return the current learning rate."""
        share = max(SETTLED, 1.0 - self.steps / self.learner.settle)
        return self.learner.learning_rate * share

    def _update_critics(self, batch: Any, known: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        import torch

        values = self.nets.values(known, batch["action"])
        weight = batch.get("weight", None)
        loss, error = torch.zeros((), device=self.device), torch.zeros((), device=self.device)
        for share, aim in self._td_targets(batch):
            gap = values - aim
            squares = gap.square() if weight is None else weight * gap.square()
            loss = loss + share * squares.mean(-1).sum()
            error = error + share * gap.detach().abs().mean(0)
        self.nets.step("critics", loss)
        return loss.detach(), values.detach().mean(), error

    def _td_target(self, reward: Tensor, discount: Tensor, next_observation: Any) -> Tensor:
        import torch

        with torch.no_grad():
            seen = self._actor_inputs(next_observation, shift=True)
            action, log_prob = TanhNormal(self.nets.actor(seen)).sample(self.generator)
            known = self._critic_inputs(next_observation, seen)
            later = self._pessimistic_value(self.nets.values(known, action, slow=True))
            return reward + discount * (later - self.nets.alpha * log_prob)

    def _update_actor(self, seen: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        # where the encoder learns with the critics, it has just done so
        own = seen if self.encoder_loss == "actor" else seen.detach()
        action, log_prob = TanhNormal(self.nets.actor(own)).sample(self.generator)
        value = self.nets.values(known, action).min(0).values
        loss = (self.nets.alpha * log_prob - value).mean()
        self.nets.step("actor", loss)
        wanted = self.learner.entropy * self.spaces.action_size
        self.nets.step("alpha", -self.nets.log_alpha * (log_prob.detach().mean() + wanted))
        return loss.detach(), log_prob.detach().mean()

    # keeping

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the policy's mean, mapped to -1 to 1 by tanh."""
        norm = None if self.norm is None else self.norm.layer
        return networks.policy_of(
            self._description(), body=self.nets.actor, norm=norm, encoder=self.encoder
        )

    def _description(self) -> dict[str, Any]:
        return networks.description(
            observation=self.spaces.observation_size,
            action=self.spaces.action_size,
            hidden=self.learner.hidden,
            normalise=self.learner.normalise,
        )
