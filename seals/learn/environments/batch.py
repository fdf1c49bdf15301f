"""Batch of environments that are one state: starts from seeds, verdicts, results of a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from seals.arrays import Array, namespace
from seals.learn.batched import StepResult
from seals.learn.environments.episodes import FARTHEST, EpisodeOutcome, Episodes, EpisodeState
from seals.learn.task import Draw, Instant, Task

if TYPE_CHECKING:
    from torch import Tensor


class Scene(NamedTuple):
    """State of N environments.

    Args:
        robots: what moves them, as the batch has it.
        goal: numbers from which the task knows the target, shape (N, g).
        now: what is the case.
        ledger: of the episodes.
    """

    robots: Any
    goal: Array
    now: Instant
    ledger: EpisodeState


class BatchEnvironments:
    """Part of N environments of one task that does not depend on what moves the robots.

    Args:
        task: bound to the robot.
        count: N.
        device: of all tensors.
        seed: of the starts that are not asked for by seed.
    """

    pixels: tuple[int, int, int] | None = None

    def __init__(self, task: Task, *, count: int, device: str, seed: int) -> None:
        """Store the sizes; there is no scene before the first reset."""
        self.task, self.count, self.device = task, count, device
        self.episodes = Episodes(task)
        self.observation_size = len(task.observation_names)
        self.action_size = len(task.action_names)
        self._rng = np.random.default_rng(seed)
        self._scene: Any = None

    @property
    def now(self) -> Instant:
        """Present state of all robots."""
        found: Instant = self._scene.now
        return found

    def scripted_policy(self) -> Tensor:
        """Return the actions of the task's scripted policy, shape (N, a)."""
        return self._as_tensor(self.task.scripted_policy(self._scene.now))

    def _drawn(self, seeds: Sequence[int] | None) -> Draw:
        """Return starts of all environments, each from its own seed where seeds are given."""
        if seeds is None:
            return self.task.draw(self._rng, self.count)
        draws = [self.task.draw(np.random.default_rng(s), 1) for s in seeds]
        return Draw(*(np.concatenate(column) for column in zip(*draws, strict=True)))

    def _drawn_where(self, ended: Any) -> Draw:
        """Return starts where a mask of NumPy says so, and zeros elsewhere."""
        index = np.flatnonzero(ended)
        few = self.task.draw(self._rng, len(index))
        full = [np.zeros((self.count, x.shape[1])) for x in few]
        for whole, part in zip(full, few, strict=True):
            whole[index] = part
        return Draw(*full)

    def _judged(
        self, now: Instant, before: Instant, ledger: EpisodeState
    ) -> tuple[EpisodeOutcome, Array, EpisodeState]:
        """Return the verdict on a step, which episodes ended, and the new ledger."""
        verdict, ledger = self.episodes.assess(now, before, ledger)
        xp = namespace(now.position)
        # nothing compares with what is not a number
        lost = ~xp.all(xp.abs(now.position) < FARTHEST, axis=1)
        terminated = verdict.terminated | lost
        ended = terminated | verdict.truncated
        verdict = verdict._replace(
            terminated=terminated,
            truncated=verdict.truncated & ~lost,
            success=verdict.success & ended & ~lost,
        )
        return verdict, ended, ledger

    def _result(self, verdict: EpisodeOutcome, final: Tensor, observation: Tensor) -> StepResult:
        """Return the result of a step as tensors."""
        return StepResult(
            observation=observation,
            reward=self._as_tensor(verdict.reward),
            terminated=_flag(verdict.terminated),
            truncated=_flag(verdict.truncated),
            final=final,
            success=_flag(verdict.success),
            facts={
                name: self._as_tensor(x, none=float("nan")) for name, x in verdict.facts.items()
            },
        )

    def _as_tensor(self, values: Array, none: float = 0.0) -> Tensor:
        """Convert to a float32 tensor; numbers that are not finite become `none`."""
        import torch

        tensor = torch.from_numpy(values) if isinstance(values, np.ndarray) else values
        return torch.nan_to_num(tensor.to(torch.float32), none, none, none)

    def _observation(self, now: Instant) -> Tensor:
        return self._as_tensor(self.task.observation(now)).clamp(-FARTHEST, FARTHEST)


def _flag(flags: Array) -> Tensor:
    import torch

    found: Tensor = torch.from_numpy(flags) if isinstance(flags, np.ndarray) else flags
    return found


def picked(fresh: Any, other: Any, ended: Array) -> Any:
    """Select rows of one tuple of arrays by the mask ``ended`` (N,), else of another."""
    xp = namespace(ended)
    out = []
    for a, b in zip(fresh, other, strict=True):
        if isinstance(b, Mapping):
            out.append(b)
            continue
        mask = xp.reshape(ended, (-1, *[1] * (b.ndim - 1)))
        out.append(xp.where(mask, a, b))
    return type(other)(*out) if hasattr(other, "_fields") else tuple(out)
