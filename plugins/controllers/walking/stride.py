"""Toe trajectory over one gait cycle, and the cycle frequency for a wanted velocity."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from seals.arrays import Array, Floats, namespace
from seals.state_records import state_record


@state_record
class Walk(NamedTuple):
    """Wanted body velocity and yaw rate of a gait, body axes.

    Args:
        ahead: along x [m/s].
        aside: along y [m/s].
        turn: about z [rad/s].
    """

    ahead: float
    aside: float
    turn: float

    def at(self, places: Array) -> Array:
        """Return the velocity of body-fixed points [m/s], shape (N, 2)."""
        x, y = places[:, 0], places[:, 1]
        both = (self.ahead - self.turn * y, self.aside + self.turn * x)
        return namespace(places).stack(both, axis=1)

    def fastest(self, places: Floats) -> float:
        """Return the largest speed among body-fixed points [m/s]."""
        # a few numbers: faster one by one than as arrays
        return max(
            math.hypot(self.ahead - self.turn * p[1], self.aside + self.turn * p[0])
            for p in places.tolist()
        )

    def times(self, share: float) -> Walk:
        """Return the walk scaled by a factor."""
        return Walk(share * self.ahead, share * self.aside, share * self.turn)


def cadence(
    walk: Walk, places: Floats, *, duty: float, stroke: float, low: float, high: float
) -> tuple[float, Walk]:
    """Return the cycle frequency [Hz], and the walk limited to what it allows.

    The legs cycle as fast as strokes of a length need; a walk that needs more than the highest
    frequency is shortened.

    Args:
        walk: wanted.
        places: of the toes in the middle of their strokes [m], shape (N, 2) or more columns.
        duty: share of the cycle on the ground [1].
        stroke: way of a toe on the ground, in body axes [m].
        low: lowest frequency [Hz].
        high: highest frequency [Hz].
    """
    needed = walk.fastest(places) * duty / stroke
    if needed > high:
        return high, walk.times(high / needed)
    return max(needed, low), walk


def toes_of(
    phase: Array, places: Array, walk: Walk, *, frequency: Any, duty: Any, lift: Any
) -> Array:
    """Return the wanted toe positions, body axes [m], shape (N, 3).

    On the ground a toe goes back as fast as the body goes on; in the air it comes forward on a
    cycloid, at rest against the body when it leaves and when it lands.

    Args:
        phase: share of the cycle, 0 where a toe lands, shape (N,).
        places: of the toes in the middle of their strokes, on the ground [m], shape (N, 3).
        walk: of the body.
        frequency: of the cycle [Hz].
        duty: share of the cycle on the ground [1].
        lift: height of the toes in the middle of their way through the air [m].
    """
    xp = namespace(places)
    share = duty / frequency
    way = walk.at(places) * (share if isinstance(share, float) else share[..., None])
    swing = xp.clip(phase - duty, 0.0, None) / (1.0 - duty)
    back = 0.5 - xp.clip(phase / duty, None, 1.0)
    turn = 2.0 * math.pi * swing
    along = back + swing - xp.sin(turn) / (2.0 * math.pi)
    level = places[:, :2] + along[:, None] * way
    height = places[:, 2] + 0.5 * lift * (1.0 - xp.cos(turn))
    return xp.concat((level, height[:, None]), axis=1)
