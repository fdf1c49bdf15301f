"""Learning environments by batch dynamics, on CPU or GPU."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace, on_accelerator, some
from seals.batch.piloted import Flight, PilotedTwin
from seals.errors import ConfigError
from seals.frames import matrix_of, quaternion_of, rotate
from seals.learn.batched import StepResult
from seals.learn.environments.batch import BatchEnvironments, Scene, picked
from seals.learn.environments.episode_frame import ActorPose, EpisodeFrame, FrameCallback
from seals.learn.environments.plain import plain, rebuilt
from seals.learn.environments.prefetched_resets import Starts
from seals.learn.seeding import generator_of
from seals.learn.task import Draw, Instant, Task, WorldTask, tool_of
from seals.multibody.tree import forward
from seals.pytree import copied
from seals.robot.model import RobotModel
from seals.run.assembly import ROBOT, build_model
from seals.run.hover_trim import carrying_speeds
from seals.run.settings import RunSettings
from seals.tensor_compiler import compile_law

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.recorded import Recorded


STARTING = ("position", "quaternion", "velocity")
"""Fields of a state that differ from start to start."""


class TwinEnvironments(BatchEnvironments):
    """N environments of one task in one batch of robots with held joints.

    Args:
        settings: of the run, ``backend=twin``.
        task: bound to the robot.
        count: N.
        device: of all tensors.
        seed: of the starts that are not asked for by seed.
        values: ``"effect.parameter"`` to a number or N numbers, in place of the settings.
        fused: whether PyTorch's compiler joins the arithmetic; None as the backend says.

    Attributes:
        reached: what the last step reached, before episodes that ended began anew.

    Raises:
        ConfigError: the run holds what a batch of twins does not know: objects, a fluid.
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
        fused: bool | None = None,
    ) -> None:
        """Build the batch."""
        _refuse(settings, task)
        super().__init__(task, count=count, device=device, seed=seed)
        robot, effects = build_model(settings)
        backend: Any = settings.backend
        fused = backend.fused if fused is None else fused
        self._like = _like_on(device, double=backend.double, fused=fused)
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
            fused=fused,
        )
        self._steps = max(1, round(1.0 / (task.rate * backend.interval)))
        self._offset = as_like(tool_offset(robot, joints), self._like)
        self._level = settings.environment.water_level
        self.robot = robot
        speeds = carrying_speeds(self._twin.plant, joints)
        self._drive = as_like(speeds, self._like)
        self._no_action = as_like(np.zeros((count, self.action_size)), self._like)
        self._generator: Any = None
        self._alone = fused or on_accelerator(self._like)
        if self._alone:
            self._generator = generator_of(seed, device)
        self._compiled = compile_law(self._law) if fused else None
        self._starts: Starts | None = None
        self._recorded: Recorded | None = None
        self._still: Any = None
        self._frame_callback: FrameCallback | None = None
        self.reached: Any = None

    def reset(self, seeds: Sequence[int] | None = None) -> Tensor:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        self._set(self._initial_scene(*self._initial_flight(self._drawn(seeds))))
        return self._observation(self._scene.now)

    def step(self, action: Tensor) -> StepResult:
        """Step all environments; see `seals.learn.batched.Batched`."""
        import torch

        with torch.no_grad():
            asked = self._as_action(action)
            if self._alone and self._starts is None:
                self._prefetch_resets()
            if not on_accelerator(asked):
                self._scene, (found, self.reached) = self._advance(self._scene, asked)
            else:
                recorded = self._recorded or self._record(asked)
                found, self.reached = recorded(asked)
                self._scene = recorded.state
            if self._frame_callback is not None:
                self._frame_callback(self._frame(self.reached))
            result: StepResult = found
            return result

    def _advance(self, scene: Scene, asked: Array) -> tuple[Scene, tuple[StepResult, Instant]]:
        """One control step of all environments, with random numbers for the episodes that begin."""
        chance = self._starts.chances(self.count, self._generator) if self._starts else None
        # looked up at each call: a bound method kept in its own object would be a reference cycle
        law = self._compiled or self._law
        found: tuple[Scene, tuple[StepResult, Instant]] = law(scene, asked, chance)
        return found

    def _law(
        self, scene: Scene, asked: Array, chance: Array | None
    ) -> tuple[Scene, tuple[StepResult, Instant]]:
        """One control step of all environments as a pure function, without branches on values."""
        before = scene.now
        velocity, yaw = self.task.command(asked, before)
        flight = self._twin.fly(scene.robots, velocity, yaw, self._steps)
        now = self._instant(flight, scene.goal, asked, before.start)
        verdict, ended, ledger = self._judged(now, before, scene.ledger)
        final = self._observation(now)
        after = Scene(flight, scene.goal, now, ledger)
        if some(ended):
            after = self._reset_ended(after, ended, chance)
        result = self._result(verdict, final, self._observation(after.now))
        return after, (result, now)

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors."""
        random = json.dumps(self._rng.bit_generator.state)
        if self._generator is None:
            return {"random": random, "parts": plain(self._scene)}
        # what is recorded goes on in the same tensors
        parts = plain(copied(self._scene))
        return {"random": random, "parts": parts, "generator": self._generator.get_state()}

    def restore(self, kept: Any) -> None:
        """Restore a snapshot of environments of the same settings."""
        if self._scene is None:
            self.reset()
        self._rng.bit_generator.state = json.loads(kept["random"])
        self._set(rebuilt(kept["parts"], self._scene))
        if self._generator is not None:
            self._generator.set_state(kept["generator"].cpu())

    def set_frame_callback(self, callback: FrameCallback | None) -> None:
        """Set a callback that receives the first robot's frame after each control step, or None."""
        self._frame_callback = callback
        if callback is not None:
            callback(self._frame(self.now))

    def close(self) -> None:
        """Release compiled and recorded functions, which refer to these environments."""
        self._compiled = self._recorded = None

    def _set(self, scene: Scene) -> None:
        self._scene = scene
        if self._recorded is not None:
            self._recorded.begin(scene)

    def _record(self, asked: Array) -> Recorded:
        """Record a control step on the accelerator."""
        from seals.learn.recorded import Recorded

        self._recorded = Recorded(self._advance, self._scene, asked, self._generator)
        return self._recorded

    def _prefetch_resets(self) -> None:
        """Draw initial states in advance, so that resets take no decision on the processor."""
        from seals.learn.environments.prefetched_resets import PREFETCHED, joined

        parts = []
        for _ in range(-(-PREFETCHED // self.count)):
            flight, goal = self._initial_flight(self.task.draw(self._rng, self.count))
            parts.append((flight.state, flight.drive, goal))
        self._still, self._starts = flight, joined(parts, STARTING)

    def _reset_ended(self, scene: Scene, ended: Array, chance: Array | None) -> Scene:
        """Reset the environments whose episode ended."""
        if self._starts is not None and chance is not None:
            opened = self._initial_scene(*self._starts.picked(self._still, chance))
        else:
            opened = self._initial_scene(*self._initial_flight(self._drawn_where(ended)))
        return Scene(
            self._twin.merged(opened.robots, scene.robots, ended),
            namespace(ended).where(ended[:, None], opened.goal, scene.goal),
            picked(opened.now, scene.now, ended),
            picked(opened.ledger, scene.ledger, ended),
        )

    def _initial_scene(self, flight: Flight, goal: Array) -> Scene:
        """Return the episodes at their first instant."""
        still = self._no_action
        now = self._instant(flight, goal, still, still[:, 0:1])
        away = now.target - now.tool
        xp = namespace(away)
        now = now._replace(start=xp.sqrt(xp.sum(away * away, axis=1, keepdims=True)))
        return Scene(flight, goal, now, self.episodes.start(now))

    def _initial_flight(self, draw: Draw) -> tuple[Flight, Array]:
        """Return flights and targets at their initial states."""
        rpy = np.concatenate((np.zeros((self.count, 2)), draw.yaw), axis=1)
        # the state has velocities in body axes: turned about the vertical alone
        c, s = np.cos(draw.yaw[:, 0]), np.sin(draw.yaw[:, 0])
        x, y, z = draw.velocity.T
        velocity = np.stack((c * x + s * y, c * y - s * x, z), axis=1)
        state = self._twin.twin.start(position=draw.position, rpy=rpy, velocity=velocity)
        wet = self._level is not None and draw.position[:, 2:3] < self._level
        drive = self._drive * as_like(1.0 - np.asarray(wet, dtype=float), self._like)
        return self._twin.start(state, drive), as_like(draw.goal, self._like)

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
            angular_velocity=state.angular_velocity,
            tool=state.position + arm,
            target=target,
            target_velocity=drift,
            submersion=self._twin.submersion(flight),
            action=action,
            start=start,
            facts={},
        )

    def _frame(self, now: Instant) -> EpisodeFrame:
        """Return the first robot's frame."""
        time, place, turn, target = (
            np.array(x[0].cpu() if hasattr(x, "cpu") else x[0], dtype=float)
            for x in (now.time, now.position, now.rotation, now.target)
        )
        robot = ActorPose(place, quaternion_of(turn), self.task.posture)
        return EpisodeFrame(float(time[0]), {ROBOT: robot}, target)

    def _as_action(self, action: Tensor) -> Array:
        """Return an action as the batch dynamics take it, clipped to -1 to 1."""
        held = action.detach().clamp(-1.0, 1.0)
        if isinstance(self._like, np.ndarray):
            return np.asarray(held.cpu().numpy(), dtype=float)
        return held.to(device=self._like.device, dtype=self._like.dtype)


def tool_offset(robot: RobotModel, joints: Floats) -> Floats:
    """Return the position of the hand in body axes, joints held [m], shape (3,)."""
    places, _ = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], joints[None])
    return np.asarray(places[0, list(tool_of(robot))].mean(axis=0))


def _like_on(device: str, *, double: bool, fused: bool) -> Array:
    """Return an array of the type and device of the batch dynamics.

    On a processor NumPy takes a fifth of PyTorch's time for a few hundred robots, unless they are
    fused: the work lies in the calls, not in the numbers.
    """
    if device == "cpu" and not fused:
        return np.zeros(1)
    import torch

    return torch.zeros(1, dtype=torch.float64 if double else torch.float32, device=device)


def _refuse(settings: RunSettings, task: Task) -> None:
    if isinstance(task, WorldTask):
        raise ConfigError(
            f"backend=twin flies robots with their joints held; {type(task).__name__} moves joints "
            "and touches things.\nSay backend=pybullet or backend=mujoco"
        )
    for key, there in (("fluid", settings.fluid is not None), ("objects", bool(settings.objects))):
        if there:
            raise ConfigError(
                f"backend=twin knows no {key}: nothing touches anything there.\n"
                "Say backend=pybullet or backend=mujoco, or leave it out."
            )
