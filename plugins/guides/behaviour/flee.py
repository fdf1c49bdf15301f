"""Behaviour of fleeing from another body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from seals.control import Reference, RobotState
from seals.field_roles import roles
from seals.plugins.guides.behaviour.over_batch import OverBatch, fleeing
from seals.plugins.guides.behaviour.over_ground import Behaviour, apart, heading_for, place_of
from seals.schema import check_order, setting
from seals.state_records import state_record


@state_record
class FleeState(NamedTuple):
    """State: heading at the start [rad], and whether it flees."""

    yaw: float
    runs: bool


@roles(data="enemy")
@dataclass(kw_only=True)
class Flee(Behaviour):
    """Behaviour that moves straight away from an approaching body and stops at a distance.

    Args:
        rate: calls a second [Hz].
        enemy: name of that body; ``robot`` is the robot of a run.
        speed: [m/s].
        alarm: distance in space at which it starts to run [m].
        calm: distance at which it stops [m].

    Assumptions:
        It sees all around, as crabs do, and nothing hides the enemy.

    Example:
        >>> Flee(enemy="robot").alarm
        0.6
    """

    rate: float = setting(10.0, "Hz", bounds=(0.1, 1e4), source="chosen")
    enemy: str = "robot"
    speed: float = setting(0.3, "m/s", bounds=(0.0, 50.0), source="chosen")
    alarm: float = setting(0.6, "m", bounds=(0.0, 1e3), source="chosen")
    calm: float = setting(1.0, "m", bounds=(0.0, 1e3), source="chosen")
    guide: ClassVar[str] = "flee"

    def __post_init__(self) -> None:
        """Refuse a distance of calm below the distance of alarm."""
        check_order(self, "alarm", "calm", where=self.guide, equal=True)

    def over_batch(self) -> OverBatch:
        """Return the behaviour over a batch of animals; the enemy is given by the batch."""
        return fleeing(self)

    def start(self, situation: RobotState) -> FleeState:
        """Return the initial state: standing."""
        return FleeState(situation.yaw, False)

    def aim(self, situation: RobotState, memory: FleeState) -> tuple[Reference, FleeState]:
        """Return the velocity away from the body, or zero."""
        place = place_of(situation, self.enemy, where=f"{self.guide}.enemy")
        near = float(np.linalg.norm(place - situation.position))
        runs = near < (self.calm if memory.runs else self.alarm)
        _, way = apart(situation, place)
        aim = heading_for(way + np.pi, self.speed if runs else 0.0, memory.yaw)
        return aim, memory._replace(runs=runs)

    def stage(self, memory: FleeState) -> str:
        """Return the present activity in a word."""
        return "fleeing" if memory.runs else "still"
