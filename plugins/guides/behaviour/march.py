"""Behaviour of moving in one direction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from seals.control import Reference, RobotState
from seals.plugins.guides.behaviour.over_ground import Behaviour, heading_for
from seals.schema import setting
from seals.state_records import state_record


@state_record
class MarchState(NamedTuple):
    """State: start time [s], heading at the start [rad], time of the last call [s]."""

    start: float
    yaw: float
    now: float


@dataclass(kw_only=True)
class March(Behaviour):
    """Behaviour that moves in one direction at constant speed.

    Args:
        rate: calls a second [Hz].
        speed: [m/s].
        way: direction, anticlockwise from east [rad].
        delay: rest before [s].
        duration: time of walking, then it stands [s].

    Example:
        >>> March(speed=0.2).way
        0.0
    """

    rate: float = setting(5.0, "Hz", bounds=(0.1, 1e4), source="chosen")
    speed: float = setting(0.1, "m/s", bounds=(0.0, 50.0), source="chosen")
    way: float = setting(0.0, "rad", bounds=(-2.0 * math.pi, 2.0 * math.pi), source="chosen")
    delay: float = setting(0.5, "s", bounds=(0.0, 1e4), source="chosen")
    duration: float = setting(1e4, "s", bounds=(0.0, 1e6), source="chosen: for good")

    def start(self, situation: RobotState) -> MarchState:
        """Return the initial state: time and heading."""
        return MarchState(situation.time, situation.yaw, situation.time)

    def aim(self, situation: RobotState, memory: MarchState) -> tuple[Reference, MarchState]:
        """Return the velocity."""
        memory = memory._replace(now=situation.time)
        going = self.stage(memory) == "marching"
        return heading_for(self.way, self.speed if going else 0.0, memory.yaw), memory

    def finished(self, memory: MarchState) -> bool | None:
        """Return True when its time is over."""
        return True if memory.now - memory.start >= self.delay + self.duration else None

    def stage(self, memory: MarchState) -> str:
        """Return the present activity in a word."""
        walked = memory.now - memory.start - self.delay
        return "marching" if 0.0 <= walked < self.duration else "still"
