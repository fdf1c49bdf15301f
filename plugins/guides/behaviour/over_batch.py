"""Behaviours over a batch of animals, for learning in many worlds at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from seals.arrays import Array, namespace

Memory = tuple[Array, ...]
Chance = Callable[[int], Array]
"""Returns uniform random numbers from 0 to 1, shape (B, k)."""
HOMEWARD = 0.25
"""Share of a random direction that is left in a bout that leads home [1]."""


class OverBatch(NamedTuple):
    """Behaviour of B animals; arrays of B rows on any array library.

    Args:
        start: returns the initial memory for places [m] (B, 3) and times [s] (B, 1).
        aim: returns the wanted velocities, world axes [m/s], shape (B, 3), and the new memory, for
            the places of the animals, those of what they may flee from, world [m], (B, 3), times
            since the start [s], (B, 1), the memory of the last call, and `Chance`.
    """

    start: Callable[[Array, Array], Memory]
    aim: Callable[[Array, Array, Array, Memory, Chance], tuple[Array, Memory]]


def fleeing(flee: Any) -> OverBatch:
    """Return animals that flee as `Flee` does; the memory says which of them run."""

    def start(place: Array, time: Array) -> Memory:
        return (time * 0.0,)

    def aim(
        place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        xp = namespace(place)
        away = place - enemy
        near = xp.sqrt(xp.sum(away * away, axis=1, keepdims=True))
        one = near * 0.0 + 1.0
        reach = xp.where(memory[0] > 0.5, flee.calm * one, flee.alarm * one)
        runs = xp.astype(near < reach, one.dtype)
        return _velocity(xp.atan2(away[:, 1:2], away[:, 0:1]), flee.speed * runs), (runs,)

    return OverBatch(start, aim)


def wandering(w: Any) -> OverBatch:
    """Return animals that wander as `Wander` does; the first bout is due at the start.

    The memory holds number and end of the bout, direction and home.
    """

    def start(place: Array, time: Array) -> Memory:
        return (time * 0.0, time + 0.0, time * 0.0, place[:, :2] + 0.0)

    def aim(
        place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        xp = namespace(place)
        bouts, end, way, home = memory
        due, drawn = time >= end, chance(2)
        bouts = xp.where(due, bouts + 1.0, bouts)
        walks = bouts - 2.0 * xp.floor(0.5 * bouts)
        mean = w.pause + (w.walk - w.pause) * walks
        back = home - place[:, :2]
        far = xp.sqrt(xp.sum(back * back, axis=1, keepdims=True)) > w.radius
        turn = math.pi * (2.0 * drawn[:, 0:1] - 1.0)
        fresh = xp.where(far, xp.atan2(back[:, 1:2], back[:, 0:1]) + HOMEWARD * turn, turn)
        least = drawn[:, 1:2] * 0.0 + 1e-7
        length = -mean * xp.log(xp.maximum(drawn[:, 1:2], least))
        end, way = xp.where(due, time + length, end), xp.where(due, fresh, way)
        return _velocity(way, w.speed * walks), (bouts, end, way, home)

    return OverBatch(start, aim)


def partly(share: float, wander: OverBatch, flee: OverBatch) -> OverBatch:
    """Return animals of which a share flees, see `Shy`; which, is drawn at their first step."""

    def start(place: Array, time: Array) -> Memory:
        return (time * 0.0, *flee.start(place, time), *wander.start(place, time))

    def aim(
        place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        flees, runs, *bouts = memory
        drawn = namespace(place).astype(chance(1) < share, place.dtype)
        flees = namespace(place).where(bouts[0] < 0.5, drawn, flees)
        away, (runs,) = flee.aim(place, enemy, time, (runs,), chance)
        way, after = wander.aim(place, enemy, time, tuple(bouts), chance)
        return namespace(place).where(flees > 0.5, away, way), (flees, runs, *after)

    return OverBatch(start, aim)


STILL = OverBatch(
    lambda place, time: (), lambda place, enemy, time, memory, chance: (place * 0.0, ())
)
"""Animals that stay in place."""


def _velocity(way: Array, speed: Array) -> Array:
    """Return horizontal velocities of a direction [rad] and a speed [m/s], shape (B, 3)."""
    xp = namespace(way)
    return xp.concat((speed * xp.cos(way), speed * xp.sin(way), speed * 0.0), axis=1)
