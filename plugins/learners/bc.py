"""Behaviour cloning: supervised regression of demonstrated actions, without reward."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn import networks
from seals.learn.learner import MOST, Spaces, need_torch
from seals.learn.observations import tensors, vector
from seals.learn.scaling import RunningNormaliser
from seals.learn.seeding import first_weights, generator_of
from seals.learn.stateful import Stateful
from seals.schema import count, setting

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.batched import StepResult


@roles(data="normalise")
@dataclass(kw_only=True)
class BC:
    """Behaviour cloning by least squares.

    Equation:
        loss = mean over numbers of (tanh f(s) - a)^2

    Whole episodes are held out; the weights with the least error on them are the policy. The loss
    equals that of TorchRL's ``BCLoss``.

    Args:
        hidden: widths of the hidden layers.
        learning_rate: of Adam [1].
        weight_decay: of Adam [1].
        batch: steps in an update.
        updates: to make in all.
        held_out: share of the episodes that is held out [1].
        look: updates between two looks at them.
        normalise: whether observations are brought to mean 0 and deviation 1.

    Limitations:
        A policy that leaves the states of its demonstrations was never shown the way back.

    References:
        Pomerleau 1991, doi 10.1162/neco.1991.3.1.88; Ross et al. 2011, arXiv 1011.0686.
    """

    hidden: list[int] = field(default_factory=lambda: [128, 128])
    learning_rate: float = setting(1e-3, "1", bounds=(0.0, 1.0), source="chosen")
    weight_decay: float = setting(1e-4, "1", bounds=(0.0, 1.0), source="chosen")
    batch: int = count(256, bounds=(1, MOST))
    updates: int = count(5000, bounds=(1, MOST))
    held_out: float = setting(0.1, "1", bounds=(0.0, 0.9), source="chosen")
    look: int = count(100, bounds=(1, MOST))
    normalise: bool = True

    def start(self, spaces: Spaces, *, device: str, seed: int) -> BcAgent:
        """Return a fresh agent."""
        need_torch()
        return BcAgent(self, spaces, device, seed)


class BcAgent(Stateful):
    """Agent of behaviour cloning.

    Args:
        learner: the hyper-parameters.
        spaces: sizes of observation and action.
        device: of the network.
        seed: of the first weights and of all draws.
    """

    parts = ("body", "best", "optimiser", "norm", "generator")
    plain = ("least", "shown", "test", "made")
    interactive = False
    wants = "must"
    reports = ("loss", "least_held_out_loss")

    def __init__(self, learner: BC, spaces: Spaces, device: str, seed: int) -> None:
        """Make network and optimiser."""
        import torch

        self.learner, self.spaces, self.device = learner, spaces, device
        self.generator = generator_of(seed, device)
        self.norm = (
            RunningNormaliser(spaces.observation_size, device) if learner.normalise else None
        )
        with first_weights(seed):
            body = networks.mlp(spaces.observation_size, spaces.action_size, learner.hidden)
        self.body = body.to(device)
        self.optimiser = torch.optim.AdamW(
            self.body.parameters(), lr=learner.learning_rate, weight_decay=learner.weight_decay
        )
        self.made = 0
        self.best = copy.deepcopy(self.body)
        self.least = torch.tensor(float("inf"), device=device)
        self.shown: dict[str, Tensor] = {}
        self.test: dict[str, Tensor] = {}

    def add_demonstrations(self, columns: Mapping[str, Any]) -> None:
        """Store the steps of all demonstrations; some episodes are held out."""
        import torch

        given = tensors(columns, self.device)
        episode = given["episode"]
        names = torch.unique(episode)
        order = torch.randperm(len(names), generator=self.generator, device=self.device)
        out = torch.isin(episode, names[order[: int(self.learner.held_out * len(names))]])
        steps = {"observation": vector(given["observation"]), "action": given["action"]}
        self.shown = {key: value[~out] for key, value in steps.items()}
        self.test = {key: value[out] for key, value in steps.items()}
        if self.norm is not None:
            self.norm.update(self.shown["observation"])

    def act(self, observation: Any, *, explore: bool) -> Tensor:
        """Return the deterministic action of the policy; there is no exploration."""
        import torch

        with torch.no_grad():
            return self._action(vector(observation))

    def _action(self, observation: Tensor) -> Tensor:
        norm = None if self.norm is None else self.norm.layer
        return self.body(networks.network_inputs(observation, norm=norm, encoder=None)).tanh()

    def observe(self, observation: Any, action: Tensor, result: StepResult) -> None:
        """Ignore the step: behaviour cloning learns from demonstrations only."""

    def due(self) -> int:
        """Return the number of remaining updates."""
        return self.learner.updates - self.made

    def update(self) -> dict[str, Tensor]:
        """Run one gradient step; evaluate held-out episodes at intervals."""
        import torch

        if not self.shown:
            raise ConfigError(
                "behaviour cloning has no demonstrations.\nGive demonstrations=FOLDER"
            )
        self.made += 1
        index = torch.randint(
            len(self.shown["action"]),
            (self.learner.batch,),
            generator=self.generator,
            device=self.device,
        )
        loss = self._loss({key: value[index] for key, value in self.shown.items()})
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        self.optimiser.step()
        if self.made in (1, self.learner.updates) or self.made % self.learner.look == 0:
            self._validate()
        return {"loss": loss.detach(), "least_held_out_loss": self.least}

    def _loss(self, steps: Mapping[str, Tensor]) -> Tensor:
        return (self._action(steps["observation"]) - steps["action"]).square().mean()

    def _validate(self) -> None:
        """Save the weights if their held-out loss is the lowest so far."""
        import torch

        with torch.no_grad():
            loss = self._loss(self.test if len(self.test["action"]) else self.shown)
        if bool(loss <= self.least):
            self.least = loss
            self.best.load_state_dict(self.body.state_dict())

    def policy(self) -> tuple[dict[str, Any], dict[str, Tensor]]:
        """Return the best policy so far."""
        network = networks.description(
            observation=self.spaces.observation_size,
            action=self.spaces.action_size,
            hidden=self.learner.hidden,
            normalise=self.learner.normalise,
        )
        norm = None if self.norm is None else self.norm.layer
        return networks.policy_of(network, body=self.best, norm=norm)
