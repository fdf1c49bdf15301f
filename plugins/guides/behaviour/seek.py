"""Behaviour of going to a target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from seals.control import Reference, RobotState
from seals.field_roles import roles
from seals.plugins.guides.behaviour.over_ground import Behaviour, apart, heading_for, place_of
from seals.schema import check_tree, setting, vector
from seals.state_records import state_record


@state_record
class SeekState(NamedTuple):
    """State: heading at the start [rad], and whether the target is reached."""

    yaw: float
    there: bool


@roles(data="target")
@dataclass(kw_only=True)
class Seek(Behaviour):
    """Behaviour that moves straight to a point or another body, slows down, and stays.

    Args:
        rate: calls a second [Hz].
        place: x and y of the target in the world [m].
        target: name of a body of the scene in place of a place; empty for none.
        speed: [m/s].
        near: distance at which it has arrived [m].
        slow: distance within which it slows down [m].

    Example:
        >>> Seek(place=[0.4, 0.0]).near
        0.02
    """

    rate: float = setting(10.0, "Hz", bounds=(0.1, 1e4), source="chosen")
    place: list[float] = vector((0.0, 0.0), "m", bounds=(-1e5, 1e5), source="chosen")
    target: str = ""
    speed: float = setting(0.1, "m/s", bounds=(1e-3, 50.0), source="chosen")
    near: float = setting(0.02, "m", bounds=(1e-4, 100.0), source="chosen")
    slow: float = setting(0.05, "m", bounds=(1e-4, 100.0), source="chosen")

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="seek")

    def start(self, situation: RobotState) -> SeekState:
        """Return the initial state: the heading."""
        return SeekState(situation.yaw, False)

    def aim(self, situation: RobotState, memory: SeekState) -> tuple[Reference, SeekState]:
        """Return the velocity towards the target."""
        far, way = apart(
            situation,
            place_of(situation, self.target, where="seek.target")
            if self.target
            else np.array([*self.place, 0.0]),
        )
        if far <= self.near:
            return Reference(yaw=memory.yaw), memory._replace(there=True)
        speed = self.speed * min(1.0, max(far / self.slow, 0.3))
        return heading_for(way, speed, memory.yaw), memory._replace(there=False)

    def finished(self, memory: SeekState) -> bool | None:
        """Return True if a fixed target is reached; following a body never finishes."""
        return True if memory.there and not self.target else None

    def stage(self, memory: SeekState) -> str:
        """Return the present activity in a word."""
        return "there" if memory.there else "seeking"
