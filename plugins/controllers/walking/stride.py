"""Way of the toes over a gait cycle, and the cycle frequency for a velocity; batch first."""

from __future__ import annotations

import math
from typing import Any

from seals.arrays import Array, namespace


def cadence(
    walk: Array, places: Array, *, duty: Any, stroke: Any, low: Any, high: Any
) -> tuple[Array, Array]:
    """Return the cycle frequency [Hz], shape (B, 1), and the walk limited to what it allows.

    The legs cycle as fast as strokes of a length need; a walk that needs more than the highest
    frequency is shortened.

    Args:
        walk: wanted, body axes: ahead and aside [m/s], turn [rad/s], shape (B, 3).
        places: of the toes in the middle of their strokes [m], shape (B, N, 2) or more columns.
        duty: share of the cycle on the ground [1], a number or shape (B, 1), as all others.
        stroke: way of a toe on the ground, in body axes [m].
        low: lowest frequency [Hz].
        high: highest frequency [Hz].
    """
    xp, (x, y) = namespace(walk), _speeds(walk, places)
    needed = xp.max(xp.sqrt(x * x + y * y), axis=1, keepdims=True) * duty / stroke
    high, low = needed * 0.0 + high, needed * 0.0 + low
    short = xp.where(needed > high, high / xp.maximum(needed, high), high * 0.0 + 1.0)
    return xp.where(needed > high, high, xp.maximum(needed, low)), walk * short


def _speeds(walk: Array, places: Array) -> tuple[Array, Array]:
    """Velocity of body-fixed points along x and y [m/s], shape (B, N) each."""
    turn = walk[:, 2:3]
    return walk[:, 0:1] - turn * places[:, :, 1], walk[:, 1:2] + turn * places[:, :, 0]


def toes_of(
    phase: Array, places: Array, walk: Array, *, frequency: Any, duty: Any, lift: Any
) -> Array:
    """Return the wanted toe positions, body axes [m], shape (B, N, 3).

    On the ground a toe goes back as fast as the body goes on; in the air it comes forward on a
    cycloid, at rest against the body when it leaves and when it lands.

    Args:
        phase: share of the cycle, 0 where a toe lands, shape (B, N).
        places: of the toes in the middle of their strokes, on the ground [m], shape (B, N, 3).
        walk: of the body: ahead and aside [m/s], turn [rad/s], shape (B, 3).
        frequency: of the cycle [Hz], a number or shape (B, 1), as all others.
        duty: share of the cycle on the ground [1].
        lift: height of the toes in the middle of their way through the air [m].
    """
    xp, share = namespace(places), duty / frequency
    swing = xp.clip(phase - duty, 0.0, None) / (1.0 - duty)
    back = 0.5 - xp.clip(phase / duty, None, 1.0)
    turn = 2.0 * math.pi * swing
    along = back + swing - xp.sin(turn) / (2.0 * math.pi)
    x, y = (along * (share * speed) for speed in _speeds(walk, places))
    height = places[:, :, 2] + 0.5 * lift * (1.0 - xp.cos(turn))
    return xp.stack((places[:, :, 0] + x, places[:, :, 1] + y, height), axis=2)
