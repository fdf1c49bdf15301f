"""Learning environment in a full world: rigid-body engine, contacts, sensors, ledger."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.backend import Configuration
from seals.control import Reference
from seals.errors import ConfigError, PhysicsError, suggestion
from seals.frames import quaternion_of_rpy
from seals.learn.environments.episode_frame import ActorPose, EpisodeFrame, FrameCallback
from seals.learn.environments.episodes import EpisodeOutcome, Episodes, EpisodeState
from seals.learn.environments.facts import Facts
from seals.learn.task import Draw, Instant, SeeingTask, Task, WorldTask, tool_of
from seals.run.assembly import ROBOT, build_world
from seals.run.settings import RunSettings
from seals.world import Actor, World


class Step(NamedTuple):
    """Result of one control step.

    Args:
        observation: shape (d,).
        verdict: of the episode, arrays of one row.
    """

    observation: Floats
    verdict: EpisodeOutcome


class WorldEnvironment:
    """One robot and one task in a world.

    Args:
        settings: of the run, with a guide that takes orders.
        task: bound to the robot.
        episodes: that are expected, so that laws are compiled where that pays.

    Attributes:
        now: present state.
        perceived: the same as the policy is told it: of a target that cameras see, what they see.

    Raises:
        ConfigError: the control rate is above that of the world's steps, or the task's object is
            not there.
        SealsError: the world cannot be built.
    """

    def __init__(self, settings: RunSettings, task: Task, *, episodes: int = 1) -> None:
        """Build the world once; every episode resets it."""
        step = settings.time.step
        self._every = round(1.0 / (task.rate * step))
        if self._every < 1:
            raise ConfigError(
                f"task.rate={task.rate:g} is above {1.0 / step:g}, the world's steps a second.\n"
                f"Allowed: up to {1.0 / step:g}, or a shorter time.step."
            )
        draw = task.draw(np.random.default_rng(0), 1)
        initial = replace(
            settings.initial,
            position=draw.position[0].tolist(),
            joint_position=task.posture.tolist(),
        )
        time = replace(settings.time, duration=task.duration)
        self.settings = replace(settings, initial=initial, time=time)
        self.task, self.episodes = task, Episodes(task)
        self.world: World = build_world(self.settings, repeats=episodes)
        self.actor: Actor = self.world.actors[ROBOT]
        pilot = self.actor.pilot
        assert pilot is not None
        self._guide: Any = pilot.guide
        robot = self.actor.robot
        self._tool = list(tool_of(robot))
        self._arms = {n: task.posture[list(a.joints)] for n, a in robot.arms.items()}
        self._grip = dict.fromkeys(robot.grippers, 0.0)
        self._goal = draw.goal
        self._watcher = task.watcher() if isinstance(task, SeeingTask) else None
        self._whole: WorldTask | None = task if isinstance(task, WorldTask) else None
        names = () if self._whole is None else self._whole.knows
        self._frame_callback: FrameCallback | None = None
        self._facts = Facts(names, self.actor, self.settings.environment)
        _check_objects(self.world, [n for n in (task.object,) if n])
        self.now = self.perceived = self._instant(
            np.zeros((1, len(task.action_names))), np.zeros((1, 1))
        )
        self._ledger: EpisodeState = self.episodes.start(self.now)
        # an engine keeps contacts and impulses of the past, which placing bodies does not clear
        self._fresh = self.world.backend.snapshot()

    def reset(self, seed: int) -> Floats:
        """Reset with a seed and return the observation, shape (d,)."""
        draw = self.task.draw(np.random.default_rng(seed), 1)
        self.world.seed = seed
        self._guide.tell(self._aim(np.zeros(3), float(draw.yaw[0, 0])))
        self.world.backend.restore(self._fresh)
        self.world.reset({ROBOT: self._start(draw), **self._others(draw, seed)})
        self._facts.reset()
        self._goal = draw.goal
        still = np.zeros((1, len(self.task.action_names)))
        first = self._instant(still, np.zeros((1, 1)))
        away = np.linalg.norm(first.target - first.tool, axis=1, keepdims=True)
        self.now = first._replace(start=away)
        self._ledger = self.episodes.start(self.now)
        if self._watcher is not None:
            self._watcher.begin()
        return self._observation()

    def step(self, action: Floats) -> Step:
        """Step one control period; ``action`` has the shape (a,), from -1 to 1."""
        before = self.now
        asked = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)[None]
        self._guide.tell(self._wanted(asked))
        broken = not self._advanced()
        self.now = before if broken else self._instant(asked, before.start)
        verdict, self._ledger = self.episodes.assess(self.now, before, self._ledger)
        # told with every step: a course of training shows how often its engine gave up
        verdict.facts["broken"] = np.array([float(broken)])
        if broken:
            ends = np.ones(1, dtype=bool)
            verdict = verdict._replace(terminated=ends, truncated=~ends, success=~ends)
        return Step(self._observation(), verdict)

    def _advanced(self) -> bool:
        """Step the world for one control period; return False if the engine fails.

        A hand that squeezes something out may throw a link faster than the engine bears: that ends
        the episode, as leaving the world does, and not the training.
        """
        self._facts.begin()
        try:
            for _ in range(self._every):
                self.world.step()
                self._facts.observe()
                if self._frame_callback is not None:
                    self._frame_callback(self._frame())
        except PhysicsError:
            return False
        return True

    def scripted_policy(self) -> Floats:
        """Return the action of the task's scripted policy, shape (a,)."""
        found: Floats = self.task.scripted_policy(self.perceived)[0]
        return found

    def set_frame_callback(self, callback: FrameCallback | None) -> None:
        """Set a callback that receives the world's frame after each of its steps, or None."""
        self._frame_callback = callback
        if callback is not None:
            callback(self._frame())

    def close(self) -> None:
        """Release the world."""
        self.world.close()

    def _others(self, draw: Draw, seed: int) -> dict[str, Configuration]:
        """Return the objects' initial configurations; their guides take the episode's seed."""
        from seals.run.objects import object_configuration

        things = {n: a for n, a in self.world.actors.items() if n != ROBOT}
        drawn = {} if self._whole is None else self._whole.places(draw.goal)
        _check_objects(self.world, list(drawn))
        found = {}
        for name, thing in things.items():
            guide: Any = None if thing.pilot is None else thing.pilot.guide
            if hasattr(guide, "seed"):
                guide.seed = seed
            settings = self.settings.objects[name]
            if name in drawn:
                x, y, yaw = (float(v) for v in drawn[name])
                place, rpy = [x, y, settings.position[2]], [*settings.rpy[:2], yaw]
                settings = replace(settings, position=place, rpy=rpy)
            found[name] = object_configuration(name, settings, thing.robot)
        return found

    def _start(self, draw: Draw) -> Configuration:
        joints = self.task.posture
        rpy = np.array([[0.0, 0.0, draw.yaw[0, 0]]])
        return Configuration(
            position=draw.position[0],
            quaternion=quaternion_of_rpy(rpy)[0],
            velocity=draw.velocity[0],
            angular_velocity=np.zeros(3),
            joints=joints,
            joint_velocity=np.zeros_like(joints),
        )

    def _wanted(self, action: Floats) -> Reference:
        """Convert an action of shape (1, a) to a reference; arms hold the posture by default."""
        if self._whole is None:
            velocity, yaw = self.task.command(action, self.now)
            return self._aim(velocity[0], float(yaw[0, 0]))
        aim = self._whole.aim(action, self.now)
        return aim._replace(joints={**self._arms, **aim.joints}, grip={**self._grip, **aim.grip})

    def _aim(self, velocity: Floats, yaw: float) -> Reference:
        return Reference(velocity=velocity, yaw=yaw, joints=self._arms, grip=self._grip)

    def _instant(self, action: Floats, start: Floats) -> Instant:
        """Present state of all robots."""
        kinematics, moving = self.actor.look()
        origins, turns = kinematics.origins, kinematics.rotations
        now, wet = np.array([[self.world.time]]), self.actor.submersion()
        target, drift = self._target(now)
        return Instant(
            time=now,
            position=origins[:, 0],
            rotation=turns[:, 0],
            velocity=moving.linear[:, 0],
            angular_velocity=moving.twists[:, 0, 3:],
            tool=origins[:, self._tool].mean(axis=1),
            target=target,
            target_velocity=drift,
            submersion=np.array([[wet]]),
            action=action,
            start=start,
            facts=self._facts.now(),
        )

    def _target(self, now: Floats) -> tuple[Floats, Floats]:
        """Position and velocity of the target: those of an object, or from the task."""
        name = self.task.object
        if not name:
            return self.task.target(self._goal, now)
        kinematics, moving = self.world.actors[name].look()
        return kinematics.origins[:, 0], moving.linear[:, 0]

    def _frame(self) -> EpisodeFrame:
        """Return the world's present frame."""
        actors = {}
        for name, actor in self.world.actors.items():
            now = actor.body.read()
            actors[name] = ActorPose(now.position.copy(), now.quaternion.copy(), now.joints.copy())
        target, _ = self._target(np.array([[self.world.time]]))
        return EpisodeFrame(self.world.time, actors, np.array(target[0]))

    def _observation(self) -> Floats:
        self.perceived = self.now
        if self._watcher is not None:
            self.perceived = self._watcher.perceive(self.now, self.actor.sensor_suite.cameras)
        found: Floats = self.task.observation(self.perceived)[0]
        return found


def _check_objects(world: World, names: list[str]) -> None:
    """Refuse objects of the task that the run does not have."""
    there = [name for name in world.actors if name != ROBOT]
    for name in names:
        if name not in there:
            raise ConfigError(
                f"the task is about object '{name}', which is not in the run.\n"
                f"Add it: +objects.{name}={{robot: crab}}.  "
                f"{suggestion(name, there, label='Objects')}"
            )
