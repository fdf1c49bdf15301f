"""Soft actor-critic: off-policy, with a temperature that is learned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.field_roles import roles
from seals.learn.actor_critic import ActorCriticNetworks, TanhNormal
from seals.learn.batched import tensors, vector
from seals.learn.learner import MOST, Spaces, need_torch, one_of
from seals.learn.network_agent import FORMS, NetworkAgent, settled, transform_reward
from seals.learn.recorded import Recorded
from seals.learn.replay import STEP, Memory, Prioritised, Returns, Sampler, of_episodes
from seals.learn.starts import first_weights
from seals.schema import check_order, count, setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


PAPER = "Haarnoja et al. 2018, arXiv 1812.05905"
GIVEN = "Vecerik et al. 2017, arXiv 1707.08817"
PRIORITY = "Schaul et al. 2016, arXiv 1511.05952"
SHOWN = ("none", "buffer")


@roles(data="layer_norm demonstrations reward_form normalise")
@dataclass(kw_only=True)
class SAC:
    """Soft actor-critic with two critics and a learned temperature.

    Equation:
        y = r + gamma^m (min_k Q'_k(s', a') - alpha log pi(a'|s')),  a' ~ pi(s')
        critics: (Q_k(s, a) - y)^2;  actor: alpha log pi(a|s) - min_k Q_k(s, a)
        temperature: -log alpha (log pi(a|s) + wanted entropy)
        with one_step > 0: (one_step (Q_k - y_1)^2 + (Q_k - y_m)^2) / (1 + one_step)
        priority: (|Q - y| / running mean + epsilon + bonus if demonstrated)^alpha

    From demonstrations it is SACfD (recipe ``sacfd``: priorities, two returns, pretraining) or RLPD
    (recipe ``rlpd``: half of every batch, critics with layer normalisation). They are never
    overwritten. Losses equal those of TorchRL's ``SACLoss`` to rounding.

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
        share: of a batch that comes from demonstrations; 0 for in proportion to their number [1].
        subset: critics, drawn anew for each update, of which the lowest is the target; 0 for all.
        one_step: weight of the return over one step beside that over ``steps`` steps [1].
        pretrain: updates on demonstrations alone before the first step.
        alpha: how much priority counts in drawing, 0 for not at all [1].
        beta: correction for it at first; it rises to 1 [1].
        anneal: updates over which it rises.
        epsilon: least priority, in units of the mean error [1].
        bonus: of demonstrations, in units of the mean error [1].
        reward_scale: multiplies the reward [1].
        reward_form: ``plain``, ``symlog`` or ``clip``.
        normalise: whether observations are brought to mean 0 and deviation 1 as they come.

    Limitations:
        The published priority adds the actor's gradient; here it is the critics' error alone. The
        temperature is learned in pretraining, too.

    References:
        Haarnoja et al. 2018, arXiv 1812.05905; Vecerik et al. 2017, arXiv 1707.08817, and Schaul
        et al. 2016, arXiv 1511.05952 (demonstrations, priorities); Ball et al. 2023, arXiv
        2302.02948 (share, subset: RLPD).
    """

    hidden: list[int] = field(default_factory=lambda: [128, 128])
    layer_norm: bool = False
    critics: int = count(2, bounds=(1, 100))
    learning_rate: float = setting(3e-4, "1", bounds=(0.0, 1.0), source=f"{PAPER}, table 1")
    gamma: float = setting(0.99, "1", bounds=(0.0, 1.0), source=f"{PAPER}, table 1")
    tau: float = setting(0.005, "1", bounds=(0.0, 1.0), source=f"{PAPER}, table 1")
    batch: int = count(256, bounds=(1, MOST))
    capacity: int = count(100_000, bounds=(1, MOST))
    random_steps: int = count(1000, bounds=(0, MOST))
    ratio: float = setting(0.5, "1", bounds=(0.0, 64.0), source="chosen: one CPU core")
    temperature: float = setting(0.1, "1", bounds=(1e-6, 100.0), source="chosen")
    entropy: float = setting(-1.0, "1", bounds=(-10.0, 1.0), source=f"{PAPER}, section 5")
    settle: int = count(0, bounds=(0, MOST))
    steps: int = count(1, bounds=(1, MOST))
    demonstrations: str = "none"
    share: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen: in proportion")
    subset: int = count(0, bounds=(0, 100))
    one_step: float = setting(0.0, "1", bounds=(0.0, 10.0), source="chosen: one return")
    pretrain: int = count(0, bounds=(0, MOST))
    alpha: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen: no priorities")
    beta: float = setting(0.4, "1", bounds=(0.0, 1.0), source=f"{PRIORITY}, table 3")
    anneal: int = count(25_000, bounds=(1, MOST))
    epsilon: float = setting(1e-3, "1", bounds=(0.0, 10.0), source=f"{GIVEN}, section 4")
    bonus: float = setting(1.0, "1", bounds=(0.0, 100.0), source="chosen")
    reward_scale: float = setting(1.0, "1", bounds=(1e-9, 1e9), source="chosen")
    reward_form: str = "plain"
    normalise: bool = True

    def __post_init__(self) -> None:
        """Refuse unknown words, and more critics drawn than there are."""
        check_order(self, "subset", "critics", where="learner", equal=True)
        one_of("reward_form", self.reward_form, FORMS)
        one_of("demonstrations", self.demonstrations, SHOWN)

    def start(self, spaces: Spaces, *, device: str, seed: int) -> SacAgent:
        """Return a fresh agent."""
        need_torch()
        return SacAgent(self, spaces, device, seed)

    def sampler(self) -> Sampler:
        """Return what chooses the transitions of a batch."""
        if self.alpha == 0.0:
            return Sampler(share=self.share or None)
        return Prioritised(
            alpha=self.alpha,
            beta=self.beta,
            anneal=self.anneal,
            epsilon=self.epsilon,
            bonus=self.bonus,
        )


class SacAgent(NetworkAgent):
    """Agent of soft actor-critic; subclasses change its inputs."""

    parts = ("nets", "memory", "returns", "norm", "generator")
    plain = ("steps", "updates")
    reports = (
        "critic_loss",
        "actor_loss",
        "temperature",
        "entropy",
        "value",
        "demonstration_share",
    )

    def __init__(self, learner: SAC, spaces: Spaces, device: str, seed: int) -> None:
        super().__init__(learner, spaces, device, seed, normalise=learner.normalise)
        self.wants = "no" if learner.demonstrations == "none" else "must"
        self.memory = Memory(
            capacity=learner.capacity,
            sampler=learner.sampler(),
            device=device,
            generator=self.generator,
        )
        self.returns = self._fresh_returns()
        self.steps = self.updates = 0
        self._recorded: Recorded | None = None
        with first_weights(seed):
            self.encoders = self._encoders()
            self.nets = ActorCriticNetworks(
                features=self._features(),
                actions=spaces.action_size,
                hidden=learner.hidden,
                layer_norm=learner.layer_norm,
                critics=learner.critics,
                learning_rate=learner.learning_rate,
                temperature=learner.temperature,
                encoders=self.encoders,
                device=device,
                critic_features=self._critic_input_size(),
            )

    # what relatives change

    def _fresh_returns(self) -> Returns:
        learner = self.learner
        return Returns(length=learner.steps, gamma=learner.gamma, both=self._both_returns())

    def _both_returns(self) -> bool:
        return self.learner.steps > 1 and self.learner.one_step > 0.0

    def _encoders(self) -> dict[str, Any]:
        """Return the image encoders by the loss that updates them: none without images."""
        return {}

    def _features(self) -> int:
        """Return the size of the actor's input."""
        return self.spaces.observation_size

    def _critic_input_size(self) -> int | None:
        """Return the size of the critics' input besides the action; None for the actor's."""

    def _augmented(self, observation: Any) -> Any:
        """Return an observation as a batch is learned from; images would be shifted."""
        return observation

    def _actor_inputs(self, observation: Any) -> Tensor:
        """Return the actor's inputs."""
        return self.inputs(observation)

    def _critic_inputs(self, observation: Any, seen: Tensor, *, slow: bool = False) -> Tensor:
        """Return the critics' inputs besides the action: those of the actor."""
        return seen

    def _td_targets(self, batch: Any) -> list[tuple[float, Tensor]]:
        """Return the targets (batch,) of the critics, each with its share of the loss."""
        names = ("reward", "discount", "next_observation")
        many = self._td_target(*(batch[name] for name in names))
        if not self._both_returns():
            return [(1.0, many)]
        weight = self.learner.one_step / (1.0 + self.learner.one_step)
        one = self._td_target(*(batch[name] for name in STEP))
        return [(weight, one), (1.0 - weight, many)]

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
        """Return the number of updates due: pretraining first, then by the ratio to steps."""
        first = self.learner.pretrain if self.memory.protected else 0
        if self.updates < first or self.memory.experience <= 0:
            return max(0, first - self.updates)
        earned = int(self.learner.ratio * max(0, self.steps - self.learner.random_steps))
        return earned + first - self.updates

    def update(self) -> dict[str, Tensor]:
        """Update critics, actor and temperature on one batch."""
        if self.learner.settle:
            share = settled(self.steps, self.learner.settle)
            self.nets.set_learning_rate(self.learner.learning_rate * share)
        batch = self.memory.sample(self.learner.batch)
        metrics = self._update_recorded(batch)
        self.memory.update_priorities(batch, metrics.pop("error"))
        self.updates += 1
        return {**metrics, "demonstration_share": self.memory.share(batch)}

    def _update_recorded(self, batch: Any) -> dict[str, Tensor]:
        """Update on a batch, on an accelerator by a CUDA graph of the first update."""
        # a draw of critics takes a decision that a recording cannot
        if self.device == "cpu" or 0 < self.learner.subset < self.learner.critics:
            return self._update_networks(batch)
        given = dict(batch.items())
        if self._recorded is None:
            before = [tensor.detach().clone() for tensor in self.nets.updated_tensors()]
            self._recorded = Recorded(
                lambda state, rows: (state, self._update_networks(rows)), (), given, self.generator
            )
            # what was improved while it was recorded does not count
            self.nets.restore_tensors(before)
        return self._recorded(given)

    def _update_networks(self, batch: Any) -> dict[str, Tensor]:
        observation = self._augmented(batch["observation"])
        seen = self._actor_inputs(observation)
        known = self._critic_inputs(observation, seen)
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
            observation = self._augmented(next_observation)
            seen = self._actor_inputs(observation)
            action, log_prob = TanhNormal(self.nets.actor(seen)).sample(self.generator)
            known = self._critic_inputs(observation, seen, slow=True)
            # the pessimistic value (batch,) of the target critics' values (k, batch)
            values = self.nets.values(known, action, slow=True)
            if 0 < self.learner.subset < self.learner.critics:
                order = torch.randperm(len(values), generator=self.generator, device=self.device)
                values = values[order[: self.learner.subset]]
            later = values.min(0).values
            return reward + discount * (later - self.nets.alpha * log_prob)

    def _update_actor(self, seen: Tensor, known: Tensor) -> tuple[Tensor, Tensor]:
        # where the encoder learns with the critics, it has just done so
        own = seen if "actor" in self.encoders else seen.detach()
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
        encoder = self.encoders.get("actor", self.encoders.get("critics"))
        return self.policy_with(self.nets.actor, encoder=encoder, **self._described())

    def _described(self) -> dict[str, Any]:
        """Return what the description of a policy says beside its sizes."""
        return {}
