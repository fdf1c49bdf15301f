"""Reward forms of reaching tasks: that of the paper, shaped, progress, none."""

from __future__ import annotations

import enum
from typing import Protocol

from seals.arrays import Array, namespace
from seals.learn.task import Instant
from seals.schema import setting

INNER = 1.0
"""Distance below which the paper's reward grows as 1 / d [m]."""
OVERSPEED = -5.0
"""Penalty of the paper for a robot that is too fast."""


class Reward(enum.Enum):
    """Kind of reward.

    ``paper``: three regions over five orders of magnitude. ``shaped``: minus the distance, with a
    bounded bonus near the target. ``progress``: the distance that a step gained, with that bonus.
    ``none``: nothing, for a control.
    """

    paper = "paper"
    shaped = "shaped"
    progress = "progress"
    none = "none"


class Judged(Protocol):
    """Interface of a task with selectable reward form."""

    reward_form: Reward
    success_distance: float
    overspeed: float
    hold: float
    rate: float


def unshaped(
    task: Judged, now: Instant, distance: Array, memory: Array
) -> tuple[Array, Array] | None:
    """Return rewards (N,) and state of a form common to all tasks, or None for a task's own form.

    Args:
        task: which is asked for.
        now: after the step.
        distance: what is judged [m], shape (N,).
        memory: of the paper's reward, shape (N, 2).

    Returns:
        None where the task gives a reward of its own.
    """
    if task.reward_form is Reward.none:
        return distance * 0.0, memory
    if task.reward_form is not Reward.paper:
        return None
    return paper_reward(
        distance,
        length(now.velocity),
        memory,
        close=task.success_distance,
        fastest=task.overspeed,
        patience=task.hold * task.rate,
    )


def paper_reward(
    distance: Array, speed: Array, memory: Array, *, close: float, fastest: float, patience: float
) -> tuple[Array, Array]:
    """Return the reward of the paper's appendix, shape (N,), and the new state.

    Equation:
        exp(-d) outside 1 m; 1 / d inside; 1000 / d_t within d_t; -5 above the largest speed;
        -1000 / d_t on leaving the success region within some steps of reaching it.

    Args:
        distance: d [m], shape (N,).
        speed: of the robot [m/s], shape (N,).
        memory: column 0: 1 while within d_t; column 1: steps since it was reached; shape (N, 2).
        close: d_t [m].
        fastest: largest speed without penalty [m/s].
        patience: steps within which leaving is punished.
    """
    xp = namespace(distance)
    one = distance * 0.0 + 1.0
    inner = 1.0 / xp.maximum(distance, one * close)
    reward = xp.where(distance > INNER, xp.exp(-distance), inner)
    inside = distance < close
    reward = xp.where(inside, one * (1000.0 / close), reward)
    reward = xp.where(speed > fastest, reward + OVERSPEED, reward)
    was, since = memory[:, 0] > 0.5, memory[:, 1]
    left = was & ~inside & (since <= patience)
    reward = xp.where(left, reward - 1000.0 / close, reward)
    since = xp.where(inside & was, since + 1.0, one * 0.0)
    return reward, xp.stack((xp.astype(inside, distance.dtype), since), axis=1)


def length(vectors: Array) -> Array:
    """Return the lengths of vectors (N, 3), shape (N,)."""
    xp = namespace(vectors)
    return xp.sqrt(xp.sum(vectors * vectors, axis=1))


def near(distance: Array, width: float) -> Array:
    """Return a bonus, 1 at the target and decaying over ``width`` [m], shape (N,)."""
    xp = namespace(distance)
    return xp.exp(-((distance / width) ** 2))


def chosen(default: float, unit: str, low: float, high: float, why: str) -> float:
    """Return the field of a task's number that was chosen for a reason."""
    return setting(default, unit, bounds=(low, high), source=f"chosen: {why}")
