"""Pursuit in batch dynamics: a hand hunts a prey on the bottom of a tank, and either learns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Array, Floats, namespace
from seals.learn.batched import StepResult
from seals.learn.environments.batch import Environments, Scene
from seals.learn.environments.build import build_learning
from seals.learn.environments.gym import composed
from seals.learn.environments.twin import TwinSimulator
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.reach import EXPERT_GAIN, TaskReach
from seals.robot.build import build_robot
from seals.schema import setting, vector

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.policy import Policy

HUNTER, PREY = "hunter", "prey"
ROLES = (HUNTER, PREY)
SEEN = {HUNTER: 19, PREY: 13}
"""Numbers that each observes."""
SAYS = {HUNTER: 3, PREY: 2}
"""Numbers of an action of each."""
Integers = NDArray[np.int64]
_BOX = (-1e4, 1e4)
_NEAR = 1e-9
"""Horizontal distance below which a scripted prey has no direction to flee in [m]."""


@dataclass(kw_only=True)
class TaskPursuit(TaskReach):
    """Bring the open hand over a prey that runs on the bottom, and keep it there.

    The goal holds place and velocity of the prey, world x and y: what runs it changes them.

    Equation:
        reward of the hunter = bonus (near - 1) - distance - smooth |change of the action|, never
        above zero, so that a catch ends a loss; that of the prey is its negative

    Args:
        pace: speed of the prey in each direction at an action of 1 [m/s].
        lag: time constant of its velocity [s].
        stance: height of its origin, world [m].
        over: height above it of the point that the hand must reach: nothing is touched there [m].

    All other fields are those of `TaskReach`.

    Assumptions:
        The prey is a point with a velocity; nothing touches anything.
    """

    rate: float = setting(10.0, "Hz", bounds=(1.0, 250.0), source="as task catch")
    duration: float = setting(8.0, "s", bounds=(0.1, 1e4), source="chosen: four times the way")
    speed: float = setting(0.5, "m/s", bounds=(0.01, 20.0), source="as task catch")
    success_distance: float = setting(0.05, "m", bounds=(1e-4, 10.0), source="opening of the hand")
    hold: float = setting(0.3, "s", bounds=(0.0, 60.0), source="chosen: the hand begins to close")
    ends: bool = True
    arm: list[float] = vector((-0.35, 0.0, 0.25), "rad or m", bounds=(-1e3, 1e3),
                              source="as env=catch_fleeing")  # fmt: skip
    start_low: list[float] = vector((-0.7, -0.7, -0.5), "m", bounds=_BOX, source="chosen: in water")
    start_high: list[float] = vector(
        (0.7, 0.7, -0.3), "m", bounds=_BOX, source="chosen: a dive is over"
    )
    pace: float = setting(0.07, "m/s", bounds=(0.0, 10.0), source="chosen: neither always wins")
    lag: float = setting(0.25, "s", bounds=(1e-3, 10.0), source="fitted: reversals of its gait")
    stance: float = setting(-0.971, "m", bounds=_BOX, source="as the crab of env=catch")
    over: float = setting(0.12, "m", bounds=(0.0, 10.0), source="chosen: the hand clears the crab")

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts of the hunter, and prey that stands."""
        found = super().draw(rng, count)
        still = np.zeros((count, 2))
        return found._replace(goal=np.concatenate((found.goal[:, :2], still), axis=1))

    def target(self, goal: Array, time: Array) -> tuple[Array, Array]:
        """Return the point above the prey and its velocity, shape (N, 3) each."""
        xp, zero = namespace(goal), goal[:, :1] * 0.0
        place = xp.concat((goal[:, :2], zero + self.stance + self.over), axis=1)
        return place, xp.concat((goal[:, 2:], zero), axis=1)

    def run(self, goal: Array, action: Array) -> Array:
        """Return place and velocity of the prey one control step later, shape (N, 4).

        Args:
            goal: before, shape (N, 4).
            action: its velocity relative to ``pace``, shape (N, 2).
        """
        step = 1.0 / self.rate
        share = 1.0 - math.exp(-step / self.lag)
        velocity = goal[:, 2:] + share * (self.pace * action - goal[:, 2:])
        return namespace(goal).concat((goal[:, :2] + step * velocity, velocity), axis=1)

    def reward(self, now: Instant, before: Instant, memory: Array) -> tuple[Array, Array]:
        """Return the hunter's rewards of a step, shape (N,), and the state."""
        given, memory = super().reward(now, before, memory)
        return given - self.bonus, memory


def seen_by(role: str, task: TaskPursuit, now: Instant) -> Array:
    """Return what a role observes, shape (N, d).

    The hunter observes as in `TaskReach`; the prey: ways from the hand and from the body to the
    point above itself [m], velocity of the robot and its own [m/s], lean of the robot; world axes.
    """
    if role == HUNTER:
        return task.observation(now)
    away = (now.target - now.tool, now.target - now.position)
    moving = (now.velocity, now.target_velocity[:, :2], now.rotation[:, 2, 0:2])
    return namespace(now.position).concat((*away, *moving), axis=1)


class Scripted:
    """The scripted players: a hand that is led to the prey, a prey that runs from the body.

    Args:
        role: of them.
        task: with speeds.
    """

    def __init__(self, role: str, task: TaskPursuit) -> None:
        self.role, self.speed = role, task.speed

    def begin(self, seeds: Sequence[int]) -> None:
        """Do nothing: they have no memory."""

    def act(self, observation: Tensor) -> Tensor:
        """Return actions, shape (N, a)."""
        if self.role == HUNTER:
            wanted = (EXPERT_GAIN * observation[:, :3] + observation[:, 3:6]) / self.speed
            return wanted.clamp(-1.0, 1.0)
        way = observation[:, 3:5]
        ran: Tensor = way / way.norm(dim=1, keepdim=True).clamp(min=_NEAR)
        return ran


class Squad:
    """Policies of one role, each of which acts in some of the environments.

    Args:
        policies: that act.
        rows: number of the policy in each environment, shape (N,).
    """

    def __init__(self, policies: Sequence[Policy], rows: Sequence[int] | Integers) -> None:
        self.policies, at = policies, np.asarray(rows)
        self._rows = [np.flatnonzero(at == k) for k in range(len(policies))]

    def begin(self, seeds: Sequence[int]) -> None:
        """Do nothing: none has a memory."""

    def act(self, observation: Tensor) -> Tensor:
        """Return the actions of all, shape (N, a)."""
        import torch

        parts = [p.act(observation[r]) for p, r in zip(self.policies, self._rows, strict=True)]
        found = torch.empty((len(observation), parts[0].shape[1]))
        for rows, part in zip(self._rows, parts, strict=True):
            found[rows] = part
        return found


class Pursuit(Environments):
    """N pursuits seen by one role; the other is played by policies.

    Args:
        role: which acts and observes.
        count: N.
        seed: of the starts that are not asked for by seed.

    Attributes:
        game: its task.
        opponent: plays the other role; the script, until it is set.
    """

    def __init__(self, role: str, *, count: int, seed: int = 0) -> None:
        """Build the batch: the manipulator in the tank of ``env=catch``, contacts left out."""
        config = composed("reach", "twin", ["environment.tank_bottom=-1.0"])
        settings, _ = build_learning(config)
        task = TaskPursuit()
        task.bind(build_robot(settings.robot))
        twins = TwinSimulator(settings, task, count=count, device="cpu")
        super().__init__(twins, task, count=count, device="cpu", seed=seed)
        self.role, self.game = role, task
        self.opponent: Policy = Scripted(PREY if role == HUNTER else HUNTER, task)
        self.observation_size, self.action_size = SEEN[role], SAYS[role]

    def _law(
        self, scene: Scene, asked: Array, chance: Array | None
    ) -> tuple[Scene, tuple[StepResult, Instant]]:
        other = PREY if self.role == HUNTER else HUNTER
        seen = self._as_tensor(seen_by(other, self.game, scene.now))
        said: Floats = self._as_action(self.opponent.act(seen))
        hand, legs = (asked, said) if self.role == HUNTER else (said, asked)
        return super()._law(scene._replace(goal=self.game.run(scene.goal, legs)), hand, chance)

    def _values(self, now: Instant) -> Array:
        return seen_by(self.role, self.game, now)

    def _result(self, verdict: Any, final: Tensor, observation: Tensor) -> StepResult:
        if self.role == PREY:
            verdict = verdict._replace(reward=-verdict.reward)
        return super()._result(verdict, final, observation)
