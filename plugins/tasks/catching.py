"""Scripted diver that fetches an animal: a memoryless policy of the present state.

The hand reaches ahead of the body, along x. An animal that flees from the body then runs that way,
at a steady pace that the hand can follow, and not back and forth beneath it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from seals.arrays import Array, namespace
from seals.learn.task import Instant
from seals.plugins.tasks.observation import level_hand_offset

if TYPE_CHECKING:
    from seals.plugins.tasks.catch import TaskCatch

GAIN = 1.2
"""Of the velocity against the distance [1/s]."""
SIDE = 2.0
"""The same across the hand's reach: an animal that flees from the body behind it breaks away there,
at its speed over the reach, which this must exceed [1/s]."""
CLEAR = 0.2
"""Height of the open hand above the animal while it is not over it [m]."""
FUNNEL = 4.0
"""Rise of that height with the horizontal distance [1]."""
OVER = 0.03
"""Horizontal distance at which the hand is over the animal [m]."""
LOW = -0.004
"""Height of the open hand's tips above the animal's origin at which it closes: the tips then go
down by 13 mm and hold below the widest part of a carapace [m]."""
AT = (0.013, 0.12)
"""Distance, horizontal and vertical, at which the hand closes [m], and its rise with the animal's
pace [s]: a still one is held best in the middle, and one that runs is not to be waited for."""
EMPTY = 0.95
"""Closure of fingers that have met each other [1]."""
SLOW = 0.15
"""Largest speed down to the animal near it [m/s]."""
PACE = 0.12
"""Speed of an animal that is followed; what a hand jostles moves faster and is not [m/s]."""
LEAD = 3.5
"""By which the level hand leads an animal, because the hand itself trails behind a body that leans
against drag: distance over speed squared [s^2/m]."""
BESIDE = 0.5
"""Share of the animal's pace across the hand's reach that is followed: all of it would swing on,
because an animal that flees answers to every move [1]."""
EASE = 0.35
"""Share of a change of the horizontal velocity that is asked for in a control step: an animal's
pace comes and goes with its strides, and a body that followed that would swing its hand [1]."""
CALM = (0.1, 1.0)
"""Lean, as the sine of it, above which a hand swings too far to close [1], and its rise with the
pace [s/m]: a body leans against its drag."""
SWING = (0.25, 1.5)
"""Spin of the body above which it swings too fast to close [rad/s], and its rise [rad/m]."""
LIFT = 0.35
"""Speed of the lift [m/s]."""
JERK = 0.08
"""By which the wanted speed of the lift is above the present one [m/s]."""
LOOK = 1.1
"""Height above the water from which it looks for what it does not see [m]."""
RING = 0.4
"""Radius of the ring on which it looks [m]."""
LAP = 8.0
"""Time of a lap on that ring [s]."""


def fetch(task: TaskCatch, now: Instant, seen: Array) -> Array:
    """Return actions: search, follow, descend, close, lift; begin again when it slipped away.

    The last action is its memory: a hand that has begun to close goes on, and one that has begun
    to open does, too.

    Args:
        task: with speeds, sizes and times.
        now: with the facts ``grip``, ``closed``, ``touch`` and ``level``.
        seen: 1 where the animal is seen, shape (N, 1).
    """
    xp = namespace(now.position)
    away, grip = now.target - now.tool, now.facts["grip"]
    flat = xp.sqrt(xp.sum(away[:, :2] * away[:, :2], axis=1, keepdims=True))
    level = now.target - now.position - level_hand_offset(now)
    far = xp.sqrt(xp.sum(away * away, axis=1, keepdims=True))
    there = seen > 0.5
    fast = _speed(now)
    at = AT[0] + AT[1] * fast
    below = xp.abs(away[:, 2:3] + LOW) < at
    open_ = grip < 1.0 / (task.rate * task.closing)
    ready = there & open_ & (flat < at) & below & _calm(now, fast)
    begun = now.action[:, 3:4] > 0.0
    # the fingers have come to something, or to each other
    shut = (grip > 1.0 - 1e-6) | (grip - now.facts["closed"] > task.squeeze - 0.02)
    empty = now.facts["closed"] > EMPTY
    closing = ready | (begun & ~(shut & ((far > task.grasp) | empty)))
    firm = xp.astype(now.facts["touch"] > task.firm, far.dtype)
    # one finger alone would push it over
    lifting = closing & shut & (xp.sum(firm, axis=1, keepdims=True) > 1.5)
    pace = _pace(now, closing)
    follow = _follow(level + _lead(pace), flat, grip, closing) + pace
    velocity = xp.where(there, follow, away * 0.0)
    velocity = xp.where(there | closing, velocity, _search(now))
    velocity = xp.where(lifting, _lift(now, task.height), velocity)
    one = grip * 0.0 + 1.0
    flat = now.action[:, :2] + EASE * (velocity[:, :2] / task.speed - now.action[:, :2])
    wanted = xp.concat((flat, velocity[:, 2:3] / task.speed, xp.where(closing, one, -one)), axis=1)
    bound = wanted * 0.0 + 1.0
    return xp.minimum(xp.maximum(wanted, -bound), bound)


def _speed(now: Instant) -> Array:
    """Horizontal speed of the animal, up to that at which it is followed [m/s], shape (N, 1)."""
    xp = namespace(now.position)
    flat = now.target_velocity[:, :2]
    fast = xp.sqrt(xp.sum(flat * flat, axis=1, keepdims=True))
    return xp.minimum(fast, fast * 0.0 + PACE)


def _calm(now: Instant, fast: Array) -> Array:
    """Test if the body is level and slow enough for the hand to stay in place, shape (N, 1)."""
    xp = namespace(now.position)
    lean, turn = now.rotation[:, 2, 0:2], now.angular_velocity[:, 0:2]
    most, spin = CALM[0] + CALM[1] * fast, SWING[0] + SWING[1] * fast
    level = xp.sum(lean * lean, axis=1, keepdims=True) < most * most
    return level & (xp.sum(turn * turn, axis=1, keepdims=True) < spin * spin)


def _pace(now: Instant, closing: Array) -> Array:
    """Feedforward velocity: that of the animal; while the hand closes, that of the hand [m/s].

    A hand that went along with what it jostles would jostle it the more, and one that changed its
    pace while it closes would swing.
    """
    xp = namespace(now.position)
    own = xp.concat((now.velocity[:, :2], now.velocity[:, 2:3] * 0.0), axis=1)
    pace = xp.where(closing, own, now.target_velocity)
    most = pace * 0.0 + PACE
    pace = xp.minimum(xp.maximum(pace, -most), most)
    return xp.concat((pace[:, 0:1], BESIDE * pace[:, 1:2], pace[:, 2:3]), axis=1)


def _lead(pace: Array) -> Array:
    """Distance by which a hand trails behind a body at a pace along its reach [m], shape (N, 3)."""
    xp = namespace(pace)
    ahead = pace[:, 0:1]
    return xp.concat((LEAD * ahead * xp.abs(ahead), ahead * 0.0, ahead * 0.0), axis=1)


def _follow(away: Array, aside: Array, grip: Array, closing: Array) -> Array:
    """Velocity relative to the animal: to a place above it, then down within a cone [m/s].

    Args:
        away: way of the level hand to it [m], shape (N, 3).
        aside: horizontal distance of the hand itself [m], shape (N, 1).
        grip: that is wanted [1], shape (N, 1).
        closing: whether the hand closes, shape (N, 1).
    """
    xp = namespace(away)
    # open fingers of a hand that swings would knock it over
    flat = xp.maximum(xp.sqrt(xp.sum(away[:, :2] * away[:, :2], axis=1, keepdims=True)), aside)
    zero = flat * 0.0
    above = xp.minimum(xp.maximum(FUNNEL * (flat - OVER), zero), zero + CLEAR)
    # a hand that opens goes up first
    above = xp.where((grip > 0.0) & ~closing, zero + CLEAR, above)
    gap = away[:, 2:3] + LOW + above
    down = xp.maximum(GAIN * gap, zero - SLOW - 1.5 * xp.maximum(-gap - CLEAR, zero))
    return xp.concat((GAIN * away[:, 0:1], SIDE * away[:, 1:2], down), axis=1)


def _search(now: Instant) -> Array:
    """Velocity to a circle above the water, and along it [m/s]."""
    xp = namespace(now.position)
    turn = 2.0 * math.pi * now.time / LAP
    level = now.facts["level"]
    place = xp.concat((RING * xp.cos(turn), RING * xp.sin(turn), level + LOOK), axis=1)
    return GAIN * (place - now.position)


def _lift(now: Instant, height: float) -> Array:
    """Upward velocity, up to 1.5 times the height that the animal must reach [m/s]."""
    xp = namespace(now.position)
    end = now.facts["level"] + 1.5 * height
    up = xp.minimum(GAIN * (end - now.target[:, 2:3]), end * 0.0 + LIFT)
    up = xp.minimum(up, xp.maximum(now.velocity[:, 2:3], end * 0.0) + JERK)
    return xp.concat((up * 0.0, up * 0.0, up), axis=1)
