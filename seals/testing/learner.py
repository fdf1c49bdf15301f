"""Contract tests of learner plug-ins."""

from __future__ import annotations

import copy
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seals.contract import require
from seals.learn.learner import Spaces, need_torch
from seals.learn.networks import actor_of
from seals.learn.training.checkpoint import read_checkpoint, write_checkpoint
from seals.learn.training.loop import GROWN, refuse_other_form
from seals.testing.declaration import build_declared
from seals.testing.reaching import PointReach, demonstrations

COUNT = 4
STEPS = 40
MOST_UPDATES = 8
SIZE = 24
"""Edge of the pictures [pixels]."""


@dataclass(frozen=True, kw_only=True)
class LearnerReport:
    """Result of `check_learner`.

    Args:
        name: of the learner.
        updates: made during the check.
        figures: of the last one.
    """

    name: str
    updates: int
    figures: Mapping[str, float]

    def table(self) -> str:
        """Return the figures as text."""
        stated = ", ".join(f"{key} {value:.3g}" for key, value in self.figures.items())
        return f"{self.name}: {self.updates} updates, {stated}"


def check_learner(
    learner: str | type, *, values: Mapping[str, Any] | None = None, device: str = "cpu"
) -> LearnerReport:
    """Check the contract of a learner.

    Actions must fit the environment; updates must come when they are due and report what they say;
    one seed must mean one course; an agent put back from its state must go on bit by bit; the
    policy that is handed out must do what the agent does when it does not explore.

    Args:
        learner: name of an installed learner, or its class.
        values: hyper-parameters, small enough for a few updates.
        device: of the agent; two courses are compared bit by bit on the processor only.

    Raises:
        ContractError: a promise does not hold; also an AssertionError.
        MissingExtra: torch is not installed.
    """
    need_torch()
    name, made = build_declared("learner", learner, values, headings=False)
    check = _LearnerCheck(name, made, device)
    agent = check.course(STEPS)
    if device == "cpu":
        # kernels of accelerators may add up in any order
        check.repeats(agent)
        check.continues(agent)
    check.hands_out(agent)
    return LearnerReport(name=name, updates=check.updates, figures=check.figures)


class _LearnerCheck:
    """Checks of one learner on the environment of points and targets."""

    def __init__(self, name: str, learner: Any, device: str) -> None:
        self.name, self.learner, self.device = name, learner, device
        self.updates = 0
        self.figures: dict[str, float] = {}
        self.course_told: list[float] = []
        size = SIZE if self._needs_pixels() else 0
        self.environment = PointReach(COUNT, size=size, device=device)

    def _needs_pixels(self) -> bool:
        from seals.errors import ConfigError

        try:
            self._start(pixels=None)
        except ConfigError:
            return True
        return False

    def _start(self, *, pixels: tuple[int, int, int] | None) -> Any:
        spaces = Spaces(observation_size=6, action_size=3, count=COUNT, pixels=pixels)
        return self.learner.start(spaces, device=self.device, seed=3)

    def course(self, steps: int) -> Any:
        """Train an agent for some steps, and store its reported losses."""
        self.course_told = []
        agent = self._start(pixels=self.environment.pixels)
        if agent.wants != "no":
            size = SIZE if self.environment.pixels else 0
            agent.add_demonstrations(demonstrations(4, size=size))
        self._learn(agent)
        observation = self.environment.reset(list(range(COUNT)))
        for _ in range(steps if agent.interactive else 0):
            observation = self._step(agent, observation)
        require(
            self.updates > 0,
            self.name,
            f"makes no update in {steps} steps of {COUNT} environments",
            "Give check_learner values with fewer random steps or a shorter horizon.",
        )
        return agent

    def _step(self, agent: Any, observation: Any) -> Any:
        action = agent.act(observation, explore=True)
        fits = tuple(action.shape) == (COUNT, 3) and bool((action.abs() <= 1.0).all())
        require(
            fits and not action.requires_grad,
            self.name,
            f"acts with shape {tuple(action.shape)}, size up to {float(action.abs().max()):.3g}",
            f"Return ({COUNT}, 3) in [-1, 1], without gradient.",
        )
        turn = self.environment.step(action)
        agent.observe(observation, action, turn)
        self._learn(agent)
        return turn.observation

    def _learn(self, agent: Any) -> None:
        import math

        for _ in range(min(agent.due(), MOST_UPDATES)):
            figures = {key: float(value) for key, value in agent.update().items()}
            self.updates += 1
            self.course_told.extend(figures.values())
            require(
                tuple(figures) == tuple(agent.reports),
                self.name,
                f"reports {', '.join(figures)}, and says {', '.join(agent.reports)}",
                "Let reports list the names of the values that update returns, in order.",
            )
            require(
                all(math.isfinite(value) for value in figures.values()),
                self.name,
                f"reports {figures}",
                "Losses must be finite.",
            )
            self.figures = figures

    def repeats(self, agent: Any) -> None:
        """Repeat the training from the same seed."""
        stated = self.course_told
        self.course(STEPS if agent.interactive else 0)
        require(
            stated == self.course_told,
            self.name,
            "reports different losses the second time",
            "Draw only from generators made from the seed.",
        )

    def continues(self, agent: Any) -> None:
        """Restore a used agent from a file, and continue both agents."""
        other = self._start(pixels=self.environment.pixels)
        with tempfile.TemporaryDirectory() as folder:
            write_checkpoint(Path(folder), {"agent": agent.state()})
            kept = read_checkpoint(Path(folder), device="cpu")["agent"]
        # check that a state is taken up by `seals train resume=`
        try:
            refuse_other_form(kept, other.state())
        except ValueError as cause:
            require(
                False,
                self.name,
                f"could not be resumed after a stop: {cause}",
                f"Keep arrays that grow below an entry '{GROWN[0]}' of the state.",
            )
        other.load(kept)
        scene = copy.deepcopy(self.environment.snapshot())
        courses = []
        for each in (agent, other):
            self.environment.restore(copy.deepcopy(scene))
            self.course_told = []
            observation = self.environment.reset(list(range(COUNT)))
            for _ in range(STEPS // 4 if each.interactive else 0):
                observation = self._step(each, observation)
            self._learn(each)
            courses.append(self.course_told)
        require(
            courses[0] == courses[1],
            self.name,
            "does not continue identically from its state",
            "Return everything that changes: weights, optimisers, memory, counts, generators.",
        )

    def hands_out(self, agent: Any) -> None:
        """Build the policy from its description and compare it with the agent."""
        import torch

        network, tensors = agent.policy()
        actor = actor_of(network).to(self.device)
        actor.load_state_dict(tensors)
        observation = self.environment.reset(list(range(COUNT)))
        with torch.no_grad():
            gap = float((actor(observation) - agent.act(observation, explore=False)).abs().max())
        # an agent may hand out better weights than it acts with, but then it does not act at all
        require(
            gap < 1e-6 or not agent.interactive,
            self.name,
            f"returns a policy that differs by {gap:.3g}",
            "Return the weights and the scale that it acts with.",
        )
