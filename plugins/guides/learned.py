"""Guide that follows a trained policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn.task import Instant, WorldTask
from seals.plugins.guides.behaviour.over_ground import place_of
from seals.schema import check_tree, vector
from seals.state_records import state_record

KNOWN = ("phase", "power", "slip")
"""Facts that a gait tells, and those that only rewards ask for."""


@state_record
class LearnedGuideState(NamedTuple):
    """State: initial distance [m], last action, consecutive calls at the target, success."""

    start: float
    action: tuple[float, ...]
    streak: int
    there: bool


@roles(data="target", read="policy")
@dataclass(kw_only=True)
class Learned:
    """Guide that follows a trained walking policy to a target, at the policy's rate.

    Observation, meaning of the actions and success are those of the task that the policy was
    trained for; the gait must turn as it is told: ``controller.facing=aim`` and
    ``controller.turn_gain=0``.

    Args:
        policy: folder that ``seals train`` wrote, or ``ROBOT/POLICY`` of one that is shipped.
        place: x and y of the target in the world [m].
        target: name of a body of the scene in place of a place; empty for none.

    Limitations:
        Policies of tasks for legs alone: others see what only their environments know.

    Example:
        >>> Learned(policy="crab/walk", place=[0.4, 0.0]).place
        [0.4, 0.0]
    """

    policy: str = "crab/walk"
    place: list[float] = vector((0.0, 0.0), "m", bounds=(-1e5, 1e5), source="chosen")
    target: str = ""

    # of the task, once it is known [Hz]
    rate = 5.0

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="learned")

    def bind(self, plant: Plant) -> None:
        """Read the policy, and build its task for this robot.

        Raises:
            ConfigError: the policy cannot be used, or belongs to another robot or kind of task.
            MissingExtra: the packages for learning are not installed.
        """
        from seals.learn.policy import load_policy
        from seals.learn.shipped import policy_folder, task_of

        folder = policy_folder(self.policy)
        self._policy = load_policy(folder)
        self._task: Any = task_of(self._policy.metadata, where=f"policy={self.policy}")
        asked = self._task.knows if isinstance(self._task, WorldTask) else ("world",)
        strange = [name for name in asked if name not in KNOWN]
        if strange:
            raise ConfigError(
                f"guide learned: the task of policy={self.policy} observes '{strange[0]}'.\n"
                f"Allowed: tasks of robots that walk, such as env=crab_walk."
            )
        self._task.bind(plant.robot)
        # refuse a policy whose observations or actions do not fit its task with this robot
        for kind in ("observation", "action"):
            given = list(self._policy.metadata.get(kind, ()))
            wanted = list(getattr(self._task, f"{kind}_names"))
            if given != wanted or self._policy.metadata["network"].get(kind) != len(wanted):
                raise ConfigError(
                    f"policy={self.policy} was trained with {len(given)} numbers of {kind}; this "
                    f"robot has {len(wanted)}, or different ones.\n"
                    "Use the robot of its training, or train a policy for this one: seals train "
                    "env=crab_walk robot=NAME"
                )
        self.rate = float(self._task.rate)

    def start(self, situation: RobotState) -> LearnedGuideState:
        """Return the initial state: the distance to the target.

        Raises:
            ConfigError: the robot has no gait, or the target is not there.
        """
        if not situation.phase.size:
            raise ConfigError(
                "guide learned observes leg phases, which this controller does not have.\n"
                "Use controller=gait or controller=cpg"
            )
        still = (0.0,) * len(self._task.action_names)
        far = float(np.linalg.norm(self._goal(situation) - situation.position))
        return LearnedGuideState(far, still, 0, False)

    def aim(
        self, situation: RobotState, memory: LearnedGuideState
    ) -> tuple[Reference, LearnedGuideState]:
        """Return the reference of the policy."""
        import torch

        # observation of the task, as a batch of one
        goal = self._goal(situation)[None]
        angle = 2.0 * np.pi * situation.phase
        nothing = np.zeros((1, 1))
        now = Instant(
            time=np.array([[situation.time]]),
            position=situation.position[None],
            rotation=situation.rotation[None],
            velocity=situation.velocity[None],
            angular_velocity=situation.angular_velocity[None],
            tool=situation.position[None],
            target=goal,
            target_velocity=np.zeros_like(goal),
            submersion=np.array([[situation.submersion]]),
            action=np.array([memory.action]),
            start=np.array([[memory.start]]),
            facts={
                "phase": np.concatenate((np.cos(angle), np.sin(angle)))[None],
                "power": nothing,
                "slip": nothing,
            },
        )
        near = float(self._task.distance(now)[0]) < self._task.success_distance
        streak = memory.streak + 1 if near else 0
        held = streak >= max(1, round(self._task.hold * self.rate))
        seen = torch.as_tensor(self._task.observation(now), dtype=torch.float32)
        said: Any = self._policy.act(seen)
        action = np.clip(said.numpy().astype(float), -1.0, 1.0)
        kept = LearnedGuideState(memory.start, tuple(action[0].tolist()), streak, held)
        aim: Reference = self._task.aim(action, now)
        return aim, kept

    def finished(self, memory: LearnedGuideState) -> bool | None:
        """Return True if a fixed target has been held; following a body never finishes."""
        return True if memory.there and not self.target else None

    def stage(self, memory: LearnedGuideState) -> str:
        """Return the present activity in a word."""
        return "there" if memory.there else "walking"

    def _goal(self, situation: RobotState) -> Floats:
        """Place of the target, at the height of the body [m], shape (3,)."""
        if self.target:
            x, y, _ = place_of(situation, self.target, where="learned.target")
        else:
            x, y = self.place
        return np.array([x, y, situation.position[2]])
