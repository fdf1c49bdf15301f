"""Worlds with contacts in one batch on one device, as the simulator of learning environments."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array
from seals.batch.piloted import PilotedTwin
from seals.batch.state import TwinState
from seals.control.plant import build_plant
from seals.errors import ConfigError
from seals.frames import quaternion_of_rpy
from seals.learn.environments.simulator import BatchSimulator
from seals.learn.starts import generator_of
from seals.learn.task import Draw, Instant, Task, WorldTask, tool_of
from seals.pytree import copied, leaves, put
from seals.robot.limbs import standing
from seals.run.assembly import build_model
from seals.run.hover_trim import carrying_speeds
from seals.run.objects import build_object, chosen
from seals.run.settings import DriveStart, RunSettings
from seals.run.sight import sees
from seals.world.servos import check_gains

if TYPE_CHECKING:
    from torch import Generator, Tensor

    from seals.effects.binding import EffectSet
    from seals.robot.model import RobotModel


class WarpWorlds(BatchSimulator):
    """N worlds on one device, each with one robot of the task.

    Controllers are recorded: they read and write tensors of their own, ``memory``, nested.

    Args:
        settings: of the run, ``backend=mujoco_warp``.
        task: bound to the robot.
        count: N.
        device: of all tensors.
        values: ``"effect.parameter"`` to a number or N numbers, in place of the settings.

    Attributes:
        worlds: what moves the robots.
        physics_steps: steps of the worlds in a control step.
        walk: lets the gaits command the servos for their next period.

    Raises:
        ConfigError: the run holds what which a batch of worlds does not support.
    """

    memory: Any
    chance: Generator | None = None
    """Random state of behaviours; None without any."""

    def __init__(
        self,
        settings: RunSettings,
        task: Task,
        *,
        count: int,
        device: str,
        values: Mapping[str, Any] | None = None,
    ) -> None:
        """Build the worlds."""
        import torch

        self.task, self.count, self.device = task, count, device
        self.like = torch.zeros(1, device=device)
        self.step = settings.time.step
        robots = self._robots(settings)
        self.robot = robots[0][0]
        for robot, effects in robots:
            check_gains(robot, effects, self.step)
        backend: Any = settings.backend
        self.worlds = backend.worlds(
            robots,
            settings.environment,
            settings.wave,
            count=count,
            step=self.step,
            device=device,
            values=values,
        )
        self.physics_steps = max(1, round(1.0 / (task.rate * self.step)))
        self.posture = self.tensor(task.posture)
        self._all = torch.ones(count, dtype=torch.bool, device=device)
        self.calls = 0
        # a start in which controllers share memory would be one that they share for good
        self.memory = copied(self._steered(settings, *robots[0]))
        start = self._start(task.draw(np.random.default_rng(0), count))
        self._place(self._all, *start)
        self._record(start[3])

    def begin(
        self, draw: Draw, rows: Array | None, seeds: Sequence[int] | None
    ) -> tuple[tuple[Tensor, ...], Array]:
        """Set some worlds to their starts."""
        if rows is None:
            self.calls, rows = 0, self._all
            if self.chance is not None and seeds is not None:
                self.chance.manual_seed(int(seeds[0]))
        start = self._start(draw)
        self._place(rows, *start)
        return tuple(leaves(self.memory)), start[3]

    def snapshot(self) -> dict[str, Any]:
        """Return what belongs to the complete state beside the controllers' memory."""
        found = {"calls": self.calls, "worlds": self.worlds.snapshot()}
        return found if self.chance is None else {**found, "chance": self.chance.get_state()}

    def restore(self, kept: Mapping[str, Any], robots: Any) -> Any:
        """Restore a snapshot; the memory goes on in the same tensors."""
        self.calls = int(kept["calls"])
        self.worlds.restore(kept["worlds"])
        if self.chance is not None:
            self.chance.set_state(kept["chance"].cpu())
        put(robots, tuple(leaves(self.memory)))
        return tuple(leaves(self.memory))

    def tensor(self, values: Any) -> Tensor:
        """Return numbers as a tensor of the worlds."""
        import torch

        return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=self.device)

    def _zeros(self, width: int) -> Tensor:
        found: Tensor = self.like.new_zeros(self.count, width)
        return found

    def _start(self, draw: Draw) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return position, quaternion, velocity and goal of starts as tensors."""
        level = np.zeros((len(draw.yaw), 2))
        quaternion = quaternion_of_rpy(np.concatenate((level, draw.yaw), axis=1))
        place, turn, speed, goal = map(
            self.tensor, (draw.position, quaternion, draw.velocity, draw.goal)
        )
        return place, turn, speed, goal

    def _forget(self, rows: Tensor, fresh: Any) -> None:
        """Put a fresh memory in place of that of some worlds."""
        import torch

        for kept, new in zip(leaves(self.memory), leaves(fresh), strict=True):
            kept.copy_(torch.where(rows[:, None], new, kept))

    @abstractmethod
    def _robots(self, settings: RunSettings) -> list[tuple[RobotModel, EffectSet]]:
        """Build the robots of a world, the task's own first."""

    @abstractmethod
    def _steered(self, settings: RunSettings, robot: RobotModel, effects: EffectSet) -> Any:
        """Build what commands the robots, and return its memory at the start."""

    @abstractmethod
    def _place(
        self, rows: Tensor, position: Tensor, quaternion: Tensor, velocity: Tensor, goal: Tensor
    ) -> None:
        """Set all that moves in some worlds to its start."""

    @abstractmethod
    def _record(self, goal: Tensor) -> None:
        """Record what commands the robots, which are at their starts."""


class WalkingWorlds(WarpWorlds):
    """One walking robot a world, commanded by its gait; the memory is the gait's."""

    def _robots(self, settings: RunSettings) -> list[tuple[RobotModel, EffectSet]]:
        robot, effects = build_model(settings)
        task = self.task
        wanted = task.knows if isinstance(task, WorldTask) else ()
        strange = [name for name in wanted if name not in ("phase", "power", "slip")]
        objects = bool(settings.objects) or bool(task.object)
        sense, gait = settings.controller.sense, hasattr(settings.controller, "walking")
        _refuse(
            (settings.fluid is not None, "a simulated fluid"),
            (objects, "objects"),
            (bool(settings.sensors), "sensors"),
            (sense != "truth", f"controller.sense={sense}"),
            (not gait, "a controller that is not a gait"),
            (
                not hasattr(task, "steer"),
                f"task {type(task).__name__}, which does not command a gait",
            ),
            (bool(strange), f"a task that asks for {', '.join(strange)}"),
            (tuple(tool_of(robot)) != (0,), "a robot with hands"),
        )
        return [(robot, effects)]

    def _steered(self, settings: RunSettings, robot: RobotModel, effects: EffectSet) -> Any:
        import torch

        controller: Any = settings.controller
        controller.bind(build_plant(robot, effects, settings.environment))
        self._gait = controller.walking(self.count, self.like)
        self._every = max(1, round(1.0 / (controller.rate * self.step)))
        self._columns = torch.as_tensor(self._gait.joints, device=self.device)
        return self._gait.start()

    def _record(self, goal: Tensor) -> None:
        still = self._zeros(len(self.task.action_names))
        now = self.instant(None, goal, still, still[:, :1])
        self._wish = copied(self._wished(still, now))
        self.walk = self.worlds.record(self._stepped)

    def _wished(self, action: Array, now: Instant) -> tuple[Any, ...]:
        """Velocity, rate of turn, and the manner of stepping by name."""
        task: Any = self.task
        found: tuple[Any, ...] = task.steer(action, now)
        return found

    def _stepped(self) -> None:
        """Let the gaits command the servos for their next period."""
        import torch

        with torch.no_grad():
            rotation = self.worlds.first.base()[1]
            values, pace = self._gait.command(
                rotation, *self._wish, self.memory, step=self._every * self.step
            )
            self.worlds.first.command[:, self._columns] = values
            put(pace, self.memory)

    def advance(self, robots: Any, action: Array, now: Instant) -> Any:
        """Advance all worlds by one control step."""
        put(self._wished(action, now), self._wish)
        self.worlds.first.work.zero_()
        self.worlds.first.slid.zero_()
        for _ in range(self.physics_steps):
            if self.calls % self._every == 0:
                self.walk()
            self.worlds.advance()
            self.calls += 1
        return robots

    def _place(
        self, rows: Tensor, position: Tensor, quaternion: Tensor, velocity: Tensor, goal: Tensor
    ) -> None:
        self.worlds.place(rows, position, quaternion, velocity, self.posture)
        self._forget(rows, self._gait.start())

    def instant(self, robots: Any, goal: Array, action: Array, start: Array) -> Instant:
        """Return the present facts."""
        import torch

        robot, span = self.worlds.first, self.physics_steps * self.step
        position, rotation, velocity, spin = robot.base()
        time = self.worlds.time.clone()
        target, drift = self.task.target(goal, time)
        angle = 2.0 * np.pi * self.memory.phase
        facts = {
            "phase": torch.cat((torch.cos(angle), torch.sin(angle)), dim=1),
            "power": robot.work / span,
            "slip": robot.slid / span,
        }
        return Instant(
            time=time,
            position=position,
            rotation=rotation,
            velocity=velocity,
            angular_velocity=spin,
            tool=position,
            target=target,
            target_velocity=drift,
            submersion=robot.submersion.clone(),
            action=action,
            start=start,
            facts=facts,
        )


class DivingWorlds(WarpWorlds):
    """A flying robot with a hand and an animal a world: the task is to catch it.

    The robot is under velocity control, the animal walks by its gait where its behaviour leads it.
    Behaviours are asked once a control step; ``values`` are those of the robot's effects. The
    memory is grip, way of the animal, and those of controller, gait and behaviour.

    Attributes:
        fly: lets the controllers command the rotors for their next period.
    """

    def _robots(self, settings: RunSettings) -> list[tuple[RobotModel, EffectSet]]:
        from seals.config.source import find_robot

        task: Any = self.task
        backend: Any = settings.backend
        name = task.object
        thing = settings.objects.get(name)
        if thing is None:
            raise ConfigError(
                f"the task is about object '{name}', which is not in the run.\n"
                f"Add it: +objects.{name}={{robot: crab}}"
            )
        strange = [n for n in task.knows if n not in ("grip", "closed", "touch", "level")]
        others = [n for n in settings.objects if n != name]
        sense, tilted = settings.controller.sense, any(thing.rpy[:2]) or any(thing.velocity)
        _refuse(
            (settings.fluid is not None, "a simulated fluid"),
            (bool(others), f"further objects: {', '.join(others)}"),
            (any(map(sees, settings.sensors.values())), "cameras"),
            (sense != "truth", f"controller.sense={sense}"),
            (tilted, "an animal with an initial tilt or velocity"),
            (backend.slope > 0.0, "a slope"),
            (bool(strange), f"a task that asks for {', '.join(strange)}"),
        )
        self._thing, self._folder = thing, find_robot(thing.robot)
        prey = build_object(name, thing, self._folder, settings.effects)
        return [build_model(settings), prey]

    def _steered(self, settings: RunSettings, robot: RobotModel, effects: EffectSet) -> Any:
        import torch

        joints = self.task.posture
        self._pilot = PilotedTwin(
            settings,
            robot,
            effects,
            joints=joints.tolist(),
            batch=self.count,
            like=self.like,
            step=self.step,
        )
        self._diver, self._prey = self.worlds.robots
        where, parts = f"objects.{self.task.object}", self._folder
        prey, prey_effects = self._prey.robot, self._prey.effects
        guide = chosen("guide", self._thing.guide, parts, where=where)
        if not hasattr(guide, "over_batch"):
            raise ConfigError(
                f"{where}.guide: {type(guide).__name__} has no batched form for animals.\n"
                "Allowed: freeze, wander, flee, shy"
            )
        self._behaviour = guide.over_batch()
        gait = chosen("controller", self._thing.controller, parts, where=where)
        gait.bind(build_plant(prey, prey_effects, settings.environment))
        self._gait = gait.walking(self.count, self.like, turns=True)
        self._strides = max(1, round(1.0 / (gait.rate * self.step)))
        self._columns = torch.as_tensor(self._gait.joints, device=self.device)
        hand = next(g for g in robot.grippers.values() if g.tips)
        self._open, self._closed = (self.tensor(x)[None] for x in (hand.open, hand.closed))
        self._fingers = torch.as_tensor(hand.joints, device=self.device)
        self._tips = [*hand.tips]
        self._tool = self._diver.views.rows[list(tool_of(robot))]
        self._level = float(settings.environment.water_level or 0.0)
        carried = settings.initial.drives is DriveStart.carrying
        speeds = carrying_speeds(self._pilot.plant, joints)
        self._speeds = self.tensor(speeds if carried else 0.0 * speeds)
        self._stance = self.tensor(
            self._thing.joint_position or standing(prey.legs, prey.tree.joints)
        )
        self.chance = generator_of(0, self.device)
        self._velocity, self._yaw = self._zeros(3), self._zeros(1)
        return self._fresh(self._zeros(3))

    def _fresh(self, there: Tensor) -> tuple[Any, ...]:
        """Return the memory of all at the start, with the animals at their places."""
        control, pace = self._pilot.controller.start(self.count), self._gait.start()
        habit = self._behaviour.start(there, self._zeros(1))
        return self._zeros(1), self._zeros(3), control, pace, habit

    def _record(self, goal: Tensor) -> None:
        self.fly, self.walk = self.worlds.record(self._flown), self.worlds.record(self._stepped)
        self._look = self.worlds.record(self.worlds.pose)

    def _flown(self) -> None:
        """Let the controllers command the rotors for their next period."""
        import torch

        with torch.no_grad():
            position, rotation, velocity, spin = self._diver.base()
            through = (rotation.mT @ velocity[:, :, None])[:, :, 0]
            empty = position[:, :0]
            state = TwinState(position, self._diver.quaternion(), through, spin, empty, empty)
            order, control = self._pilot.commands(
                *(state, self.worlds.time, self.memory[2]),
                {"velocity": self._velocity, "yaw": self._yaw},
            )
            self._diver.order.copy_(order)
            put(control, self.memory[2])

    def _stepped(self) -> None:
        """Let the gaits command the legs for their next period."""
        import torch

        _, way, _, pace, _ = self.memory
        with torch.no_grad():
            rotation, period = self._prey.base()[1], self._strides * self.step
            values, after = self._gait.command(rotation, way, None, {}, pace, step=period)
            self._prey.command[:, self._columns] = values
            put(after, pace)

    def advance(self, robots: Any, action: Array, now: Instant) -> Any:
        """Advance all worlds by one control step."""
        task: Any = self.task
        grip, _, _, _, habit = self.memory
        put(task.command(action, now), (self._velocity, self._yaw))
        grip.copy_(task.grip(action, now))
        self._diver.command[:] = self.posture
        bent = self._open + grip * (self._closed - self._open)
        self._diver.command[:, self._fingers] = bent
        way, after = self._behaviour.aim(now.target, now.position, now.time, habit, self._drawn_now)
        put((way, after), (self.memory[1], habit))
        for _ in range(self.physics_steps):
            if self.calls % self._pilot.every == 0:
                self.fly()
            if self.calls % self._strides == 0:
                self.walk()
            self.worlds.advance()
            self.calls += 1
        return robots

    def _drawn_now(self, width: int) -> Tensor:
        """Return uniform random numbers, shape (N, width)."""
        import torch

        return torch.rand(self.count, width, generator=self.chance, device=self.device)

    def _place(
        self, rows: Tensor, position: Tensor, quaternion: Tensor, velocity: Tensor, goal: Tensor
    ) -> None:
        import torch

        wet = (position[:, 2:3] < self._level).to(torch.float32)
        drive = self._speeds * (1.0 - wet)
        self._diver.place(rows, position, quaternion, velocity, self.posture, drive=drive)
        height = torch.full_like(goal[:, :1], self._thing.position[2])
        there = torch.cat((goal[:, :2], height), dim=1)
        half, none = 0.5 * goal[:, 2:3], 0.0 * goal[:, :1]
        turn = torch.cat((none, none, torch.sin(half), torch.cos(half)), dim=1)
        self._prey.place(rows, there, turn, velocity * 0.0, self._stance)
        self.worlds.begin(rows)
        self._forget(rows, self._fresh(there))

    def instant(self, robots: Any, goal: Array, action: Array, start: Array) -> Instant:
        """Return the present facts."""
        self._look()
        position, rotation, velocity, spin = self._diver.base()
        target, _, drift, _ = self._prey.base()
        tips = self.worlds.engine.places[:, self._tool]
        bent = self._diver.joints()[:, self._fingers] - self._open
        whole, grip = self._closed - self._open, self.memory[0]
        facts = {
            "grip": grip.clone(),
            "closed": (bent * whole).sum(1, keepdim=True) / (whole * whole).sum(),
            "touch": self._diver.views.normals()[:, self._tips],
            "level": grip * 0.0 + self._level,
        }
        return Instant(
            time=self.worlds.time.clone(),
            position=position,
            rotation=rotation,
            velocity=velocity,
            angular_velocity=spin,
            tool=tips.mean(1),
            target=target,
            target_velocity=drift,
            submersion=self._diver.submersion.clone(),
            action=action,
            start=start,
            facts=facts,
        )


def _refuse(*reasons: tuple[bool, str]) -> None:
    """Refuse what has no form in a batch of worlds: the first reason that holds."""
    for wrong, what in reasons:
        if wrong:
            raise ConfigError(
                f"backend=mujoco_warp on a GPU: the run has {what}, which a batch of worlds does "
                "not support.\n"
                "Use backend=mujoco, or device=cpu, or leave it out."
            )
