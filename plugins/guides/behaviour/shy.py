"""Behaviour of animals some of which flee, while the others go their way."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar, NamedTuple

import numpy as np

from seals.control import Reference, RobotState
from seals.field_roles import roles
from seals.plugins.guides.behaviour.flee import Flee, FleeState
from seals.plugins.guides.behaviour.over_batch import OverBatch, fleeing, partly, wandering
from seals.plugins.guides.behaviour.wander import Wander, WanderSettings, WanderState
from seals.schema import setting
from seals.state_records import state_record


@state_record
class ShyState(NamedTuple):
    """State: whether it is one that flees, and the states of wandering and fleeing."""

    flees: bool
    wander: WanderState
    flee: FleeState


class _ShyFlee(Flee):
    """Fleeing as a part of `Shy`, by whose name its settings are told."""

    guide: ClassVar[str] = "shy"


@roles(data="enemy")
@dataclass(kw_only=True)
class Shy(WanderSettings):
    """Behaviour that flees in a drawn share of the individuals and wanders in the others.

    Args:
        share: of the individuals that flee [1].
        enemy: what they flee from; ``robot`` is the robot of a run.
        flight: speed of those that flee [m/s].
        alarm: distance at which they start to run [m].
        calm: distance at which they stop [m].

    All other fields are those of `Wander`.

    Example:
        >>> Shy(enemy="robot").share
        0.5
    """

    rate: float = setting(10.0, "Hz", bounds=(0.1, 1e4), source="chosen: as Flee")
    share: float = setting(0.5, "1", bounds=(0.0, 1.0), source="chosen")
    enemy: str = "robot"
    flight: float = setting(0.1, "m/s", bounds=(0.0, 50.0), source="chosen")
    alarm: float = setting(0.5, "m", bounds=(0.0, 1e3), source="chosen")
    calm: float = setting(1.0, "m", bounds=(0.0, 1e3), source="chosen")

    def __post_init__(self) -> None:
        """Refuse a distance of calm below the distance of alarm."""
        self.fleeing()

    def wandering(self) -> Wander:
        """Return the behaviour of the others."""
        return Wander(**{each.name: getattr(self, each.name) for each in fields(WanderSettings)})

    def fleeing(self) -> Flee:
        """Return the behaviour of those that flee."""
        return _ShyFlee(
            rate=self.rate,
            enemy=self.enemy,
            speed=self.flight,
            alarm=self.alarm,
            calm=self.calm,
        )

    def over_batch(self) -> OverBatch:
        """Return the behaviour over a batch of animals, with another random stream."""
        return partly(self.share, wandering(self.wandering()), fleeing(self.fleeing()))

    def start(self, situation: RobotState) -> ShyState:
        """Return the initial state: the seed says whether it is one that flees."""
        drawn = float(np.random.default_rng([self.seed, 0]).random())
        wander = self.wandering().start(situation)
        return ShyState(drawn < self.share, wander, self.fleeing().start(situation))

    def aim(self, situation: RobotState, memory: ShyState) -> tuple[Reference, ShyState]:
        """Return the velocity of wandering, or away from the enemy."""
        if memory.flees:
            aim, flee = self.fleeing().aim(situation, memory.flee)
            return aim, memory._replace(flee=flee)
        aim, wander = self.wandering().aim(situation, memory.wander)
        return aim, memory._replace(wander=wander)

    def stage(self, memory: ShyState) -> str:
        """Return the present activity in a word."""
        if memory.flees:
            return self.fleeing().stage(memory.flee)
        return self.wandering().stage(memory.wander)
