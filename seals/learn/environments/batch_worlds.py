"""Learning environments in a batch of worlds with contacts, on one device."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array
from seals.control.plant import build_plant
from seals.errors import ConfigError
from seals.frames import quaternion_of_rpy
from seals.learn.batched import StepResult
from seals.learn.environments.batch import BatchEnvironments, Scene, picked
from seals.learn.environments.plain import plain, rebuilt
from seals.learn.task import Draw, Instant, Task, WorldTask, tool_of
from seals.run.assembly import build_model
from seals.run.settings import RunSettings
from seals.world.servos import check_gains

if TYPE_CHECKING:
    from torch import Tensor

    from seals.effects.binding import EffectSet
    from seals.robot.model import RobotModel

FACTS = ("phase", "power", "slip")
"""Quantities of robots that a batch of worlds knows."""


class BatchWorlds(BatchEnvironments):
    """N environments of one walking task, one world with contacts each.

    Args:
        settings: of the run, ``backend=mujoco_warp``.
        task: bound to the robot; it steers a gait.
        count: N.
        device: of all tensors.
        seed: of the starts that are not asked for by seed.
        values: ``"effect.parameter"`` to a number or N numbers, in place of the settings.

    Attributes:
        worlds: what moves the robots.
        physics_steps: steps of the worlds in a control step.
        walk: lets the gaits command the servos for their next period.

    Raises:
        ConfigError: the run holds what a batch of worlds has not: objects, a fluid, sensors.
    """

    def __init__(
        self,
        settings: RunSettings,
        task: Task,
        *,
        count: int,
        device: str,
        seed: int = 0,
        values: Mapping[str, Any] | None = None,
    ) -> None:
        """Build the worlds."""
        import torch

        super().__init__(task, count=count, device=device, seed=seed)
        self._step = settings.time.step
        backend: Any = settings.backend
        robots = self._robots(settings)
        self.robot = robots[0][0]
        for robot, effects in robots:
            check_gains(robot, effects, self._step)
        self.worlds = backend.worlds(
            robots,
            settings.environment,
            settings.wave,
            count=count,
            step=self._step,
            device=device,
            values=values,
        )
        self.physics_steps = max(1, round(1.0 / (task.rate * self._step)))
        self._span = self.physics_steps * self._step
        self._posture = self._tensor(task.posture)
        self._all = torch.ones(count, dtype=torch.bool, device=device)
        self._calls = 0
        self._steered_by(settings, *robots[0])
        self._buffers()

    def _robots(self, settings: RunSettings) -> list[tuple[RobotModel, EffectSet]]:
        """Build the robots of a world, the task's own first."""
        robot, effects = build_model(settings)
        _refuse(settings, self.task, robot)
        return [(robot, effects)]

    def _steered_by(self, settings: RunSettings, robot: RobotModel, effects: EffectSet) -> None:
        """Build what commands the robot."""
        import torch

        controller: Any = settings.controller
        controller.bind(build_plant(robot, effects, settings.environment))
        self._gait = controller.walking(self.count, torch.zeros(1, device=self.device))
        self._every = max(1, round(1.0 / (controller.rate * self._step)))
        self._period = self._every * self._step

    def _buffers(self) -> None:
        """Make the tensors that the recorded gait reads and writes, and record it."""
        import torch

        self._pace = self._kept = self._gait.start()
        self._columns = torch.as_tensor(self._gait.joints, device=self.device)
        still = torch.zeros(self.count, self.action_size, device=self.device)
        start = self._draw(self.task.draw(np.random.default_rng(0), self.count))
        self._place(self._all, start)
        now = self._instant(still, start[3], still[:, :1])
        self._wish = [x.clone() for x in self._steered(still, now)]
        self.walk = self.worlds.record(self._stepped)

    def _steered(self, action: Array, now: Instant) -> list[Array]:
        """Velocity, rate of turn, and the manner of stepping in the task's order."""
        task: Any = self.task
        velocity, turn, manner = task.steer(action, now)
        self._manner = tuple(manner)
        return [velocity, turn, *manner.values()]

    def _stepped(self) -> None:
        """Let the gaits command the servos for their next period."""
        import torch

        with torch.no_grad():
            velocity, turn, *rest = self._wish
            wishes = dict(zip(self._manner, rest, strict=True))
            rotation = self.worlds.first.base()[1]
            values, pace = self._gait.command(
                rotation, velocity, turn, wishes, self._pace, step=self._period
            )
            self.worlds.first.command[:, self._columns] = values
            for kept, value in zip(self._pace, pace, strict=True):
                kept.copy_(value)

    def reset(self, seeds: Sequence[int] | None = None) -> Tensor:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        self._calls = 0
        self._scene = self._begun(self._all, self._drawn(seeds))
        return self._observation(self._scene.now)

    def step(self, action: Tensor) -> StepResult:
        """Step all environments; see `seals.learn.batched.Batched`."""
        import torch

        with torch.no_grad():
            before = self._scene.now
            asked = action.detach().to(self.device, torch.float32).clamp(-1.0, 1.0)
            self._advance(asked, before)
            now = self._instant(asked, self._scene.goal, before.start)
            verdict, ended, ledger = self._judged(now, before, self._scene.ledger)
            final = self._observation(now)
            self._scene = self._scene._replace(now=now, ledger=ledger)
            if bool(ended.any()):
                self._scene = self._reset_ended(ended)
            return self._result(verdict, final, self._observation(self._scene.now))

    def _advance(self, asked: Tensor, before: Instant) -> None:
        """Advance all worlds by one control step."""
        for kept, value in zip(self._wish, self._steered(asked, before), strict=True):
            kept.copy_(value)
        self.worlds.first.work.zero_()
        self.worlds.first.slid.zero_()
        for _ in range(self.physics_steps):
            if self._calls % self._every == 0:
                self.walk()
            self.worlds.advance()
            self._calls += 1

    def _reset_ended(self, ended: Tensor) -> Scene:
        """Reset the environments whose episode ended."""
        import torch

        fresh, old = self._begun(ended, self._drawn_where(ended.cpu().numpy())), self._scene
        return Scene(
            old.robots,
            torch.where(ended[:, None], fresh.goal, old.goal),
            picked(fresh.now, old.now, ended),
            picked(fresh.ledger, old.ledger, ended),
        )

    def _begun(self, rows: Tensor, draw: Draw) -> Scene:
        """Set some worlds to their starts, and return the state of all episodes at their first."""
        import torch

        start = self._draw(draw)
        self._place(rows, start)
        goal = start[3]
        still = torch.zeros(self.count, self.action_size, device=self.device)
        now = self._instant(still, goal, still[:, :1])
        now = now._replace(start=torch.linalg.norm(now.target - now.tool, dim=1, keepdim=True))
        return Scene(self._kept, goal, now, self.episodes.start(now))

    def _place(self, rows: Tensor, start: tuple[Tensor, ...]) -> None:
        import torch

        position, quaternion, velocity, _ = start
        self.worlds.place(rows, position, quaternion, velocity, self._posture)
        for kept, fresh in zip(self._kept, self._gait.start(), strict=True):
            kept.copy_(torch.where(rows[:, None], fresh, kept))

    def _draw(self, draw: Draw) -> tuple[Tensor, ...]:
        """Return position, quaternion, velocity and goal of starts as tensors."""
        level = np.zeros((len(draw.yaw), 2))
        quaternion = quaternion_of_rpy(np.concatenate((level, draw.yaw), axis=1))
        return tuple(self._tensor(x) for x in (draw.position, quaternion, draw.velocity, draw.goal))

    def _instant(self, action: Tensor, goal: Tensor, start: Tensor) -> Instant:
        """Present state of all robots."""
        import torch

        worlds = self.worlds
        robot = worlds.first
        position, rotation, velocity, spin = robot.base()
        time = worlds.time.clone()
        target, drift = self.task.target(goal, time)
        angle = 2.0 * np.pi * self._pace.phase
        facts = {
            "phase": torch.cat((torch.cos(angle), torch.sin(angle)), dim=1),
            "power": robot.work / self._span,
            "slip": robot.slid / self._span,
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

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors."""
        return {
            "random": json.dumps(self._rng.bit_generator.state),
            "calls": self._calls,
            "worlds": self.worlds.snapshot(),
            "parts": plain(self._scene._replace(robots=tuple(x.clone() for x in self._kept))),
        }

    def restore(self, kept: Any) -> None:
        """Restore a snapshot of environments of the same settings."""
        if self._scene is None:
            self.reset()
        self._rng.bit_generator.state = json.loads(kept["random"])
        self._calls = int(kept["calls"])
        self.worlds.restore(kept["worlds"])
        scene = rebuilt(kept["parts"], self._scene)
        for own, value in zip(self._kept, scene.robots, strict=True):
            own.copy_(value)
        self._scene = scene._replace(robots=self._kept)

    def close(self) -> None:
        """Release the worlds."""
        self._scene = None

    def _tensor(self, values: Any) -> Tensor:
        import torch

        return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=self.device)


def _refuse(settings: RunSettings, task: Task, robot: Any) -> None:
    """Refuse runs and tasks that have no form in a batch of worlds."""
    wanted = task.knows if isinstance(task, WorldTask) else ()
    strange = [name for name in wanted if name not in FACTS]
    for wrong, what in (
        (settings.fluid is not None, "a simulated fluid"),
        (bool(settings.objects) or bool(task.object), "objects"),
        (bool(settings.sensors), "sensors"),
        (settings.controller.sense != "truth", f"controller.sense={settings.controller.sense}"),
        (not hasattr(settings.controller, "walking"), "a controller that is no gait"),
        (not hasattr(task, "steer"), f"task {type(task).__name__}, which steers no gait"),
        (bool(strange), f"a task that asks for {', '.join(strange)}"),
        (tuple(tool_of(robot)) != (0,), "a robot with hands"),
    ):
        if wrong:
            raise ConfigError(
                f"backend=mujoco_warp on a GPU: the run has {what}; a batch of worlds has not.\n"
                "Say backend=mujoco, or device=cpu, or leave it out."
            )
