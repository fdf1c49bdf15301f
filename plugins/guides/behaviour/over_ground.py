"""Base of behaviours that move in the horizontal plane, and plane geometry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, Reference, RobotState
from seals.errors import ConfigError, suggestion


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
    if name not in situation.bodies:
        raise ConfigError(
            f"{where}={name or '(nothing)'} is not the name of another body of the scene.\n"
            f"{suggestion(name, list(situation.bodies), label='Bodies')}"
        )
    return situation.bodies[name]


def apart(situation: RobotState, place: Floats) -> tuple[float, float]:
    """Return horizontal distance [m] and direction [rad] of a point."""
    x, y = (float(place[k] - situation.position[k]) for k in (0, 1))
    return math.hypot(x, y), math.atan2(y, x)
