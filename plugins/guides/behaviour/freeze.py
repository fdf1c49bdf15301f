"""Behaviour of standing still."""

from __future__ import annotations

from dataclasses import dataclass

from seals.control import Reference, RobotState
from seals.plugins.guides.behaviour.over_ground import Behaviour
from seals.schema import setting


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

    def start(self, situation: RobotState) -> float:
        """Return the initial state: the heading [rad]."""
        return situation.yaw

    def aim(self, situation: RobotState, memory: float) -> tuple[Reference, float]:
        """Return zero velocity."""
        return Reference(yaw=memory), memory

    def stage(self, memory: float) -> str:
        """Return the name of the behaviour."""
        return "still"
