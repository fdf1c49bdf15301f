"""Episode accounting: length, distance, time at the target, success and failure."""

from __future__ import annotations

from typing import Any, NamedTuple

from seals.arrays import Array, namespace
from seals.learn.task import Instant, Task, extras

FARTHEST = 1e3
"""Largest number of an observation, and distance beyond which a flight is lost [m]."""
UNKNOWN = float("nan")
LEAST_WAY = 1e-3
"""Way below which no cost of transport is worth the name [m]."""


class EpisodeState(NamedTuple):
    """State of N running episodes.

    Args:
        steps: control steps done, shape (N, 1).
        streak: steps within each distance without a break, shape (N, k).
        won: 1 where a streak was long enough once, shape (N, k).
        total: sum of the rewards, shape (N, 1).
        memory: of the task's reward, shape (N, 2).
        reached: time at which the task's own distance had been held [s], NaN before, shape (N, 1).
        effort: what the task says the steps up to then have cost, shape (N, 1).
        gained: distance come nearer by then [m], shape (N, 1).
    """

    steps: Array
    streak: Array
    won: Array
    total: Array
    memory: Array
    reached: Array
    effort: Array
    gained: Array


class EpisodeOutcome(NamedTuple):
    """Outcome of one control step for N episodes.

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
    """Episode accounting of one task, on any array library.

    Args:
        task: bound.
    """

    def __init__(self, task: Task) -> None:
        """Read the thresholds from the task."""
        self.task = task
        self._names = list(extras(task))
        self._distances = list(extras(task).values())
        self._hold = max(1, round(task.hold * task.rate))
        self.steps = max(1, round(task.duration * task.rate))

    def start(self, now: Instant) -> EpisodeState:
        """Return the state of N new episodes."""
        zero = now.position[:, 0:1] * 0.0
        xp = namespace(zero)
        columns = xp.concat([zero] * len(self._names), axis=1)
        memory = xp.concat((zero, zero), axis=1)
        return EpisodeState(zero, columns, columns, zero, memory, zero + UNKNOWN, zero, zero)

    def assess(
        self, now: Instant, before: Instant, ledger: EpisodeState
    ) -> tuple[EpisodeOutcome, EpisodeState]:
        """Return the outcome of a control step and the new episode state."""
        xp = namespace(now.position)
        distance = self.task.distance(now)
        reward, memory = self.task.reward(now, before, ledger.memory)
        near = [xp.astype(distance < d, distance.dtype)[:, None] for d in self._distances]
        within = xp.concat(near, axis=1)
        streak = (ledger.streak + 1.0) * within
        won = xp.maximum(ledger.won, xp.astype(streak >= self._hold, streak.dtype))
        steps = ledger.steps + 1.0
        total = ledger.total + reward[:, None]
        effort = self.task.effort(now)
        account = self._account(now, distance, effort, ledger, won[:, -1:] > 0.5)
        kept = EpisodeState(steps, streak, won, total, memory, *account)
        terminated = self.task.ended(now, memory)
        success = won[:, len(self._names) - 1] > 0.5
        if self.task.over_with_success:
            terminated = terminated | success
        truncated = (steps[:, 0] >= self.steps) & ~terminated
        facts: dict[str, Any] = {"distance": distance, "return": kept.total[:, 0]}
        facts |= {name: won[:, k] for k, name in enumerate(self._names)}
        facts |= {"time": now.time[:, 0], "reached_after": kept.reached[:, 0]}
        if effort is not None:
            done = kept.effort / xp.maximum(kept.gained, kept.gained * 0.0 + LEAST_WAY)
            known = xp.where(xp.isnan(kept.reached), kept.reached, done)
            facts["cost_of_transport"] = known[:, 0]
        return EpisodeOutcome(reward, terminated, truncated, success, facts), kept

    def _account(
        self, now: Instant, distance: Array, effort: Array | None, ledger: EpisodeState, won: Array
    ) -> tuple[Array, Array, Array]:
        """Return time, effort and distance up to the first success; they are constant afterwards.

        Args:
            now: after the step.
            distance: from the target [m], shape (N,).
            effort: of the step [m], shape (N,), or None.
            ledger: before the step.
            won: whether the target has been reached by now, shape (N, 1).
        """
        xp = namespace(distance)
        before = xp.isnan(ledger.reached)
        reached = xp.where(before & won, now.time, ledger.reached)
        if effort is None:
            return reached, ledger.effort, ledger.gained
        spent = ledger.effort + effort[:, None]
        gained = now.start - distance[:, None]
        return (
            reached,
            xp.where(before, spent, ledger.effort),
            xp.where(before, gained, ledger.gained),
        )
