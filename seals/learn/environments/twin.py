"""Batch dynamics as the simulator of learning environments, on CPU or GPU."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from seals.arrays import Array, as_like, on_accelerator, undecided
from seals.batch.piloted import Flight, PilotedTwin
from seals.environment.sampler import hulls_of
from seals.environment.wetting import WettingWhole
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of, rotate
from seals.learn.batched import picked
from seals.learn.environments.machine_twin import MachineLaw
from seals.learn.environments.simulator import ActorPose, BatchSimulator, EpisodeFrame
from seals.learn.task import Draw, Instant, Task, WorldTask, tool_of, wanted_of
from seals.multibody.tree import poses_in_base
from seals.robot.model import RobotModel
from seals.run.assembly import ROBOT, build_model
from seals.run.hover_trim import carrying_speeds
from seals.run.settings import RunSettings
from seals.scalar_compiler import REFUSED
from seals.world.compiled import LIKE

if TYPE_CHECKING:
    from torch import Generator, Tensor

STARTING = ("position", "quaternion", "velocity")
"""Fields of a state that differ from start to start."""


class Starts(NamedTuple):
    """Store of starts, one row each, from which episodes are reset on the accelerator.

    Args:
        still: flights at any start; what does not differ is taken from it.
        state: fields of the bodies that differ from start to start, by name.
        drive: states of the drives [rad/s or N].
        goal: of the task's draw.
    """

    still: Flight
    state: dict[str, Array]
    drive: Array
    goal: Array

    def chances(self, count: int, generator: Generator) -> Tensor:
        """Return uniform random numbers, one for each start to draw."""
        import torch

        return torch.rand(count, generator=generator, device=self.goal.device)

    def picked(self, chance: Array) -> tuple[Flight, Array]:
        """Return flights and goals of starts by chances from 0 to 1, 1 excluded, shape (N,)."""
        rows = (chance * self.goal.shape[0]).long()
        # component by component, as a kernel reads them
        drive, goal, *parts = (
            x.T[:, rows].T for x in (self.drive, self.goal, *self.state.values())
        )
        state = self.still.state._replace(**dict(zip(self.state, parts, strict=True)))
        return self.still._replace(state=state, drive=drive), goal


class TwinSimulator(BatchSimulator):
    """N robots with held joints in one batch of dynamics.

    Args:
        settings: of the run, ``backend=twin``.
        task: bound to the robot.
        count: N.
        device: of all arrays.
        values: ``"effect.parameter"`` to a number or N numbers, in place of the settings.
        coded: whether laws are machine code, row by row, where they can be: on NumPy, with the
            settings' own values.
        traced: for those, of one twin on traced arrays: ``whole`` where its hulls are all under
            water or above it, ``cut`` for any; empty for a batch of numbers.

    Raises:
        ConfigError: the run holds what a batch of twins does not know: objects, a fluid.
    """

    pure = True

    def __init__(
        self,
        settings: RunSettings,
        task: Task,
        *,
        count: int,
        device: str,
        values: Mapping[str, Any] | None = None,
        coded: bool = False,
        traced: str = "",
    ) -> None:
        """Build the batch."""
        if isinstance(task, WorldTask):
            raise ConfigError(
                f"backend=twin simulates robots with held joints; {type(task).__name__} moves "
                "joints and needs contacts.\nUse backend=pybullet or backend=mujoco"
            )
        for key, there in (
            ("fluid", settings.fluid is not None),
            ("objects", bool(settings.objects)),
        ):
            if there:
                raise ConfigError(
                    f"backend=twin has no option {key}, because it has no contacts.\n"
                    "Use backend=pybullet or backend=mujoco, or leave it out."
                )
        self.robot, effects = build_model(settings)
        backend: Any = settings.backend
        self.task, self._settings = task, settings
        self.like = LIKE if traced else _like_on(device, double=backend.double)
        if on_accelerator(self.like):
            self.values = {
                name: as_like(np.broadcast_to(np.reshape(value, (-1, 1)), (count, 1)), self.like)
                for name, value in (values or {}).items()
            }
        joints = task.posture
        self.twin = PilotedTwin(
            settings,
            self.robot,
            effects,
            joints=joints.tolist(),
            batch=count,
            like=self.like,
            step=backend.interval,
            values=values,
            wetting=_whole
            if traced == "whole" and (settings.environment.water_level is not None)
            else None,
        )
        self._steps = max(1, round(1.0 / (task.rate * backend.interval)))
        # the position of the hand in body axes, joints held [m], shape (3,)
        places, _ = poses_in_base(self.robot.tree, joints)
        self._offset = as_like(
            np.asarray(places[list(tool_of(self.robot))].mean(axis=0)), self.like
        )
        self._level = settings.environment.water_level
        self._drive = as_like(carrying_speeds(self.twin.plant, joints), self.like)
        # stand in for the laws of the array library
        self.machine: tuple[MachineLaw, MachineLaw] | None = None
        if coded and values is None and isinstance(self.like, np.ndarray):
            # let machine code stand in for the laws, where they have any
            with undecided(), contextlib.suppress(*REFUSED):
                # hulls as a whole first: those that the surface may cut take several times as long
                ones = [
                    TwinSimulator(settings, self.task, count=1, device="cpu", traced=form)
                    for form in ("whole", "cut")
                ]
                self.machine = (
                    MachineLaw([one._fly for one in ones]),
                    MachineLaw([one._look for one in ones]),
                )

    def of_one(self, values: Mapping[str, Any]) -> TwinSimulator:
        """Return the same for one robot, on traced arrays.

        Args:
            values: of the parameters in `values`, shape (1, 1) each.
        """
        single = {name: value.reshape((1,)) for name, value in values.items()}
        return TwinSimulator(
            self._settings, self.task, count=1, device="cpu", values=single, traced="cut"
        )

    def begin(
        self, draw: Draw, rows: Array | None = None, seeds: Sequence[int] | None = None
    ) -> tuple[Flight, Array]:
        """Return flights and targets at their initial states."""
        rpy = np.concatenate((np.zeros((len(draw.yaw), 2)), draw.yaw), axis=1)
        # the state has velocities in body axes: turned about the vertical alone
        c, s = np.cos(draw.yaw[:, 0]), np.sin(draw.yaw[:, 0])
        x, y, z = draw.velocity.T
        velocity = np.stack((c * x + s * y, c * y - s * x, z), axis=1)
        state = self.twin.twin.start(position=draw.position, rpy=rpy, velocity=velocity)
        wet = self._level is not None and draw.position[:, 2:3] < self._level
        drive = self._drive * as_like(1.0 - np.asarray(wet, dtype=float), self.like)
        return self.twin.start(state, drive), as_like(draw.goal, self.like)

    def drawn_ahead(self, draws: Iterable[Draw]) -> Starts:
        """Return a store of starts, so that resets take no decision on the processor."""
        import torch

        parts = []
        for draw in draws:
            still, goal = self.begin(draw)
            parts.append((*(getattr(still.state, name) for name in STARTING), still.drive, goal))
        columns = zip(*parts, strict=True)
        *fields, drive, goal = (torch.cat([x.T for x in column], dim=1).T for column in columns)
        return Starts(still, dict(zip(STARTING, fields, strict=True)), drive, goal)

    def advance(self, robots: Flight, action: Array, now: Instant) -> Flight:
        """Return the flights one control step later."""
        if self.machine is None:
            return self._fly(robots, now, action)
        found: Flight = self.machine[0](self._fly, self.merged, robots, now, action)
        return found

    def _fly(self, robots: Flight, now: Instant, action: Array) -> Flight:
        return self.twin.fly(robots, wanted_of(self.task, action, now), self._steps)

    def merged(self, fresh: Flight, robots: Flight, ended: Array) -> Flight:
        """Return fresh flights where ``ended`` (N,) is set, else the present ones."""
        return self.twin.merged(fresh, robots, ended)

    def instant(self, robots: Flight, goal: Array, action: Array, start: Array) -> Instant:
        """Return the present facts."""
        if self.machine is None:
            return self._look(robots, goal, action, start)
        found: Instant = self.machine[1](self._look, picked, robots, goal, action, start)
        return found

    def _look(self, robots: Flight, goal: Array, action: Array, start: Array) -> Instant:
        state = robots.state
        rotation = matrix_of(state.quaternion)
        arm = rotation @ self._offset
        target, drift = self.task.target(goal, robots.time)
        return Instant(
            time=robots.time,
            position=state.position,
            rotation=rotation,
            velocity=rotate(rotation, state.velocity),
            angular_velocity=state.angular_velocity,
            tool=state.position + arm,
            target=target,
            target_velocity=drift,
            submersion=self.twin.submersion(robots),
            action=action,
            start=start,
            facts={},
        )

    def frame(self, now: Instant, row: int = 0) -> EpisodeFrame:
        """Return the frame of one robot."""
        time, place, turn, target = (
            np.array(x[row].cpu() if hasattr(x, "cpu") else x[row], dtype=float)
            for x in (now.time, now.position, now.rotation, now.target)
        )
        robot = ActorPose(place, quaternion_of(turn), self.task.posture)
        return EpisodeFrame(float(time[0]), {ROBOT: robot}, target)


def _whole(robot: RobotModel) -> WettingWhole:
    """Return what wets hulls as a whole."""
    return WettingWhole(hulls_of(robot))


def _like_on(device: str, *, double: bool) -> Array:
    """Return an array of the type and device of the batch dynamics.

    On a processor NumPy takes a fifth of PyTorch's time for a few hundred robots: the work lies in
    the calls, not in the numbers.
    """
    if device == "cpu":
        return np.zeros(1)
    import torch

    return torch.zeros(1, dtype=torch.float64 if double else torch.float32, device=device)
