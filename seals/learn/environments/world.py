"""Full worlds, stepped in turn, as the simulator of learning environments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seals.arrays import Array, Floats
from seals.backend import Configuration
from seals.control import Reference
from seals.errors import ConfigError, PhysicsError, suggestion
from seals.frames import quaternion_of_rpy
from seals.learn.environments.facts import Facts
from seals.learn.environments.simulator import (
    ActorPose,
    BatchSimulator,
    EpisodeFrame,
    FrameCallback,
)
from seals.learn.task import (
    Draw,
    Instant,
    SeeingTask,
    Task,
    WorldTask,
    tool_of,
    wanted_of,
)
from seals.pytree import mapped
from seals.run.assembly import ROBOT, build_world
from seals.run.settings import RunSettings
from seals.world import Actor, World


class FullWorld:
    """One robot and one task in a world: rigid-body engine, contacts, sensors, ledger.

    Args:
        settings: of the run, with a guide that takes orders.
        task: bound to the robot.
        episodes: that are expected, so that laws are compiled where that pays.

    Attributes:
        watcher: turns pictures into what policies are told; None if they are told the truth.

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
        self.task = task
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
        self.watcher = task.watcher() if isinstance(task, SeeingTask) else None
        self._whole: WorldTask | None = task if isinstance(task, WorldTask) else None
        names = () if self._whole is None else self._whole.knows
        _check_objects(self.world, [n for n in (task.object,) if n])
        thing = self.world.actors[task.object] if task.object else None
        self._facts = Facts(names, self.actor, self.settings.environment, thing)
        # an engine keeps contacts and impulses of the past, which placing bodies does not clear
        self._fresh = self.world.backend.snapshot()

    def begin(self, draw: Draw, seed: int) -> None:
        """Begin an episode at the start of one draw; guides take the episode's seed."""
        self.world.seed_noise(seed)
        self._guide.tell(self._aim(velocity=np.zeros(3), yaw=float(draw.yaw[0, 0])))
        self.world.backend.restore(self._fresh)
        joints = self.task.posture
        rpy = np.array([[0.0, 0.0, draw.yaw[0, 0]]])
        self.world.reset(
            {
                ROBOT: Configuration(
                    position=draw.position[0],
                    quaternion=quaternion_of_rpy(rpy)[0],
                    velocity=draw.velocity[0],
                    angular_velocity=np.zeros(3),
                    joints=joints,
                    joint_velocity=np.zeros_like(joints),
                ),
                **self._others(draw, seed),
            }
        )
        self._facts.reset(draw.goal)
        self._goal = draw.goal
        if self.watcher is not None:
            self.watcher.begin()

    def advance(self, action: Floats, now: Instant, callback: FrameCallback | None = None) -> bool:
        """Step the world for one control period; return False if the engine fails.

        A hand that squeezes something out may throw a link faster than the engine bears: that ends
        the episode, as leaving the world does, and not the training.

        Args:
            action: from -1 to 1, shape (1, a).
            now: before the step.
            callback: receives the world's frame after each of its steps.
        """
        self._guide.tell(self._wanted(action, now))
        self._facts.begin()
        try:
            if callback is None and not self._facts.stepwise:
                self.world.advance(self._every)
                return True
            for _ in range(self._every):
                self.world.step()
                self._facts.observe()
                if callback is not None:
                    callback(self.frame())
        except PhysicsError:
            return False
        return True

    def _others(self, draw: Draw, seed: int) -> dict[str, Configuration]:
        """Return the objects' initial configurations; their guides take the episode's seed."""
        from seals.run.objects import stated_configuration

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
            found[name] = stated_configuration(f"objects.{name}", settings, thing.robot)
        return found

    def _wanted(self, action: Floats, now: Instant) -> Reference:
        """Convert an action of shape (1, a) to a reference; arms hold the posture by default."""
        if self._whole is None:
            wanted: Any = {n: x[0] for n, x in wanted_of(self.task, action, now).items()}
            if "yaw" in wanted:
                wanted["yaw"] = wanted["yaw"].item()
            return self._aim(**wanted)
        aim = self._whole.aim(action, now)
        return aim._replace(joints={**self._arms, **aim.joints}, grip={**self._grip, **aim.grip})

    def _aim(self, **wanted: Any) -> Reference:
        return Reference(joints=self._arms, grip=self._grip, **wanted)

    def instant(self, action: Floats, start: Floats) -> Instant:
        """Return the present facts, arrays of one row."""
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
            # a mean of few places: NumPy's own takes twice as long
            tool=np.add.reduce(origins[:, self._tool], axis=1) / len(self._tool),
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

    def frame(self) -> EpisodeFrame:
        """Return the world's present frame."""
        actors = {}
        for name, actor in self.world.actors.items():
            now = actor.body.read()
            actors[name] = ActorPose(now.position.copy(), now.quaternion.copy(), now.joints.copy())
        target, _ = self._target(np.array([[self.world.time]]))
        return EpisodeFrame(self.world.time, actors, np.array(target[0]))


class WorldsInTurn(BatchSimulator):
    """N worlds of one kind, stepped one after the other; the state says which of them failed.

    Args:
        worlds: N of them.
    """

    seeded = films = True

    def __init__(self, worlds: Sequence[FullWorld]) -> None:
        self.worlds, self.like = list(worlds), np.zeros(1)
        self.robot = worlds[0].actor.robot
        self.coded = worlds[0].actor.compiled is not None
        self._now: list[Any] = [None] * len(worlds)
        self._told: list[Any] = [None] * len(worlds)

    def begin(
        self, draw: Draw, rows: Array | None, seeds: Sequence[int] | None
    ) -> tuple[Array, Array]:
        """Reset some worlds, each with its own seed."""
        count = len(self.worlds)
        at: Sequence[int] = range(count) if rows is None else np.flatnonzero(rows).tolist()
        for k, seed in zip(at, seeds or (), strict=True):
            self.worlds[k].begin(_row(draw, k), int(seed))
        return np.zeros(count, dtype=bool), draw.goal

    def advance(self, robots: Array, action: Array, now: Instant) -> Array:
        """Step all worlds for one control period; return which of them failed."""
        failed = []
        for k, world in enumerate(self.worlds):
            callback = self.frame_callback if k == 0 else None
            own = now if len(self.worlds) == 1 else _row(now, k)
            failed.append(not world.advance(action[k : k + 1], own, callback))
        return np.array(failed)

    def instant(self, robots: Array, goal: Array, action: Array, start: Array) -> Instant:
        """Return the present facts; for a world that failed, the previous ones."""
        for k, world in enumerate(self.worlds):
            if not robots[k]:
                self._now[k] = world.instant(action[k : k + 1], start[k : k + 1])
        return _joined(self._now)

    def failed(self, robots: Array) -> Array:
        """Return which worlds failed in the last step, bool (N,)."""
        return robots

    def perceive(self, now: Instant, rows: Array | None) -> Instant:
        """Return the state with the target as cameras see it, where policies are told that."""
        if self.worlds[0].watcher is None:
            return now
        every = range(len(self.worlds))
        for k in every if rows is None else np.flatnonzero(rows).tolist():
            world, watcher = self.worlds[k], self.worlds[k].watcher
            assert watcher is not None
            self._told[k] = watcher.perceive(_row(now, k), world.actor.sensor_suite.cameras)
        return _joined(self._told)

    def frame(self, now: Instant, row: int = 0) -> EpisodeFrame:
        """Return the present frame of one world."""
        return self.worlds[row].frame()

    def snapshot(self) -> dict[str, Any]:
        """Refuse: the state of a rigid-body scene is not available as plain data.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError("worlds of a rigid-body engine cannot be stored as plain data")

    def restore(self, kept: Mapping[str, Any], robots: Any) -> Any:
        """Refuse, see `snapshot`.

        Raises:
            NotImplementedError: always.
        """
        return self.snapshot()

    def close(self) -> None:
        """Release all worlds."""
        for world in self.worlds:
            world.world.close()


def _row(batch: Any, k: int) -> Any:
    """Return one row of a tuple of arrays, as arrays of one row."""
    return mapped(batch, lambda column: column[k : k + 1])


def _joined(instants: Sequence[Instant]) -> Instant:
    """Return instants of one row each as one."""
    first, *others = instants
    if not others:
        return first
    found: Instant = mapped(first, lambda *rows: np.concatenate(rows), *others)
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
