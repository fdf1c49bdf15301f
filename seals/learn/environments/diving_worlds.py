"""Learning environments of a diver that catches an animal, in a batch of worlds with contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from seals.batch.piloted import PilotedTwin
from seals.batch.state import TwinState
from seals.control.plant import build_plant
from seals.errors import ConfigError
from seals.learn.environments.batch_worlds import BatchWorlds
from seals.learn.seeding import generator_of
from seals.learn.task import Instant, tool_of
from seals.robot.limbs import standing
from seals.run.assembly import build_model
from seals.run.hover_trim import carrying_speeds
from seals.run.objects import build_object, chosen
from seals.run.settings import DriveStart, RunSettings
from seals.run.sight import sees

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torch import Tensor

    from seals.effects.binding import EffectSet
    from seals.robot.model import RobotModel

FACTS = ("grip", "closed", "touch", "level")
"""Quantities of a diver that a batch of worlds knows."""


class DivingWorlds(BatchWorlds):
    """N environments of one task of catching: a flying robot with a hand, and an animal.

    The robot is under velocity control, the animal walks by its gait where its behaviour leads it.
    Behaviours are asked once a control step.

    Args: see `BatchWorlds`; values are those of the robot's effects.

    Attributes:
        fly: lets the controllers command the rotors for their next period.
        walk: lets the gaits command the legs for their next period.

    Raises:
        ConfigError: the run holds what a batch of worlds has not: further objects, a fluid,
            cameras, slopes.
    """

    def _robots(self, settings: RunSettings) -> list[tuple[RobotModel, EffectSet]]:
        """Build the diver and its prey."""
        from seals.config.source import find_robot

        _refuse(settings, self.task)
        name = self.task.object
        self._thing = settings.objects[name]
        self._folder = find_robot(self._thing.robot)
        prey = build_object(name, self._thing, self._folder, settings.effects)
        return [build_model(settings), prey]

    def _steered_by(self, settings: RunSettings, robot: RobotModel, effects: EffectSet) -> None:
        """Build the controller of the diver, and gait and behaviour of the animal."""
        import torch

        like = torch.zeros(1, device=self.device)
        joints = self.task.posture
        self._pilot = PilotedTwin(
            settings,
            robot,
            effects,
            joints=joints.tolist(),
            batch=self.count,
            like=like,
            step=self._step,
        )
        self._diver, self._prey = self.worlds.robots
        where, parts = f"objects.{self.task.object}", self._folder
        prey, prey_effects = self._prey.robot, self._prey.effects
        guide = chosen("guide", self._thing.guide, parts, where=where)
        if not hasattr(guide, "over_batch"):
            raise ConfigError(
                f"{where}.guide: {type(guide).__name__} has no form over a batch of animals.\n"
                "Allowed: freeze, wander, flee, shy"
            )
        self._behaviour = guide.over_batch()
        gait = chosen("controller", self._thing.controller, parts, where=where)
        gait.bind(build_plant(prey, prey_effects, settings.environment))
        self._gait = gait.walking(self.count, like, turns=True)
        self._strides = max(1, round(1.0 / (gait.rate * self._step)))
        hand = next(g for g in robot.grippers.values() if g.tips)
        self._open, self._closed = (self._tensor(x)[None] for x in (hand.open, hand.closed))
        self._fingers = torch.as_tensor(hand.joints, device=self.device)
        self._tips = [*hand.tips]
        self._tool = self._diver.views.rows[list(tool_of(robot))]
        self._level = float(settings.environment.water_level or 0.0)
        carried = settings.initial.drives is DriveStart.carrying
        speeds = carrying_speeds(self._pilot.plant, joints)
        self._speeds = self._tensor(speeds if carried else 0.0 * speeds)
        self._stance = self._tensor(
            self._thing.joint_position or standing(prey.legs, prey.tree.joints)
        )
        self._chance = generator_of(0, self.device)

    def _buffers(self) -> None:
        """Make the tensors that the recorded controllers read and write, and record them."""
        import torch

        def zeros(width: int) -> Tensor:
            return torch.zeros(self.count, width, device=self.device)

        self._velocity, self._yaw, self._grip, self._way = zeros(3), zeros(1), zeros(1), zeros(3)
        self._control, self._pace = self._pilot.controller.start(self.count), self._gait.start()
        self._habit = self._behaviour.start(zeros(3), zeros(1))
        own = (self._grip, self._way)
        self._kept = (*own, *self._control, *self._pace, *self._habit)
        # a start in which they share memory would be one that they share for good
        self._kept = tuple(x.clone() for x in self._kept)
        sizes = len(own), len(self._control), len(self._pace)
        a, b, c = np.cumsum(sizes).tolist()
        self._grip, self._way = self._kept[:a]
        self._control = type(self._control)(*self._kept[a:b])
        self._pace = type(self._pace)(*self._kept[b:c])
        self._habit = self._kept[c:]
        self._columns = torch.as_tensor(self._gait.joints, device=self.device)
        self._place(self._all, self._draw(self.task.draw(np.random.default_rng(0), self.count)))
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
                state, self.worlds.time, self._control, self._velocity, self._yaw
            )
            self._diver.order.copy_(order)
            for kept, value in zip(self._control, control, strict=True):
                kept.copy_(value)

    def _stepped(self) -> None:
        """Let the gaits command the legs for their next period."""
        import torch

        with torch.no_grad():
            rotation, period = self._prey.base()[1], self._strides * self._step
            values, pace = self._gait.command(
                rotation, self._way, None, {}, self._pace, step=period
            )
            self._prey.command[:, self._columns] = values
            for kept, value in zip(self._pace, pace, strict=True):
                kept.copy_(value)

    def _advance(self, asked: Tensor, before: Instant) -> None:
        """Advance all worlds by one control step."""
        task: Any = self.task
        velocity, yaw = task.command(asked, before)
        self._velocity.copy_(velocity)
        self._yaw.copy_(yaw)
        self._grip.copy_(task.grip(asked, before))
        self._diver.command[:] = self._posture
        bent = self._open + self._grip * (self._closed - self._open)
        self._diver.command[:, self._fingers] = bent
        place, enemy = before.target, before.position
        way, habit = self._behaviour.aim(place, enemy, before.time, self._habit, self._drawn_now)
        self._way.copy_(way)
        for kept, value in zip(self._habit, habit, strict=True):
            kept.copy_(value)
        for _ in range(self.physics_steps):
            if self._calls % self._pilot.every == 0:
                self.fly()
            if self._calls % self._strides == 0:
                self.walk()
            self.worlds.advance()
            self._calls += 1

    def _drawn_now(self, width: int) -> Tensor:
        """Return uniform random numbers, shape (N, width)."""
        import torch

        return torch.rand(self.count, width, generator=self._chance, device=self.device)

    def reset(self, seeds: Sequence[int] | None = None) -> Tensor:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        if seeds is not None:
            self._chance.manual_seed(int(seeds[0]))
        return super().reset(seeds)

    def _place(self, rows: Tensor, start: tuple[Tensor, ...]) -> None:
        """Set robots and animals of some worlds to their starts."""
        import torch

        position, quaternion, velocity, goal = start
        wet = (position[:, 2:3] < self._level).to(torch.float32)
        drive = self._speeds * (1.0 - wet)
        self._diver.place(rows, position, quaternion, velocity, self._posture, drive=drive)
        height = torch.full_like(goal[:, :1], self._thing.position[2])
        there = torch.cat((goal[:, :2], height), dim=1)
        half, none = 0.5 * goal[:, 2:3], 0.0 * goal[:, :1]
        turn = torch.cat((none, none, torch.sin(half), torch.cos(half)), dim=1)
        self._prey.place(rows, there, turn, velocity * 0.0, self._stance)
        self.worlds.begin(rows)
        first = (
            none,
            velocity * 0.0,
            *self._pilot.controller.start(self.count),
            *self._gait.start(),
            *self._behaviour.start(there, none),
        )
        for kept, fresh in zip(self._kept, first, strict=True):
            kept.copy_(torch.where(rows[:, None], fresh, kept))

    def _instant(self, action: Tensor, goal: Tensor, start: Tensor) -> Instant:
        """Present state of all robots."""
        self._look()
        position, rotation, velocity, spin = self._diver.base()
        target, _, drift, _ = self._prey.base()
        tips = self.worlds.engine.places[:, self._tool]
        bent = self._diver.joints()[:, self._fingers] - self._open
        whole = self._closed - self._open
        facts = {
            "grip": self._grip.clone(),
            "closed": (bent * whole).sum(1, keepdim=True) / (whole * whole).sum(),
            "touch": self._diver.views.normals()[:, self._tips],
            "level": self._grip * 0.0 + self._level,
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

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors."""
        return {**super().snapshot(), "chance": self._chance.get_state()}

    def restore(self, kept: Any) -> None:
        """Restore a snapshot of environments of the same settings."""
        super().restore(kept)
        self._chance.set_state(kept["chance"].cpu())


def _refuse(settings: RunSettings, task: Any) -> None:
    """Refuse runs and tasks that have no form in a batch of worlds."""
    backend: Any = settings.backend
    strange = [name for name in task.knows if name not in FACTS]
    others = [name for name in settings.objects if name != task.object]
    thing = settings.objects.get(task.object)
    if thing is None:
        raise ConfigError(
            f"the task is about object '{task.object}', which is not in the run.\n"
            f"Add it: +objects.{task.object}={{robot: crab}}"
        )
    for wrong, what in (
        (settings.fluid is not None, "a simulated fluid"),
        (bool(others), f"further objects: {', '.join(others)}"),
        (any(map(sees, settings.sensors.values())), "cameras"),
        (settings.controller.sense != "truth", f"controller.sense={settings.controller.sense}"),
        (any(thing.rpy[:2]) or any(thing.velocity), "an animal that starts tilted or moving"),
        (backend.slope > 0.0, "a slope"),
        (bool(strange), f"a task that asks for {', '.join(strange)}"),
    ):
        if wrong:
            raise ConfigError(
                f"backend=mujoco_warp on a GPU: the run has {what}; a batch of worlds has not.\n"
                "Say backend=mujoco, or device=cpu, or leave it out."
            )
