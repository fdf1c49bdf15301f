"""PettingZoo environment with two agents: a robot, and the animal that is its target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from seals import registry
from seals.control import Reference
from seals.errors import ConfigError, optional_import, suggestion
from seals.learn.environments.batch import Environments
from seals.learn.environments.build import build_learning
from seals.learn.environments.episodes import FARTHEST
from seals.learn.environments.gym import ENGINE, Numbers, composed
from seals.learn.task import Instant
from seals.run.assembly import ROBOT

with optional_import(
    "environments of several agents need pettingzoo", "Install it: pip install 'aam-seals[agents]'"
):
    from pettingzoo import ParallelEnv

_SEEN = 13
"""Numbers that the animal observes."""


class SealsParallelEnv(ParallelEnv[str, Numbers, Numbers]):
    """Pursuit of two agents: ``robot`` does the task, and the object that it is about evades it.

    The robot observes and acts as in `SealsEnv`. The animal acts by its velocity, world x and y
    relative to ``speed``; it observes way from itself to the hand [m], velocities of robot and
    itself [m/s], world axes, cosine and sine of its heading, and its last action. Its reward is
    minus that of the robot.

    Args:
        env: recipe of the group ``env`` whose task has an object.
        backend: an engine with contacts; empty for MuJoCo.
        overrides: Hydra overrides.
        speed: of the animal at an action of 1 [m/s].

    Raises:
        ConfigError: the task is about no object, or the engine has no contacts.
    """

    metadata = {"name": "seals_pursuit_v0", "render_modes": []}  # noqa: RUF012  as it has it

    def __init__(
        self,
        env: str = "catch",
        *,
        backend: str = "",
        overrides: Sequence[str] = (),
        speed: float = 0.1,
    ) -> None:
        """Build the world once; every episode resets it."""
        from seals.learn.environments.world import FullWorld, WorldsInTurn

        engine = backend or ENGINE
        other = _object_of(composed(env, engine, overrides), env)
        words = [f"objects.{other}.guide=commanded", *overrides]
        settings, task = build_learning(composed(env, engine, words))
        world = FullWorld(settings, task)
        self._inner = Environments(WorldsInTurn([world]), task, count=1, device="cpu", renew=False)
        self._other, self._speed = other, speed
        self._actor: Any = world.world.actors[other]
        self._seed = np.random.default_rng()
        self._last = np.zeros(2)
        self.possible_agents = [ROBOT, other]
        self.agents: list[str] = []
        sizes = {ROBOT: len(task.observation_names), other: _SEEN}
        actions = {ROBOT: len(task.action_names), other: 2}
        self._spaces = {
            name: (
                spaces.Box(-FARTHEST, FARTHEST, (sizes[name],), np.float32),
                spaces.Box(-1.0, 1.0, (actions[name],), np.float32),
            )
            for name in self.possible_agents
        }

    @property
    def now(self) -> Instant:
        """True state of both: the target is the animal."""
        return self._inner.now

    def observation_space(self, agent: str) -> Any:
        """Return the space of an agent's observations."""
        return self._spaces[agent][0]

    def action_space(self, agent: str) -> Any:
        """Return the space of an agent's actions."""
        return self._spaces[agent][1]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Numbers], dict[str, dict[str, Any]]]:
        """Reset the world; the seed determines the initial states."""
        if seed is not None:
            self._seed = np.random.default_rng(seed)
        self._tell(np.zeros(2))
        seen = self._inner.reset([int(self._seed.integers(1_000_000_000))])
        self.agents = list(self.possible_agents)
        return self._observed(seen), {name: {} for name in self.agents}

    def step(
        self, actions: dict[str, Numbers]
    ) -> tuple[
        dict[str, Numbers],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Step both agents by one control period of the robot."""
        import torch

        self._tell(np.clip(np.asarray(actions[self._other], dtype=float), -1.0, 1.0))
        turn = self._inner.step(torch.as_tensor(np.asarray(actions[ROBOT], dtype=float))[None])
        names, reward = self.agents, float(turn.reward[0])
        ends = [bool(turn.terminated[0]), bool(turn.truncated[0])]
        values = {name: float(x[0]) for name, x in turn.facts.items()}
        facts = {name: value for name, value in values.items() if not math.isnan(value)}
        if any(ends):
            self.agents = []
        return (
            self._observed(turn.final),
            {ROBOT: reward, self._other: -reward},
            dict.fromkeys(names, ends[0]),
            dict.fromkeys(names, ends[1]),
            {name: facts if name == ROBOT else {} for name in names},
        )

    def close(self) -> None:
        """Release the world."""
        self._inner.close()

    def _tell(self, action: Any) -> None:
        """Set the velocity of the animal; it turns as its gait has it."""
        self._last = action
        velocity = np.array([*(self._speed * action), 0.0])
        self._actor.pilot.guide.tell(Reference(velocity=velocity, yaw=self._heading()))

    def _heading(self) -> float:
        kinematics, _ = self._actor.look()
        ahead = kinematics.rotations[0, 0, :, 0]
        return math.atan2(ahead[1], ahead[0])

    def _observed(self, seen: Any) -> dict[str, Numbers]:
        now, yaw = self._inner.now, self._heading()
        own = (
            (now.tool - now.target)[0],
            now.velocity[0],
            now.target_velocity[0],
            [math.cos(yaw), math.sin(yaw)],
            self._last,
        )
        rows = {ROBOT: seen[0].numpy(), self._other: np.concatenate(own)}
        return {k: np.clip(x, -FARTHEST, FARTHEST).astype(np.float32) for k, x in rows.items()}


def _object_of(config: Any, env: str) -> str:
    """Return the object that a task is about."""
    settings, task = build_learning(config)
    if hasattr(settings.backend, "interval") or not task.object:
        raise ConfigError(
            f"env={env} has no second agent: its task has no object, or its backend has no "
            "contacts."
            f"\nChoose env=catch.  {suggestion('', registry.names('task'), label='Tasks')}"
        )
    return str(task.object)
