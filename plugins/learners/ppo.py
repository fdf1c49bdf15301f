"""Proximal policy optimisation (PPO): on-policy learner for many parallel environments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.learn import networks
from seals.learn.learner import Spaces, need_torch, one_of, whole
from seals.learn.observations import vector
from seals.learn.scaling import FORMS, RunningNormaliser, transform_reward
from seals.learn.seeding import first_weights, generator_of
from seals.schema import setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


PROXIMAL = "Schulman et al. 2017, arXiv 1707.06347, table 3"


@dataclass(kw_only=True)
class PPO:
    """Proximal policy optimisation (PPO) with clipped ratios.

    Equation:
        actor: -min(rho A, clip(rho, 1 - c, 1 + c) A),  rho = pi(a|s) / pi_old(a|s)
        critic: (V(s) - (A + V_old(s)))^2
        A = sum over k of (gamma lambda)^k delta_(t+k),  delta = r + gamma V(s') - V(s)

    Sums stop where an episode ends; one that was cut off goes on with the value of the state it
    reached. Actions are drawn from a normal distribution and cut off at -1 and 1.

    Args:
        hidden: widths of the hidden layers of actor and critic.
        learning_rate: of Adam [1].
        gamma: discount of one control step [1].
        decay: lambda of the advantages [1].
        horizon: control steps of each environment between two rounds of updates.
        epochs: passes over them.
        minibatches: updates in a pass.
        clip: of the ratios [1].
        deviation: of actions at first [1].
        entropy: weight of the entropy in the loss [1].
        value: weight of the critic's loss [1].
        steepest: greatest norm of a gradient [1].
        reward_scale: multiplies the reward [1].
        reward_form: ``plain``, ``symlog`` or ``clip``.

    References:
        Schulman et al. 2017, arXiv 1707.06347; Schulman et al. 2016, arXiv 1506.02438 (lambda).
    """

    hidden: list[int] = field(default_factory=lambda: [128, 128])
    learning_rate: float = setting(3e-4, "1", bounds=(0.0, 1.0), source=PROXIMAL)
    gamma: float = setting(0.99, "1", bounds=(0.0, 1.0), source=PROXIMAL)
    decay: float = setting(0.95, "1", bounds=(0.0, 1.0), source=PROXIMAL)
    horizon: int = 64
    epochs: int = 5
    minibatches: int = 4
    clip: float = setting(0.2, "1", bounds=(0.0, 1.0), source=PROXIMAL)
    deviation: float = setting(0.6, "1", bounds=(1e-3, 10.0), source="chosen")
    entropy: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen")
    value: float = setting(0.5, "1", bounds=(0.0, 10.0), source="chosen")
    steepest: float = setting(1.0, "1", bounds=(0.0, 1e3), source="chosen")
    reward_scale: float = setting(1.0, "1", bounds=(1e-9, 1e9), source="chosen")
    reward_form: str = "plain"

    def __post_init__(self) -> None:
        """Refuse sizes out of range and unknown words."""
        whole(
            horizon=(self.horizon, 1),
            epochs=(self.epochs, 1),
            minibatches=(self.minibatches, 1),
        )
        one_of("reward_form", self.reward_form, FORMS)

    def start(self, spaces: Spaces, *, device: str, seed: int) -> PpoAgent:
        """Return a fresh agent."""
        need_torch()
        return PpoAgent(self, spaces, device, seed)


class PpoAgent:
    """Agent of proximal policy optimisation.

    Args:
        learner: the hyper-parameters.
        spaces: sizes of observation and action.
        device: of the networks.
        seed: of the first weights and of all draws.
    """

    interactive = True
    wants = "no"
    reports = ("actor_loss", "critic_loss", "deviation", "moved", "value")

    def __init__(self, learner: PPO, spaces: Spaces, device: str, seed: int) -> None:
        """Make networks and optimiser."""
        import torch

        self.learner, self.spaces, self.device = learner, spaces, device
        self.generator = generator_of(seed, device)
        self.norm = RunningNormaliser(spaces.observation_size, device)
        with first_weights(seed):
            size = spaces.observation_size
            self.actor = networks.mlp(size, spaces.action_size, learner.hidden).to(device)
            self.critic = networks.mlp(size, 1, learner.hidden).to(device)
            with torch.no_grad():
                # the first actions are near zero, so that the noise alone explores
                list(self.actor.parameters())[-2].mul_(0.01)
        deviation = torch.full((spaces.action_size,), learner.deviation, device=device)
        self.log_deviation = deviation.log().requires_grad_()
        self.parameters = [
            *self.actor.parameters(),
            *self.critic.parameters(),
            self.log_deviation,
        ]
        self.optimiser = torch.optim.Adam(self.parameters, lr=learner.learning_rate)
        self.drawn: Tensor | None = None
        self.rollout: list[dict[str, Tensor]] = []
        self.round: dict[str, Tensor] = {}
        self.order: Tensor | None = None
        self.made = 0

    def add_demonstrations(self, columns: Mapping[str, Any]) -> None:
        """Ignore demonstrations: the learner is on-policy."""

    def act(self, observation: Any, *, explore: bool) -> Tensor:
        """Return actions; exploring ones are stored before clipping."""
        import torch

        with torch.no_grad():
            mean = self.actor(self._actor_inputs(vector(observation)))
            if not explore:
                return mean.clamp(-1.0, 1.0)
            noise = torch.randn(mean.shape, generator=self.generator, device=self.device)
            self.drawn = mean + self.log_deviation.exp() * noise
            return self.drawn.clamp(-1.0, 1.0)

    def observe(self, observation: Any, action: Tensor, result: StepResult) -> None:
        """Append one step of all environments to the rollout."""
        form = self.learner.reward_form
        self.rollout.append(
            {
                "observation": vector(observation),
                "action": action if self.drawn is None else self.drawn,
                "reward": transform_reward(
                    result.reward, scale=self.learner.reward_scale, form=form
                ),
                "terminated": result.terminated,
                "truncated": result.truncated,
                "final": vector(result.final),
            }
        )

    def due(self) -> int:
        """Return the number of updates left in this round; zero while steps are collected."""
        if len(self.rollout) < self.learner.horizon:
            return 0
        return self.learner.epochs * self.learner.minibatches - self.made

    def update(self) -> dict[str, Tensor]:
        """Improve actor and critic on one minibatch of this round."""
        import torch

        if self.made == 0:
            self._begin_round()
        batch = {key: value[self._minibatch()] for key, value in self.round.items()}
        mean, value = self._both(batch["observation"])
        log_prob = self._log_prob(mean, batch["action"])
        ratio = (log_prob - batch["log_prob"]).exp()
        gain = batch["advantage"]
        gain = (gain - gain.mean()) / (gain.std(unbiased=False) + 1e-8)
        clipped = ratio.clamp(1.0 - self.learner.clip, 1.0 + self.learner.clip)
        actor_loss = -torch.minimum(ratio * gain, clipped * gain).mean()
        critic_loss = (value - batch["wanted"]).square().mean()
        loss = actor_loss + self.learner.value * critic_loss
        self._step(loss - self.learner.entropy * self.log_deviation.sum())
        self.made += 1
        if self.due() == 0:
            self._end_round()
        return {
            "actor_loss": actor_loss.detach(),
            "critic_loss": critic_loss.detach(),
            "deviation": self.log_deviation.detach().exp().mean(),
            "moved": (ratio.detach() - 1.0).abs().mean(),
            "value": value.detach().mean(),
        }

    def _begin_round(self) -> None:
        """Compute log-probabilities, advantages and value targets of the rollout."""
        import torch
        from torchrl.objectives.value.functional import generalized_advantage_estimate

        steps = {key: torch.stack([step[key] for step in self.rollout]) for key in self.rollout[0]}
        with torch.no_grad():
            mean, value = self._both(steps["observation"].flatten(0, 1))
            _, later = self._both(steps["final"].flatten(0, 1))
            ended = steps["terminated"] | steps["truncated"]
            column = (*ended.shape, 1)
            gain, wanted = generalized_advantage_estimate(
                self.learner.gamma,
                self.learner.decay,
                value.reshape(column),
                later.reshape(column),
                steps["reward"].reshape(column),
                ended.reshape(column),
                steps["terminated"].reshape(column),
                time_dim=0,
            )
            action = steps["action"].flatten(0, 1)
            self.round = {
                "observation": steps["observation"].flatten(0, 1),
                "action": action,
                "log_prob": self._log_prob(mean, action),
                "advantage": gain.flatten(),
                "wanted": wanted.flatten(),
            }

    def _minibatch(self) -> Tensor:
        """Return the steps of the minibatch that is next, drawn anew for each pass."""
        import torch

        part, count = self.made % self.learner.minibatches, len(self.round["advantage"])
        if part == 0 or self.order is None:
            self.order = torch.randperm(count, generator=self.generator, device=self.device)
        return self.order.chunk(self.learner.minibatches)[part]

    def _end_round(self) -> None:
        """End a round, and update the observation normaliser with its observations."""
        import torch

        self.norm.update(torch.cat([step["observation"] for step in self.rollout]))
        self.rollout, self.round, self.order, self.made = [], {}, None, 0

    def _actor_inputs(self, observation: Tensor) -> Tensor:
        return networks.network_inputs(observation, norm=self.norm.layer, encoder=None)

    def _both(self, observation: Tensor) -> tuple[Tensor, Tensor]:
        seen = self._actor_inputs(observation)
        return self.actor(seen), self.critic(seen).squeeze(-1)

    def _log_prob(self, mean: Tensor, action: Tensor) -> Tensor:
        """Return the log-probability of actions, up to a constant."""
        away = (action - mean) * (-self.log_deviation).exp()
        return (-0.5 * away.square() - self.log_deviation).sum(-1)

    def _step(self, loss: Tensor) -> None:
        import torch

        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.parameters, self.learner.steepest)
        self.optimiser.step()

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the policy's mean, clipped to -1 and 1."""
        network = networks.description(
            observation=self.spaces.observation_size,
            action=self.spaces.action_size,
            hidden=self.learner.hidden,
            squash="clip",
        )
        return networks.policy_of(network, body=self.actor, norm=self.norm.layer)

    def state(self) -> dict[str, Any]:
        """Return networks, optimiser, the steps of this round and the generator."""
        return {
            "actor": self.actor.state_dict(),
            "critic": self.critic.state_dict(),
            "log_deviation": self.log_deviation.detach().clone(),
            "optimiser": self.optimiser.state_dict(),
            "norm": self.norm.state(),
            "turns": [dict(step) for step in self.rollout],
            "round": dict(self.round),
            "order": self.order,
            "made": self.made,
            "generator": self.generator.get_state().clone(),
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore that state."""
        import torch

        self.actor.load_state_dict(state["actor"])
        self.critic.load_state_dict(state["critic"])
        with torch.no_grad():
            self.log_deviation.copy_(state["log_deviation"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.norm.load(state["norm"])
        self.rollout = [dict(step) for step in state["turns"]]
        self.round, self.order = dict(state["round"]), state["order"]
        self.made = int(state["made"])
        self.generator.set_state(state["generator"].cpu())
