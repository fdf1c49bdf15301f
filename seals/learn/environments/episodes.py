"""Bookkeeping of episodes: how long, how far, held for how long, won or lost."""

from __future__ import annotations

from typing import Any, NamedTuple

from seals.arrays import Array, namespace
from seals.learn.task import Instant, Task, extras

FARTHEST = 1e3
"""Largest number of an observation, and distance beyond which a flight is lost [m]."""


class Ledger(NamedTuple):
    """What is known of N episodes under way.

    Args:
        steps: control steps done, shape (N, 1).
        streak: steps within each distance without a break, shape (N, k).
        won: 1 where a streak was long enough once, shape (N, k).
        total: sum of the rewards, shape (N, 1).
        memory: of the task's reward, shape (N, 2).
    """

    steps: Array
    streak: Array
    won: Array
    total: Array
    memory: Array


class Verdict(NamedTuple):
    """What one control step did to N episodes.

    Args:
        reward: (N,).
        terminated: bool (N,).
        truncated: bool (N,).
        success: bool (N,): the task's own distance was held for long enough, up to now.
        facts: numbers by name, (N,) each.
    """

    reward: Array
    terminated: Array
    truncated: Array
    success: Array
    facts: dict[str, Array]


class Episodes:
    """Keeps count of episodes of one task; the laws know no array library.

    Args:
        task: bound.
    """

    def __init__(self, task: Task) -> None:
        """Find the thresholds once."""
        self.task = task
        self._names = list(extras(task))
        self._distances = list(extras(task).values())
        self._hold = max(1, round(task.hold * task.rate))
        self.steps = max(1, round(task.duration * task.rate))

    def start(self, now: Instant) -> Ledger:
        """Return the books of episodes that begin."""
        zero = now.position[:, 0:1] * 0.0
        xp = namespace(zero)
        columns = xp.concat([zero] * len(self._names), axis=1)
        return Ledger(zero, columns, columns, zero, xp.concat((zero, zero), axis=1))

    def judge(self, now: Instant, before: Instant, books: Ledger) -> tuple[Verdict, Ledger]:
        """Return what a control step did, and the new books."""
        xp = namespace(now.position)
        distance = self.task.distance(now)
        reward, memory = self.task.reward(now, before, books.memory)
        near = [xp.astype(distance < d, distance.dtype)[:, None] for d in self._distances]
        within = xp.concat(near, axis=1)
        streak = (books.streak + 1.0) * within
        won = xp.maximum(books.won, xp.astype(streak >= self._hold, streak.dtype))
        steps = books.steps + 1.0
        kept = Ledger(steps, streak, won, books.total + reward[:, None], memory)
        terminated = self.task.ended(now, memory)
        success = won[:, len(self._names) - 1] > 0.5
        if getattr(self.task, "over_with_success", False):
            terminated = terminated | success
        truncated = (steps[:, 0] >= self.steps) & ~terminated
        facts: dict[str, Any] = {"distance": distance, "return": kept.total[:, 0]}
        facts |= {name: won[:, k] for k, name in enumerate(self._names)}
        facts["time"] = now.time[:, 0]
        return Verdict(reward, terminated, truncated, success, facts), kept
