"""Task place: pick an object from the sea bed and put it down in a basket."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, Floats, namespace
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.learn.task import Draw, Instant
from seals.plugins.tasks.catch import FUNNEL, GAIN, TaskCatch, lifted
from seals.plugins.tasks.observation import level_hand_offset
from seals.plugins.tasks.rewards import chosen

ABOVE = 0.12
"""Height of what is carried above the rim [m]."""
AIM = 0.05
"""Horizontal distance from the middle of the basket within which it is lowered [m]."""
HASTE = 0.3
"""Largest horizontal velocity with a full hand [m/s]."""
LOWER = 0.12
"""Largest velocity down to the basket [m/s]."""
_WAY = 1.5
"""Way that counts as the whole of it [m]."""


@roles(data="basket")
@dataclass(kw_only=True)
class TaskPlace(TaskCatch):
    """Pick an object from the sea bed and put it down in a basket; actions as in `TaskCatch`.

    An episode succeeds once the object has lain in the basket, below its rim, with the hand away
    from it, for ``hold`` without a break.

    Args:
        success_distance: what may be lacking of both distances [m].
        object: name of what is placed among the objects.
        basket: name of the basket among the objects.
        shelf: height of its floor, world [m].
        rim: height of its rim above that [m].
        inside: half of its width within which the object's origin must lie [m].
        clear: distance of the hand from an object that it has let go [m].
        near: least horizontal distance of the object from the basket at the start [m].
        far: largest [m].

    All other fields are those of `TaskCatch`; ``height`` and ``depth`` are not used.

    Example:
        >>> TaskPlace().observation_names[-3:]
        ('basket_x', 'basket_y', 'basket_z')
    """

    duration: float = chosen(40.0, "s", 0.1, 1e4, "twice the expert's time")
    object: str = "sample"
    basket: str = "basket"
    view: float = chosen(3.2, "rad", 0.01, 3.2, "its place is told")
    shelf: float = chosen(-1.0, "m", -1e4, 1e4, "the floor of the tank")
    rim: float = chosen(0.1, "m", 0.0, 10.0, "of the basket that ships")
    inside: float = chosen(0.15, "m", 1e-3, 10.0, "of the basket that ships")
    clear: float = chosen(0.1, "m", 0.0, 10.0, "hand beyond the grasp")
    near: float = chosen(0.5, "m", 0.0, 1e3, "beside the basket")
    far: float = chosen(0.8, "m", 0.0, 1e3, "in the tank")

    def __post_init__(self) -> None:
        """Refuse a basket that can be nowhere.

        Raises:
            ConfigError: the largest distance is below the least one.
        """
        super().__post_init__()
        if self.far < self.near:
            raise ConfigError(
                f"task.near={self.near:g} is above task.far={self.far:g}.\n"
                "Allowed: a least distance up to the largest."
            )

    @property
    def knows(self) -> tuple[str, ...]:
        """Quantities that observations use: those of a catch, and the draw."""
        return (*super().knows, "goal")

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the components of an observation, in order."""
        return (*super().observation_names, "basket_x", "basket_y", "basket_z")

    def draw(self, rng: np.random.Generator, count: int) -> Draw:
        """Return random starts, the pose of the object, and the place of the basket."""
        drawn = super().draw(rng, count)
        turn = rng.uniform(-math.pi, math.pi, (count, 1))
        away = rng.uniform(self.near, self.far, (count, 1))
        beside = drawn.goal[:, :2] + away * np.concatenate((np.cos(turn), np.sin(turn)), axis=1)
        return drawn._replace(goal=np.concatenate((drawn.goal, beside), axis=1))

    def places(self, goal: Floats) -> Mapping[str, Floats]:
        """Return the initial poses of object and basket: x, y, heading."""
        return {self.object: goal[0, :3], self.basket: np.array([*goal[0, 3:5], 0.0])}

    def observation(self, now: Instant) -> Array:
        """Return observations, shape (N, d)."""
        xp = namespace(now.position)
        return xp.concat((super().observation(now), self._middle(now) - now.target), axis=1)

    def _middle(self, now: Instant) -> Array:
        """Middle of the basket's floor, world [m], shape (N, 3)."""
        xp, flat = namespace(now.position), now.facts["goal"][:, 3:5]
        return xp.concat((flat, flat[:, :1] * 0.0 + self.shelf), axis=1)

    def _outside(self, now: Instant) -> Array:
        """Distance of the object from the inside of the basket [m], shape (N,)."""
        xp = namespace(now.position)
        away = xp.abs(now.target - self._middle(now))
        most = xp.maximum(away[:, 0], away[:, 1]) - self.inside
        above = now.target[:, 2] - self.shelf - self.rim
        zero = most * 0.0
        return xp.maximum(most, zero) + xp.maximum(above, zero)

    def distance(self, now: Instant) -> Array:
        """Return the distance to the basket, and that which the hand lacks [m], shape (N,)."""
        xp, out = namespace(now.position), self._outside(now)
        return out + xp.maximum(self.clear - self.reached(now), out * 0.0)

    def gone(self, now: Instant) -> Array:
        """Return the share of the way to the basket [1], shape (N,)."""
        xp = namespace(now.position)
        away = self._middle(now) - now.target
        return 1.0 - xp.sqrt(xp.sum(away * away, axis=1)) / _WAY

    def delivered(self, now: Instant) -> Array:
        """Test if the object is in the basket, shape (N, 1)."""
        return (self._outside(now) <= 0.0)[:, None]

    def bring(self, now: Instant) -> Array:
        """Return the velocity over the rim and down into the basket [m/s], shape (N, 3)."""
        xp = namespace(now.position)
        away = self._middle(now) - now.target
        flat = xp.sqrt(xp.sum(away[:, :2] * away[:, :2], axis=1, keepdims=True))
        # a body that leans swings what it carries: the level hand is led
        level = self._middle(now) - now.position - level_hand_offset(now)
        top = self.rim + ABOVE
        above = xp.clip(FUNNEL * (flat - AIM), 0.0, top)
        end = self.shelf + above
        up = lifted(now, end)[:, 2:3]
        down = xp.maximum(GAIN * (end - now.target[:, 2:3]), end * 0.0 - LOWER)
        up = xp.where(now.target[:, 2:3] > end, down, up)
        # it crosses the rim from above
        high = xp.astype((now.target[:, 2:3] > end - 0.5 * ABOVE) | (flat < AIM), flat.dtype)
        go = xp.clip(GAIN * level[:, :2], -HASTE, HASTE) * high
        return xp.concat((go, up), axis=1)

    def leave(self, now: Instant) -> Array:
        """Return the velocity upward out of the basket [m/s], shape (N, 3)."""
        xp = namespace(now.position)
        end = self.shelf + self.rim + 2.0 * self.clear
        up = xp.clip(GAIN * (end + self.clear - now.tool[:, 2:3]), -LOWER, LOWER)
        return xp.concat((up * 0.0, up * 0.0, up), axis=1)
