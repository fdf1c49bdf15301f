"""Onboard state that sensors may read: joints, rotors, battery."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.effects.binding import EffectSet
from seals.robot.model import RobotModel


class RobotEquipment(NamedTuple):
    """Equipment of a robot, passed to sensors by ``bind``.

    Args:
        joints: names of the movable joints, in the order of their coordinates.
        rotors: number of rotors, in the order of their commands.
        battery: whether it has one.
    """

    joints: tuple[str, ...] = ()
    rotors: int = 0
    battery: bool = False

    @classmethod
    def of(cls, robot: RobotModel, effects: EffectSet) -> RobotEquipment:
        """Return the equipment of a robot."""
        rotors = sum(int(b.hooks.count) for b in effects.actuators if spins(b.effect))
        return cls(robot.joints, rotors, bool(effects.batteries))


class OnboardState(NamedTuple):
    """Onboard state of the robot, evaluated on demand.

    Args:
        joints: joint coordinates [rad or m], shape (J,).
        rotors: speed of every rotor in the last step, as medium and motor leave it [rad/s].
        supply: voltage [V], current [A] and state of charge [1] of the battery.
    """

    joints: Callable[[], Floats]
    rotors: Callable[[], Floats]
    battery_state: Callable[[], tuple[float, float, float]]

    @classmethod
    def bare(cls) -> OnboardState:
        """Return the onboard state of a robot without joints, rotors and battery."""
        return cls(lambda: np.zeros(0), lambda: np.zeros(0), lambda: (0.0, 0.0, 0.0))


def spins(actuator: Any) -> bool:
    """Return whether an actuator's drives are rotors with reaction torque."""
    return "reaction_coefficient" in actuator.constants()
