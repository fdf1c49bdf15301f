"""Behaviours over a batch of animals, for learning in many worlds at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

from seals.arrays import Array, namespace

Memory = tuple[Array, ...]
Chance = Callable[[int], Array]
"""Returns uniform random numbers from 0 to 1, shape (B, k)."""
HOMEWARD = 0.25
"""Share of a random direction that is left in a bout that leads home [1]."""


class BatchBehaviour(Protocol):
    """Behaviour of B animals; arrays of B rows on any array library."""

    def start(self, place: Array, time: Array) -> Memory:
        """Return the initial memory for places [m] (B, 3) and times [s] (B, 1)."""

    def aim(
        self, place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        """Return the wanted velocities, world axes [m/s], shape (B, 3), and the new memory.

        Args:
            place: of the animals, world [m], shape (B, 3).
            enemy: what they may flee from, world [m], shape (B, 3).
            time: since the start [s], shape (B, 1).
            memory: of the last call.
            chance: random numbers.
        """


class BatchFreeze:
    """Animals that stay in place."""

    def start(self, place: Array, time: Array) -> Memory:
        """Return nothing to remember."""
        return ()

    def aim(
        self, place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        """Return zero velocities."""
        return place * 0.0, ()


class BatchFlee:
    """Animals that flee as `Flee` does.

    Args:
        flee: the behaviour.
    """

    def __init__(self, flee: Any) -> None:
        self._flee = flee

    def start(self, place: Array, time: Array) -> Memory:
        """Return that none of them runs."""
        return (time * 0.0,)

    def aim(
        self, place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        """Return velocities away from the enemies, or zero."""
        xp, flee = namespace(place), self._flee
        away = place - enemy
        near = xp.sqrt(xp.sum(away * away, axis=1, keepdims=True))
        one = near * 0.0 + 1.0
        reach = xp.where(memory[0] > 0.5, flee.calm * one, flee.alarm * one)
        runs = xp.astype(near < reach, one.dtype)
        return _velocity(xp.atan2(away[:, 1:2], away[:, 0:1]), flee.speed * runs), (runs,)


class BatchWander:
    """Animals that wander as `Wander` does.

    Args:
        wander: the behaviour.
    """

    def __init__(self, wander: Any) -> None:
        self._wander = wander

    def start(self, place: Array, time: Array) -> Memory:
        """Return number and end of the bout, direction and home: the first bout is due."""
        return (time * 0.0, time + 0.0, time * 0.0, place[:, :2] + 0.0)

    def aim(
        self, place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        """Return the velocities of the present bouts."""
        xp, w = namespace(place), self._wander
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


class BatchShy:
    """Animals some of which flee, see `Shy`; which, is drawn at their first step.

    Args:
        share: of the animals that flee [1].
        wander: of the others.
        flee: of those.
    """

    def __init__(self, share: float, wander: BatchWander, flee: BatchFlee) -> None:
        self._share, self._wander, self._flee = share, wander, flee

    def start(self, place: Array, time: Array) -> Memory:
        """Return the memories of wandering and fleeing, and that nothing is drawn."""
        return (
            time * 0.0,
            *self._flee.start(place, time),
            *self._wander.start(place, time),
        )

    def aim(
        self, place: Array, enemy: Array, time: Array, memory: Memory, chance: Chance
    ) -> tuple[Array, Memory]:
        """Return the velocities of all animals."""
        xp = namespace(place)
        flees, runs, *wander = memory
        drawn = xp.astype(chance(1) < self._share, place.dtype)
        flees = xp.where(wander[0] < 0.5, drawn, flees)
        away, (runs,) = self._flee.aim(place, enemy, time, (runs,), chance)
        way, wander_on = self._wander.aim(place, enemy, time, tuple(wander), chance)
        return xp.where(flees > 0.5, away, way), (flees, runs, *wander_on)


def _velocity(way: Array, speed: Array) -> Array:
    """Return horizontal velocities of a direction [rad] and a speed [m/s], shape (B, 3)."""
    xp = namespace(way)
    return xp.concat((speed * xp.cos(way), speed * xp.sin(way), speed * 0.0), axis=1)
