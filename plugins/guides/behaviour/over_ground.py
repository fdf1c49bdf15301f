"""Base of behaviours that move in the horizontal plane; standing still and marching."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.errors import refuse_unlisted
from seals.plugins.guides.behaviour.over_batch import STILL, OverBatch
from seals.schema import setting
from seals.state_records import state_record


class Behaviour:
    """Base of behaviours: suits any robot, and never finishes."""

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def finished(self, memory: Any) -> bool | None:
        """Return None: the behaviour never ends."""
        return None


def heading_for(way: float, speed: float, yaw: float) -> Reference:
    """Return the reference of a horizontal velocity with its heading.

    Args:
        way: direction, anticlockwise from east [rad].
        speed: [m/s].
        yaw: heading, for robots that do not turn along their way [rad].
    """
    velocity = np.array([speed * math.cos(way), speed * math.sin(way), 0.0])
    return Reference(velocity=velocity, yaw=yaw)


def place_of(situation: RobotState, name: str, *, where: str) -> Floats:
    """Return the position of another body of the scene, world [m], shape (3,).

    Raises:
        ConfigError: there is no such body.
    """
    refuse_unlisted(
        name,
        situation.bodies,
        f"{where}={name or '(nothing)'} is not the name of another body of the scene",
        label="Bodies",
    )
    return situation.bodies[name]


def apart(situation: RobotState, place: Floats) -> tuple[float, float]:
    """Return horizontal distance [m] and direction [rad] of a point."""
    x, y = (float(place[k] - situation.position[k]) for k in (0, 1))
    return math.hypot(x, y), math.atan2(y, x)


@dataclass(kw_only=True)
class Freeze(Behaviour):
    """Behaviour that stays in place, like animals that rely on camouflage.

    Args:
        rate: calls a second [Hz].

    Example:
        >>> Freeze().rate
        5.0
    """

    rate: float = setting(5.0, "Hz", bounds=(0.1, 1e4), source="chosen")

    def over_batch(self) -> OverBatch:
        """Return the behaviour over a batch of animals."""
        return STILL

    def start(self, situation: RobotState) -> float:
        """Return the initial state: the heading [rad]."""
        return situation.yaw

    def aim(self, situation: RobotState, memory: float) -> tuple[Reference, float]:
        """Return zero velocity."""
        return Reference(yaw=memory), memory

    def stage(self, memory: float) -> str:
        """Return the name of the behaviour."""
        return "still"


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
