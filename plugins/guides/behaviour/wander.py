"""Behaviour of random walking near a home position."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.control import Reference, RobotState
from seals.plugins.guides.behaviour.over_batch import OverBatch, wandering
from seals.plugins.guides.behaviour.over_ground import Behaviour, apart, heading_for
from seals.schema import count, setting
from seals.state_records import state_record


@state_record
class WanderState(NamedTuple):
    """State: bout number and end [s], direction [rad], home position [m] and heading [rad]."""

    bouts: int
    end: float
    way: float
    home: tuple[float, float]
    yaw: float


@dataclass(kw_only=True)
class WanderSettings(Behaviour):
    """Settings of `Wander`, for it and for behaviours of which it is a part."""

    rate: float = setting(5.0, "Hz", bounds=(0.1, 1e4), source="chosen")
    speed: float = setting(0.08, "m/s", bounds=(0.0, 50.0), source="Weinstein 1995")
    walk: float = setting(11.2, "s", bounds=(0.1, 1e4), source="Weinstein 1995")
    pause: float = setting(23.4, "s", bounds=(0.0, 1e4), source="Weinstein 1995")
    radius: float = setting(1.0, "m", bounds=(0.0, 1e4), source="chosen")
    seed: int = count(0, bounds=(0, 2**63 - 1))


@dataclass(kw_only=True)
class Wander(WanderSettings):
    """Behaviour that walks in random bouts with pauses and stays near its start.

    Equation:
        The lengths of bouts and pauses are exponential with the given means; odd bouts walk, even
        ones rest.

    Args:
        rate: calls a second [Hz].
        speed: of walking [m/s].
        walk: mean length of a bout [s].
        pause: mean length of a pause [s].
        radius: distance from the start beyond which bouts lead home [m].
        seed: of bouts and directions.

    References:
        Weinstein 1995, Journal of Experimental Biology 198, 989-999: ghost crabs on a beach walk
        8 cm/s for 11.2 s and pause for 23.4 s on average.

    Example:
        >>> Wander().walk
        11.2
    """

    def over_batch(self) -> OverBatch:
        """Return the behaviour over a batch of animals, with bouts of another random stream."""
        return wandering(self)

    def start(self, situation: RobotState) -> WanderState:
        """Return the initial state: home position, first bout due."""
        x, y = (float(v) for v in situation.position[:2])
        return WanderState(0, situation.time, 0.0, (x, y), situation.yaw)

    def aim(self, situation: RobotState, memory: WanderState) -> tuple[Reference, WanderState]:
        """Return the velocity of the present bout."""
        if situation.time >= memory.end:
            memory = self._next(situation, memory)
        walking = memory.bouts % 2 == 1
        return heading_for(memory.way, self.speed if walking else 0.0, memory.yaw), memory

    def stage(self, memory: WanderState) -> str:
        """Return the present activity in a word."""
        return "wandering" if memory.bouts % 2 == 1 else "still"

    def _next(self, situation: RobotState, memory: WanderState) -> WanderState:
        """Begin the next bout or pause."""
        bouts = memory.bouts + 1
        # a bout is a function of seed and number: a snapshot needs no random state
        rng = np.random.default_rng([self.seed, bouts])
        mean = self.walk if bouts % 2 == 1 else self.pause
        far, back = apart(situation, np.array([*memory.home, 0.0]))
        way = float(rng.uniform(-math.pi, math.pi))
        if far > self.radius:
            way = back + 0.25 * way
        end = situation.time + mean * float(rng.standard_exponential())
        return memory._replace(bouts=bouts, end=end, way=way)
