"""Environments of learning as one batch of twins, on a processor or an accelerator."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.config.run import RunSettings
from seals.dynamics.tree import forward
from seals.errors import ConfigError
from seals.frames import matrix_of, rotate
from seals.learn.batched import Turn
from seals.learn.environments.episodes import FARTHEST, Episodes
from seals.learn.environments.plain import plain, rebuilt
from seals.learn.task import Draw, Instant, Task, WorldTask, tool_of
from seals.robot.model import RobotModel
from seals.run.assembly import build_model
from seals.run.carrying import carrying_speeds
from seals.twin.piloted import Flight, PilotedTwin

if TYPE_CHECKING:
    from torch import Tensor


class TwinEnvironments:
    """N environments of one task, flown as a batch of twins with their joints held.

    Args:
        settings: of the run, ``backend=twin``.
        task: bound to the robot.
        count: N.
        device: of all tensors.
        seed: of the starts that are not asked for by seed.
        values: ``"effect.parameter"`` to a number or N numbers, in place of the settings.

    Raises:
        ConfigError: the run holds what a batch of twins does not know: objects, a fluid.
    """

    pixels: tuple[int, int, int] | None = None

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
        """Build the batch."""
        _refuse(settings, task)
        robot, effects = build_model(settings)
        backend: Any = settings.backend
        self.task, self.count, self.device = task, count, device
        self._like = _like_on(device, double=backend.double)
        joints = task.posture
        self._twin = PilotedTwin(
            settings,
            robot,
            effects,
            joints=joints.tolist(),
            batch=count,
            like=self._like,
            step=backend.interval,
            values=values,
        )
        self._steps = max(1, round(1.0 / (task.rate * backend.interval)))
        self._offset = as_like(tool_offset(robot, joints), self._like)
        self._level = settings.environment.water_level
        speeds = carrying_speeds(self._twin.plant, joints)
        self._drive = as_like(speeds, self._like)
        self.episodes = Episodes(task)
        self.observation_size = len(task.observation_names)
        self.action_size = len(task.action_names)
        self._rng = np.random.default_rng(seed)
        self._flight: Any = None
        self._goal: Array = None
        self._now: Any = None
        self._books: Any = None

    def reset(self, seeds: Sequence[int] | None = None) -> Tensor:
        """Begin an episode everywhere; see `seals.learn.batched.Batched`."""
        if seeds is None:
            draw = self.task.draw(self._rng, self.count)
        else:
            draws = [self.task.draw(np.random.default_rng(s), 1) for s in seeds]
            draw = Draw(*(np.concatenate(column) for column in zip(*draws, strict=True)))
        self._flight, self._goal = self._begun(draw)
        self._now = self._first(self._flight, self._goal)
        self._books = self.episodes.start(self._now)
        return self._seen(self._now)

    def step(self, action: Tensor) -> Turn:
        """Act once everywhere; see `seals.learn.batched.Batched`."""
        import torch

        with torch.no_grad():
            before, asked = self._now, self._taken(action)
            xp = namespace(asked)
            velocity, yaw = self.task.command(asked, before)
            self._flight = self._twin.fly(self._flight, velocity, yaw, self._steps)
            now = self._instant(self._flight, self._goal, asked, before.start)
            verdict, books = self.episodes.judge(now, before, self._books)
            near = xp.all(xp.abs(now.position) < FARTHEST, axis=1)
            # nothing compares with what is not a number
            lost = ~near
            terminated = verdict.terminated | lost
            ended = terminated | verdict.truncated
            final = self._seen(now)
            self._now, self._books = now, books
            if bool(xp.any(ended)):
                self._renew(ended)
            return Turn(
                observation=self._seen(self._now),
                reward=self._given(verdict.reward),
                terminated=self._flag(terminated),
                truncated=self._flag(verdict.truncated & ~lost),
                final=final,
                success=self._flag(verdict.success & ended),
                facts={name: self._given(x) for name, x in verdict.facts.items()},
            )

    def expert(self) -> Tensor:
        """Return what the task's scripted expert would do now, shape (N, a)."""
        return self._given(self.task.expert(self._now))

    @property
    def now(self) -> Instant:
        """What is the case now."""
        found: Instant = self._now
        return found

    def snapshot(self) -> Any:
        """Return everything that changes, as plain data and tensors."""
        random = json.dumps(self._rng.bit_generator.state)
        parts = (self._flight, self._goal, self._now, self._books)
        return {"random": random, "parts": plain(parts)}

    def restore(self, kept: Any) -> None:
        """Put a snapshot of environments of the same settings back."""
        if self._flight is None:
            self.reset()
        self._rng.bit_generator.state = json.loads(kept["random"])
        parts = (self._flight, self._goal, self._now, self._books)
        self._flight, self._goal, self._now, self._books = rebuilt(kept["parts"], parts)

    def close(self) -> None:
        """Nothing is open."""

    def _renew(self, ended: Tensor) -> None:
        """Begin new episodes where one ended."""
        index = np.flatnonzero(np.asarray(ended.tolist()))
        few = self.task.draw(self._rng, len(index))
        full = [np.zeros((self.count, x.shape[1])) for x in few]
        for whole, part in zip(full, few, strict=True):
            whole[index] = part
        fresh, goal = self._begun(Draw(*full))
        self._flight = self._twin.merged(fresh, self._flight, ended)
        self._goal = namespace(ended).where(ended[:, None], goal, self._goal)
        first = self._first(self._flight, self._goal)
        self._now = picked(first, self._now, ended)
        self._books = picked(self.episodes.start(first), self._books, ended)

    def _begun(self, draw: Draw) -> tuple[Flight, Array]:
        """Flights and targets at their starts."""
        rpy = np.concatenate((np.zeros((self.count, 2)), draw.yaw), axis=1)
        # the state has velocities in body axes: turned about the vertical alone
        c, s = np.cos(draw.yaw[:, 0]), np.sin(draw.yaw[:, 0])
        x, y, z = draw.velocity.T
        velocity = np.stack((c * x + s * y, c * y - s * x, z), axis=1)
        state = self._twin.twin.start(position=draw.position, rpy=rpy, velocity=velocity)
        wet = self._level is not None and draw.position[:, 2:3] < self._level
        drive = self._drive * as_like(1.0 - np.asarray(wet, dtype=float), self._like)
        return self._twin.start(state, drive), as_like(draw.goal, self._like)

    def _first(self, flight: Flight, goal: Array) -> Instant:
        """What is the case at the start."""
        xp = namespace(self._like)
        still = as_like(np.zeros((self.count, self.action_size)), self._like)
        now = self._instant(flight, goal, still, still[:, 0:1])
        away = now.target - now.tool
        return now._replace(start=xp.sqrt(xp.sum(away * away, axis=1, keepdims=True)))

    def _instant(self, flight: Flight, goal: Array, action: Array, start: Array) -> Instant:
        state = flight.state
        rotation = matrix_of(state.quaternion)
        arm = rotation @ self._offset
        target, drift = self.task.target(goal, flight.time)
        return Instant(
            time=flight.time,
            position=state.position,
            rotation=rotation,
            velocity=rotate(rotation, state.velocity),
            spin=state.spin,
            tool=state.position + arm,
            target=target,
            target_velocity=drift,
            submersion=self._twin.submersion(flight),
            action=action,
            start=start,
            facts={},
        )

    def _taken(self, action: Tensor) -> Array:
        """An action as the twins take it, from -1 to 1."""
        held = action.detach().clamp(-1.0, 1.0)
        if isinstance(self._like, np.ndarray):
            return np.asarray(held.cpu().numpy(), dtype=float)
        return held.to(device=self._like.device, dtype=self._like.dtype)

    def _given(self, values: Array) -> Tensor:
        """Numbers of the twins as learners take them; what is not finite is zero."""
        import torch

        tensor = torch.from_numpy(values) if isinstance(values, np.ndarray) else values
        return torch.nan_to_num(tensor.to(torch.float32), 0.0, 0.0, 0.0)

    def _flag(self, flags: Array) -> Tensor:
        import torch

        found: Tensor = torch.from_numpy(flags) if isinstance(flags, np.ndarray) else flags
        return found

    def _seen(self, now: Instant) -> Tensor:
        return self._given(self.task.observation(now)).clamp(-FARTHEST, FARTHEST)


def tool_offset(robot: RobotModel, joints: Floats) -> Floats:
    """Return the place of the hand in body axes, joints held [m], shape (3,)."""
    places, _ = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], joints[None])
    return np.asarray(places[0, list(tool_of(robot))].mean(axis=0))


def picked(fresh: Any, other: Any, ended: Array) -> Any:
    """Return rows of one tuple of arrays where ``ended`` (N,) is set, else of another."""
    xp = namespace(ended)
    out = []
    for a, b in zip(fresh, other, strict=True):
        if isinstance(b, Mapping):
            out.append(b)
            continue
        mask = xp.reshape(ended, (-1, *[1] * (b.ndim - 1)))
        out.append(xp.where(mask, a, b))
    return type(other)(*out) if hasattr(other, "_fields") else tuple(out)


def _like_on(device: str, *, double: bool) -> Array:
    """Return the kind of array that twins compute with.

    On a processor NumPy takes a fifth of PyTorch's time for a few hundred robots: the work lies in
    the calls, not in the numbers.
    """
    if device == "cpu":
        return np.zeros(1)
    import torch

    return torch.zeros(1, dtype=torch.float64 if double else torch.float32, device=device)


def _refuse(settings: RunSettings, task: Task) -> None:
    if isinstance(task, WorldTask):
        raise ConfigError(
            f"backend=twin flies robots with their joints held; {type(task).__name__} moves joints "
            "and touches things.\nSay backend=pybullet"
        )
    for key, there in (("fluid", settings.fluid is not None), ("objects", bool(settings.objects))):
        if there:
            raise ConfigError(
                f"backend=twin knows no {key}: nothing touches anything there.\n"
                "Say backend=pybullet, or leave it out."
            )
