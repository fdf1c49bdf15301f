"""Proximal policy optimisation (PPO): on-policy learner for many parallel environments."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn import networks
from seals.learn.batched import vector
from seals.learn.devices import of_all_processes, shared_gradients
from seals.learn.learner import MOST, Spaces, need_torch, one_of
from seals.learn.network_agent import FORMS, NetworkAgent, transform_reward
from seals.learn.starts import first_weights
from seals.schema import count, setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


PROXIMAL = "Schulman et al. 2017, arXiv 1707.06347, table 3"


@roles(data="reward_form")
@dataclass(kw_only=True)
class PPO:
    """Proximal policy optimisation (PPO) with clipped ratios.

    Equation:
        actor: -min(rho A, clip(rho, 1 - c, 1 + c) A),  rho = pi(a|s) / pi_old(a|s)
        critic: (V(s) - (A + V_old(s)))^2
        A = sum over k of (gamma lambda)^k delta_(t+k),  delta = r + gamma V(s') - V(s)

    Loss, advantages and distribution are TorchRL's. Sums stop where an episode ends; one that was
    cut off goes on with the value of the state it reached. Actions are drawn from a normal
    distribution and cut off at -1 and 1. Processes that ``torchrun`` begins learn one policy: each
    brings steps of its own, gradients are their means (PyTorch's `DistributedDataParallel`), and
    each normalises the advantages of its own minibatch.

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
    horizon: int = count(64, bounds=(1, MOST))
    epochs: int = count(5, bounds=(1, MOST))
    minibatches: int = count(4, bounds=(1, MOST))
    clip: float = setting(0.2, "1", bounds=(0.0, 1.0), source=PROXIMAL)
    deviation: float = setting(0.6, "1", bounds=(1e-3, 10.0), source="chosen")
    entropy: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen")
    value: float = setting(0.5, "1", bounds=(0.0, 10.0), source="chosen")
    steepest: float = setting(1.0, "1", bounds=(0.0, 1e3), source="chosen")
    reward_scale: float = setting(1.0, "1", bounds=(1e-9, 1e9), source="chosen")
    reward_form: str = "plain"

    def __post_init__(self) -> None:
        """Refuse unknown words."""
        one_of("reward_form", self.reward_form, FORMS)

    def start(self, spaces: Spaces, *, device: str, seed: int) -> PpoAgent:
        """Return a fresh agent.

        Raises:
            ConfigError: a round has too few steps for its minibatches.
        """
        need_torch()
        rows = spaces.count * self.horizon
        # advantages are divided by their deviation, which one step has not
        if rows < 2 * self.minibatches:
            raise ConfigError(
                f"learner.minibatches={self.minibatches}: {self.horizon} steps (learner.horizon) "
                f"of {spaces.count} environments (count) are {rows}.\n"
                "Allowed: two steps or more in each minibatch."
            )
        return PpoAgent(self, spaces, device, seed)


class PpoAgent(NetworkAgent):
    """Agent of proximal policy optimisation; loss and advantages are TorchRL's."""

    parts = ("actor", "critic", "optimiser", "norm", "generator")
    plain = ("rollout", "round", "order", "made")
    reports = ("actor_loss", "critic_loss", "deviation", "clipped", "value")

    def __init__(self, learner: PPO, spaces: Spaces, device: str, seed: int) -> None:
        import torch
        from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
        from torchrl.modules import IndependentNormal, ProbabilisticActor, ValueOperator
        from torchrl.objectives import ClipPPOLoss

        super().__init__(learner, spaces, device, seed)
        size, actions = spaces.observation_size, spaces.action_size
        with first_weights(seed):
            self.mean = networks.mlp(size, actions, learner.hidden)
            self.critic = networks.mlp(size, 1, learner.hidden).to(device)
        deviation = AddStateIndependentNormalScale(actions, scale_mapping="exp")
        with torch.no_grad():
            # the first actions are near zero, so that the noise alone explores
            list(self.mean.parameters())[-2].mul_(0.01)
            deviation.state_independent_scale.fill_(math.log(learner.deviation))
        self.actor = torch.nn.Sequential(self.mean, deviation).to(device)
        self.log_deviation: Tensor = deviation.state_independent_scale
        keys = ["loc", "scale"]
        self.law = ProbabilisticActor(
            TensorDictModule(self.actor, in_keys=["observation"], out_keys=keys),
            in_keys=keys,
            distribution_class=IndependentNormal,
        )
        loss = ClipPPOLoss(
            self.law,
            ValueOperator(self.critic),
            clip_epsilon=learner.clip,
            entropy_coeff=learner.entropy,
            critic_coeff=learner.value,
            loss_critic_type="l2",
            normalize_advantage=True,
            functional=False,
        )
        self.loss = shared_gradients(loss, device)
        self.learned = [*self.actor.parameters(), *self.critic.parameters()]
        self.optimiser = torch.optim.Adam(self.learned, lr=learner.learning_rate)
        self.drawn: Tensor | None = None
        self.rollout: list[dict[str, Tensor]] = []
        self.round: dict[str, Tensor] = {}
        self.order: Tensor | None = None
        self.made = 0

    def act(self, observation: Any, *, explore: bool) -> Tensor:
        """Return actions; exploring ones are stored before clipping."""
        import torch

        with torch.no_grad():
            mean, deviation = self.actor(self.inputs(vector(observation)))
            if not explore:
                return mean.clamp(-1.0, 1.0)
            noise = torch.randn(mean.shape, generator=self.generator, device=self.device)
            self.drawn = mean + deviation * noise
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
        from tensordict import TensorDict

        if self.made == 0:
            self._begin_round()
        index = self._minibatch()
        rows = {key: value[index] for key, value in self.round.items()}
        found = self.loss(TensorDict(rows, batch_size=[len(index)]))
        self.optimiser.zero_grad(set_to_none=True)
        (found["loss_objective"] + found["loss_critic"] + found["loss_entropy"]).backward()
        torch.nn.utils.clip_grad_norm_(self.learned, self.learner.steepest)
        self.optimiser.step()
        self.made += 1
        if self.due() == 0:
            # the round ends: its observations update the observation normaliser
            seen = torch.cat([step["observation"] for step in self.rollout])
            self.norm.update(of_all_processes(seen))
            self.rollout, self.round, self.order, self.made = [], {}, None, 0
        return {
            "actor_loss": found["loss_objective"].detach(),
            "critic_loss": found["loss_critic"].detach(),
            "deviation": self.log_deviation.detach().exp().mean(),
            "clipped": found["clip_fraction"],
            "value": rows["value_target"].mean(),
        }

    def _begin_round(self) -> None:
        """Compute log-probabilities, advantages and value targets of the rollout."""
        import torch
        from tensordict import TensorDict
        from torchrl.objectives.value.functional import generalized_advantage_estimate

        steps = {key: torch.stack([step[key] for step in self.rollout]) for key in self.rollout[0]}
        size = steps["reward"].numel()
        with torch.no_grad():
            seen, after = (
                self.inputs(steps[key].flatten(0, 1)) for key in ("observation", "final")
            )
            column = (*steps["reward"].shape, 1)
            ended, terminated, reward, value, later = (
                values.reshape(column)
                for values in (
                    steps["terminated"] | steps["truncated"],
                    steps["terminated"],
                    steps["reward"],
                    self.critic(seen),
                    self.critic(after),
                )
            )
            gain, target = generalized_advantage_estimate(
                self.learner.gamma,
                self.learner.decay,
                value,
                later,
                reward,
                ended,
                terminated,
                time_dim=0,
            )
            action = steps["action"].flatten(0, 1)
            law = self.law.get_dist(TensorDict({"observation": seen}, batch_size=[size]))
            self.round = {
                "observation": seen,
                "action": action,
                "action_log_prob": law.log_prob(action),
                "advantage": gain.flatten(0, 1),
                "value_target": target.flatten(0, 1),
            }

    def _minibatch(self) -> Tensor:
        """Return the steps of the minibatch that is next, drawn anew for each pass."""
        import torch

        part, count = self.made % self.learner.minibatches, len(self.round["advantage"])
        if part == 0 or self.order is None:
            self.order = torch.randperm(count, generator=self.generator, device=self.device)
        return self.order.tensor_split(self.learner.minibatches)[part]

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the policy's mean, clipped to -1 and 1."""
        return self.policy_with(self.mean, squash="clip")
