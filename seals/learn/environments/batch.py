"""N learning environments of one task: starts from seeds, verdicts, results of a step."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from seals.arrays import Array, as_like, namespace, on_accelerator, some
from seals.errors import ConfigError
from seals.learn.batched import StepResult, picked
from seals.learn.environments.episodes import FARTHEST, EpisodeOutcome, Episodes, EpisodeState
from seals.learn.environments.machine_twin import MachineVerdict
from seals.learn.environments.simulator import BatchSimulator, EpisodeFrame, FrameCallback
from seals.learn.starts import TRAINING_END, generator_of
from seals.learn.task import Draw, Instant, Task
from seals.pytree import copied, is_tensor, mapped
from seals.scalar_compiler import CannotCompile
from seals.scalar_compiler.device_rows import DeviceLaw, by_component
from seals.sound_numbers import refuse_not_finite

if TYPE_CHECKING:
    from torch import Tensor

    from seals.learn.environments.batch_cameras import BatchCameras
    from seals.learn.recorded import Recorded

FEW = 4
"""Robots up to which a verdict is quicker as machine code, number by number, than as arrays."""
PREFETCHED = 1 << 16
"""Starts drawn ahead; an episode begins at any of them with equal chance."""


class Scene(NamedTuple):
    """State of N environments.

    Args:
        robots: what moves them, as the simulator has it.
        goal: numbers from which the task knows the target, shape (N, g).
        now: what is the case.
        ledger: of the episodes.
    """

    robots: Any
    goal: Array
    now: Instant
    ledger: EpisodeState


class Environments:
    """N environments of one task, moved by one simulator; see `seals.learn.batched.Batched`.

    A simulator of pure laws is compiled, and recorded on an accelerator: there starts are drawn
    ahead, so that a step takes no decision on the processor.

    With cameras, observations are a mapping of ``state`` and ``pixels``: the colours of all cameras
    at this control step and those before, because velocities cannot be seen in one picture.

    Args:
        simulator: of the N robots.
        task: bound to the robot.
        count: N.
        device: of all tensors.
        seed: of the starts that are not asked for by seed.
        renew: whether episodes that end begin anew in the same step.
        cameras: of the robots, or None.
        frames: control steps in the pictures of an observation; at a start all of them show it.

    Attributes:
        reached: what the last step reached, before episodes that ended began anew.

    Raises:
        ConfigError: fewer frames than one.
    """

    def __init__(
        self,
        simulator: BatchSimulator,
        task: Task,
        *,
        count: int,
        device: str,
        seed: int = 0,
        renew: bool = True,
        cameras: BatchCameras | None = None,
        frames: int = 1,
    ) -> None:
        """Store the sizes; there is no scene before the first reset."""
        if frames < 1:
            raise ConfigError(f"frames={frames} shows nothing.\nAllowed: 1 or more.")
        self.simulator, self.task, self.count, self.device = simulator, task, count, device
        self.robot, self.episodes = simulator.robot, Episodes(task)
        self.observation_size = len(task.observation_names)
        self.action_size = len(task.action_names)
        self._rng, self._renew = np.random.default_rng(seed), renew
        self._no_action = as_like(np.zeros((count, self.action_size)), simulator.like)
        self._alone = simulator.pure and on_accelerator(simulator.like)
        self._generator: Any = generator_of(seed, device) if self._alone else None
        self._device_law = DeviceLaw(self._law_of_one, simulator.like) if self._alone else None
        self._verdict = MachineVerdict(self._judged) if simulator.coded and count <= FEW else None
        self._starts: Any = None
        self._recorded: Recorded | None = None
        self._scene: Any = None
        self._told: Any = None
        self.reached: Any = None
        self.cameras, self._frames = cameras, frames
        self._film: Any = None
        self.pixels: tuple[int, int, int] | None = None
        if cameras is not None:
            channels, height, width = cameras.shape
            self.pixels = (channels * frames, height, width)

    @property
    def now(self) -> Instant:
        """Present state of all robots; before the first reset that of one."""
        if self._scene is None:
            self.reset()
        found: Instant = self._scene.now
        return found

    @property
    def perceived(self) -> Instant:
        """The same as policies are told it: of a target that cameras see, what they see."""
        now = self.now
        return now if self.simulator.pure else self._told

    def scripted_policy(self) -> Tensor:
        """Return the actions of the task's scripted policy, shape (N, a)."""
        return self._as_tensor(self.task.scripted_policy(self.perceived))

    def reset(self, seeds: Sequence[int] | None = None) -> Any:
        """Reset all environments; see `seals.learn.batched.Batched`."""
        if self.cameras is not None and seeds is not None:
            self.cameras.seed(seeds[0])
        draw, seeds = self._drawn(range(self.count), seeds)
        self._set(self._opened(*self.simulator.begin(draw, None, seeds)))
        self._film = None
        return self._with_film(self._observation(self._perceive(self._scene.now, None)))

    def begin_anew(self, rows: Any) -> Any:
        """Restart the episodes of the selected rows, bool (N,); return all observations."""
        if self._scene is None:
            self.reset()
        mask = as_like(np.asarray(rows, dtype=float), self.simulator.like) > 0.5
        fresh = None
        if self._starts is not None:
            fresh = self._starts.picked(self._starts.chances(self.count, self._generator))
        self._set(self._reset_ended(self._scene, mask, fresh))
        state = self._observation(self._perceive(self._scene.now, mask))
        return self._with_film(state, rows)

    def step(self, action: Tensor) -> StepResult:
        """Step all environments; see `seals.learn.batched.Batched`."""
        import torch

        with torch.no_grad():
            self._refuse_undefined("action", action)
            asked = self._as_action(action)
            if self._scene is None:
                self.reset()
            if self._alone and self._starts is None:
                rounds = range(-(-PREFETCHED // self.count))
                self._starts = self.simulator.drawn_ahead(
                    self.task.draw(self._rng, self.count) for _ in rounds
                )
            if not (self.simulator.pure and on_accelerator(asked)):
                self._scene, (found, self.reached) = self._advance(self._scene, asked)
            else:
                if self._recorded is None:
                    from seals.learn.recorded import Recorded

                    scene, given = by_component((self._scene, asked))
                    self._recorded = Recorded(self._advance, scene, given, self._generator)
                found, self.reached = self._recorded(asked)
                self._scene = self._recorded.state
            callback = self.simulator.frame_callback
            if callback is not None and not self.simulator.films:
                callback(self.simulator.frame(self.reached))
            self._refuse_undefined("reward", found.reward)
            if self.cameras is None:
                return found
            image, ended = self.cameras.look(self.reached), found.terminated | found.truncated
            self._film = torch.cat([self._film[:, image.shape[1] :], image], 1)
            final = {"state": found.final, "pixels": self._film}
            seen = {"state": found.observation, "pixels": self._film}
            if bool(ended.any()):
                seen = self._with_film(found.observation, ended)
            return found._replace(observation=seen, final=final)

    def _with_film(self, state: Tensor, rows: Any = None) -> Any:
        """Return observations, where there are cameras beside the pictures of rows that begin."""
        if self.cameras is None:
            return state
        import torch

        still = self.cameras.look(self.now).repeat(1, self._frames, 1, 1)
        if rows is not None:
            fresh = torch.as_tensor(rows, device=still.device)[:, None, None, None]
            still = torch.where(fresh, still, self._film)
        self._film = still
        return {"state": state, "pixels": still}

    def _advance(self, scene: Scene, asked: Array) -> tuple[Scene, tuple[StepResult, Instant]]:
        """One control step of all environments, with random numbers for the episodes that begin."""
        if not self._alone:
            return self._law(scene, asked, None)
        fresh = self._starts.picked(self._starts.chances(self.count, self._generator))
        if self._device_law is None:
            return self._law(scene, asked, fresh)
        try:
            found: tuple[Scene, tuple[StepResult, Instant]] = self._device_law(
                self.simulator.values, scene, fresh, asked
            )
        except CannotCompile:
            # operation by operation, as any law on tensors
            self._device_law = None
            return self._law(scene, asked, fresh)
        return found

    def _law_of_one(
        self, values: Mapping[str, Array], scene: Scene, fresh: tuple[Any, Array], asked: Array
    ) -> tuple[Scene, tuple[StepResult, Instant]]:
        """One control step of one robot on traced arrays."""
        simulator = self.simulator.of_one(values)
        one = Environments(simulator, self.task, count=1, device="cpu", renew=self._renew)
        return one._law(scene, asked, fresh)

    def _law(
        self, scene: Scene, asked: Array, fresh: tuple[Any, Array] | None
    ) -> tuple[Scene, tuple[StepResult, Instant]]:
        """One control step: a pure function without branches on values if the simulator is.

        Args:
            scene: before.
            asked: actions, shape (N, a).
            fresh: robots and goals of the episodes that may begin; None draws them.
        """
        before, simulator = scene.now, self.simulator
        robots = simulator.advance(scene.robots, asked, before)
        now = simulator.instant(robots, scene.goal, asked, before.start)
        failed = simulator.failed(robots)
        if failed is not None and (simulator.pure or failed.any()):
            now = picked(before, now, failed)
        judged = self._judged if self._verdict is None else self._verdict
        verdict, ended, ledger, values = judged(now, before, scene.ledger, failed)
        told = self._perceive(now, None)
        final = self._seen(told, values if told is now else self._values(told))
        after = Scene(robots, scene.goal, now, ledger)
        # nobody waits for an accelerator whose law is pure: there the answer is always yes
        if self._renew and (some(ended) if simulator.pure else bool(ended.any())):
            after = self._reset_ended(after, ended, fresh)
            observation = self._observation(self._perceive(after.now, ended))
        else:
            observation = copied(final) if is_tensor(final) else final
        return after, (self._result(verdict, final, observation), now)

    def _judged(
        self, now: Instant, before: Instant, ledger: EpisodeState, failed: Array | None
    ) -> tuple[EpisodeOutcome, Array, EpisodeState, Array]:
        """Return the verdict on a step, which episodes ended, the new ledger, and observations."""
        verdict, ledger = self.episodes.assess(now, before, ledger)
        xp = namespace(now.position)
        # nothing compares with what is not a number
        lost = ~xp.all(xp.abs(now.position) < FARTHEST, axis=1)
        if failed is not None:
            # told with every step: a course of training shows how often its engine gave up
            verdict.facts["broken"] = xp.astype(failed, now.position.dtype)
            lost = lost | failed
        terminated = verdict.terminated | lost
        ended = terminated | verdict.truncated
        zero = xp.zeros_like(verdict.reward)
        verdict = verdict._replace(
            # of a robot without a position nothing is known, of any other the reward is the task's
            reward=xp.where(lost & ~xp.isfinite(verdict.reward), zero, verdict.reward),
            terminated=terminated,
            truncated=verdict.truncated & ~lost,
            success=verdict.success & ended & ~lost,
        )
        return verdict, ended, ledger, self._values(now)

    def _reset_ended(self, scene: Scene, ended: Array, fresh: tuple[Any, Array] | None) -> Scene:
        """Reset the environments whose episode ended."""
        if fresh is not None:
            opened = self._opened(*fresh)
        else:
            rows = np.flatnonzero(ended.cpu() if hasattr(ended, "cpu") else ended)
            few, seeds = self._drawn(rows.tolist(), None)
            full = Draw(*(np.zeros((self.count, x.shape[1])) for x in few))
            for whole, part in zip(full, few, strict=True):
                whole[rows] = part
            opened = self._opened(*self.simulator.begin(full, ended, seeds))
        return Scene(
            self.simulator.merged(opened.robots, scene.robots, ended),
            namespace(ended).where(ended[:, None], opened.goal, scene.goal),
            picked(opened.now, scene.now, ended),
            picked(opened.ledger, scene.ledger, ended),
        )

    def _drawn(
        self, rows: Sequence[int], seeds: Sequence[int] | None
    ) -> tuple[Draw, Sequence[int] | None]:
        """Return starts of some environments, each from its own seed where there are seeds."""
        if seeds is None and self.simulator.seeded:
            seeds = [int(self._rng.integers(TRAINING_END)) for _ in rows]
        if seeds is None:
            return self.task.draw(self._rng, len(rows)), None
        draws = [self.task.draw(np.random.default_rng(seed), 1) for seed in seeds]
        return Draw(*(np.concatenate(column) for column in zip(*draws, strict=True))), seeds

    def _opened(self, robots: Any, goal: Array) -> Scene:
        """Return episodes at their first instant."""
        still = self._no_action
        now = self.simulator.instant(robots, goal, still, still[:, 0:1])
        away = now.target - now.tool
        xp = namespace(away)
        now = now._replace(start=xp.sqrt(xp.sum(away * away, axis=1, keepdims=True)))
        return Scene(robots, goal, now, self.episodes.start(now))

    def _perceive(self, now: Instant, rows: Array | None) -> Instant:
        """Return what policies are told, after a step or a start of some rows, None for all."""
        if not self.simulator.pure:
            now = self._told = self.simulator.perceive(now, rows)
        return now

    def snapshot(self) -> Any:
        """Return the complete state, as plain data and tensors.

        Raises:
            NotImplementedError: the simulator's state cannot be put back.
        """
        found = {"random": json.dumps(self._rng.bit_generator.state), **self.simulator.snapshot()}
        scene = self._scene
        if not isinstance(self._no_action, np.ndarray):
            # what is recorded goes on in the same tensors
            scene = copied(scene)
        found["parts"] = _plain(scene)
        if self._generator is not None:
            found["generator"] = self._generator.get_state()
        if self.cameras is None:
            return found
        return {"twins": found, "film": self._film.clone(), "noise": self.cameras.snapshot()}

    def restore(self, kept: Any) -> None:
        """Restore a snapshot of environments of the same settings.

        Raises:
            NotImplementedError: see `snapshot`.
        """
        parts = kept if self.cameras is None else kept["twins"]
        if self._scene is None:
            self.reset()
        self._rng.bit_generator.state = json.loads(parts["random"])
        scene = _rebuilt(parts["parts"], self._scene)
        self._set(scene._replace(robots=self.simulator.restore(parts, scene.robots)))
        self._told = self._scene.now
        if self._generator is not None:
            self._generator.set_state(parts["generator"].cpu())
        if self.cameras is not None:
            self._film = kept["film"].to(self.device)
            self.cameras.restore(kept["noise"])

    def set_frame_callback(self, callback: FrameCallback | None) -> None:
        """Set a callback that receives the first robot's frames, or None; the present one at once.

        Simulators that film themselves tell each of their steps, others each control step.
        """
        self.simulator.frame_callback = callback
        if callback is not None:
            callback(self.simulator.frame(self.now))

    def frames(self) -> list[EpisodeFrame]:
        """Return the present frames of all robots."""
        return [self.simulator.frame(self.now, row) for row in range(self.count)]

    def close(self) -> None:
        """Release the simulator, and compiled and recorded functions, which refer to these."""
        self._device_law = self._recorded = None
        if self.cameras is not None:
            self.cameras.close()
        self.simulator.close()

    def _set(self, scene: Scene) -> None:
        self._scene = scene
        if self._recorded is not None:
            self._recorded.begin(scene)

    def _result(self, verdict: EpisodeOutcome, final: Tensor, observation: Tensor) -> StepResult:
        """Return the result of a step as tensors."""
        facts = verdict.facts
        numbers = namespace(verdict.reward).stack((verdict.reward, *facts.values()))
        # one conversion for all
        reward, *others = self._as_tensor(numbers, none=float("nan"))
        return StepResult(
            observation=observation,
            reward=reward,
            terminated=self._flag(verdict.terminated),
            truncated=self._flag(verdict.truncated),
            final=final,
            success=self._flag(verdict.success),
            facts=dict(zip(facts, others, strict=True)),
        )

    def _as_action(self, action: Tensor) -> Array:
        """Return an action as the simulator takes it, clipped to -1 to 1."""
        like = self.simulator.like
        if isinstance(like, np.ndarray):
            # of a few numbers NumPy makes these in a tenth of PyTorch's time
            numbers: Array = np.asarray(action.detach().cpu().numpy(), dtype=float)
            return np.minimum(np.maximum(numbers, -1.0), 1.0)
        held = action.detach().clamp(-1.0, 1.0)
        return held.to(device=like.device, dtype=like.dtype)

    def _as_tensor(self, values: Array, none: float = 0.0, most: float | None = None) -> Tensor:
        """Convert to a float32 tensor; numbers that are not finite become `none`, then within most.

        Args:
            values: any shape.
            none: what stands for them.
            most: largest size of a number; None for any.
        """
        import torch

        if isinstance(values, np.ndarray):
            with np.errstate(over="ignore"):
                held = values.astype(np.float32)
            finite = np.isfinite(held)
            if not finite.all():
                held = np.where(finite, held, np.float32(none))
            if most is not None:
                held = np.minimum(np.maximum(held, np.float32(-most)), np.float32(most))
            return torch.from_numpy(held).to(self.device)
        if not is_tensor(values):
            xp = namespace(values)
            held = xp.where(xp.isfinite(values), values, none)
            traced: Tensor = held if most is None else xp.minimum(xp.maximum(held, -most), most)
            return traced
        tensor = torch.nan_to_num(values.to(self.device, torch.float32), none, none, none)
        return tensor if most is None else tensor.clamp(-most, most)

    def _refuse_undefined(self, what: str, values: Any) -> None:
        """Refuse numbers that are not finite; nobody waits for those on an accelerator.

        Raises:
            PhysicsError: an environment has one.
        """
        if on_accelerator(values):
            return
        # NumPy's look at a few numbers takes a fraction of PyTorch's
        values = values if type(values) is np.ndarray else values.detach().numpy()
        if np.isfinite(values).all():
            return
        xp = namespace(values)
        odd = ~xp.isfinite(xp.reshape(values, (self.count, -1)))
        if bool(odd.any()):
            k = int(np.flatnonzero(np.asarray(odd).any(axis=1))[0])
            advice = f"Make the task return a finite {what}: seals.check_task(NAME) tests it."
            if what == "action":
                advice = "Check the policy: its network has diverged, or its inputs are invalid."
            where = f"({type(self.task).__name__})"
            refuse_not_finite([f"the {what} of environment {k}"], where, advice)

    def _flag(self, flags: Array) -> Tensor:
        import torch

        if isinstance(flags, np.ndarray):
            return torch.from_numpy(flags).to(self.device)
        found: Tensor = flags.to(self.device) if is_tensor(flags) else flags
        return found

    def _observation(self, now: Instant) -> Tensor:
        return self._seen(now, self._values(now))

    def _values(self, now: Instant) -> Array:
        """Return what is observed, shape (N, observation_size)."""
        return self.task.observation(now)

    def _seen(self, now: Instant, values: Array) -> Tensor:
        """Return observations as tensors, where the positions are known."""
        xp = namespace(values)
        # arrays of NumPy are there; tensors may be recorded, or be waited for
        there = isinstance(values, np.ndarray) or not self.simulator.pure
        if there and not bool(xp.all(xp.isfinite(values))):
            known = xp.all(xp.isfinite(now.position), axis=1, keepdims=True)
            self._refuse_undefined("observation", xp.where(known, values, xp.zeros_like(values)))
        return self._as_tensor(values, most=FARTHEST)


def _plain(value: Any) -> Any:
    """Return tuples as lists and mappings as dicts; tensors and numbers stay.

    Example:
        >>> _plain((1, {"a": (2.0, None)}))
        [1, {'a': [2.0, None]}]
    """
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    if isinstance(value, np.ndarray):
        import torch

        return torch.from_numpy(value.copy())
    return value


def _rebuilt(kept: Any, like: Any) -> Any:
    """Convert plain data to the structure of another value, on the device of its tensors.

    Example:
        >>> _rebuilt([1, {"a": [2.0, None]}], (0, {"a": (0.0, None)}))
        (1, {'a': (2.0, None)})
    """

    def leaf(now: Any, old: Any) -> Any:
        if isinstance(now, np.ndarray):
            return old.cpu().numpy().copy()
        return old.to(now.device) if hasattr(now, "device") and hasattr(old, "to") else old

    return mapped(like, leaf, kept)
