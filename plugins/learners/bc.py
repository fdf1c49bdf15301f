"""Behaviour cloning: supervised regression of demonstrated actions, without reward."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn import networks
from seals.learn.batched import tensors, vector
from seals.learn.learner import MOST, Spaces, need_torch
from seals.learn.network_agent import NetworkAgent
from seals.learn.starts import first_weights
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


class CloningAgent(NetworkAgent):
    """Agent whose network is fitted to the actions of another.

    Args:
        learner: the hyper-parameters: ``hidden``, ``learning_rate``, ``weight_decay``.
        spaces: sizes of observation and action.
        device: of the network.
        seed: of the first weights and of all draws.
        normalise: whether observations are brought to mean 0 and deviation 1.
        pixels: what `seals.learn.networks.encoder_of` takes, for a policy that sees.
    """

    def __init__(
        self,
        learner: Any,
        spaces: Spaces,
        device: str,
        seed: int,
        *,
        normalise: bool = True,
        pixels: Mapping[str, Any] | None = None,
    ) -> None:
        import torch

        super().__init__(learner, spaces, device, seed, normalise=normalise)
        size, self.encoder = spaces.observation_size, None
        with first_weights(seed):
            if pixels is not None:
                size = networks.features_of(size, pixels)
                self.encoder = networks.encoder_of(pixels).to(device)
            self.body = networks.mlp(size, spaces.action_size, learner.hidden).to(device)
        parts = (self.body,) if self.encoder is None else (self.body, self.encoder)
        self.optimiser = torch.optim.AdamW(
            [weight for part in parts for weight in part.parameters()],
            lr=learner.learning_rate,
            weight_decay=learner.weight_decay,
        )

    def action_of(self, body: Any, observation: Any, *, encoder: Any = None) -> Tensor:
        """Return the actions of a network, shape (N, a)."""
        return body(self.inputs(observation, encoder=encoder)).tanh()

    def fit(self, loss: Tensor) -> None:
        """Take one gradient step."""
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        self.optimiser.step()


class BcAgent(CloningAgent):
    """Agent of behaviour cloning."""

    parts = ("body", "best", "optimiser", "norm", "generator")
    plain = ("least", "shown", "test", "made")
    interactive = False
    wants = "must"
    reports = ("loss", "least_held_out_loss")

    def __init__(self, learner: BC, spaces: Spaces, device: str, seed: int) -> None:
        import torch

        super().__init__(learner, spaces, device, seed, normalise=learner.normalise)
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
            return self.action_of(self.body, vector(observation))

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
        self.fit(loss)
        if self.made in (1, self.learner.updates) or self.made % self.learner.look == 0:
            self._validate()
        return {"loss": loss.detach(), "least_held_out_loss": self.least}

    def _loss(self, steps: Mapping[str, Tensor]) -> Tensor:
        gap = self.action_of(self.body, steps["observation"]) - steps["action"]
        return gap.square().mean()

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
        return self.policy_with(self.best)
