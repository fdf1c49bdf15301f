"""Robot state in the axes of autopilots: north-east-down, forward-right-down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.control import RobotState
from seals.frames import quaternion_of

ENU_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Matrix from east-north-up to north-east-down, and back."""
FLU_FRD = np.array([1.0, -1.0, -1.0])
"""Signs from forward-left-up to forward-right-down, and back."""


class FlightState(NamedTuple):
    """Motion and readings of a robot at one instant, in an autopilot's axes.

    Args:
        time: [s].
        position: of the body origin, north-east-down [m], shape (3,).
        velocity: likewise [m/s].
        acceleration: likewise [m/s^2].
        rotation: from forward-right-down to north-east-down, shape (3, 3).
        gyro: angular velocity, forward-right-down [rad/s], shape (3,).
        accelerometer: specific force of the body origin, forward-right-down [m/s^2], shape (3,).
        wind: velocity of the air, north-east-down [m/s], shape (3,).
        readings: last reading of every sensor, by sensor and channel.
    """

    time: float
    position: Floats
    velocity: Floats
    acceleration: Floats
    rotation: Floats
    gyro: Floats
    accelerometer: Floats
    wind: Floats
    readings: Mapping[str, Mapping[str, Floats]]

    @property
    def quaternion(self) -> Floats:
        """Attitude w, x, y, z, shape (4,)."""
        return quaternion_of(self.rotation)[[3, 0, 1, 2]]

    @property
    def airspeed(self) -> float:
        """Speed through the air along the body's x axis [m/s]."""
        return float((self.velocity - self.wind) @ self.rotation[:, 0])

    def reading(self, channel: str) -> list[float]:
        """Return the finite values that sensors last gave for a channel, one each, in order."""
        found = (values[channel] for values in self.readings.values() if channel in values)
        return [float(value[0]) for value in found if np.isfinite(value[0])]


def flight_state(
    now: RobotState, change: Floats | None, gravity: float, wind: Floats
) -> FlightState:
    """Convert the state of a robot.

    Args:
        now: the state.
        change: acceleration of the last step, world axes [m/s^2], shape (3,); None at the start.
        gravity: [m/s^2].
        wind: velocity of the air, world axes [m/s].
    """
    change = np.zeros(3) if change is None else change
    force = (change + np.array([0.0, 0.0, gravity])) @ now.rotation
    return FlightState(
        now.time,
        ENU_NED @ now.position,
        ENU_NED @ now.velocity,
        ENU_NED @ change,
        ENU_NED @ now.rotation * FLU_FRD,
        FLU_FRD * now.angular_velocity,
        FLU_FRD * force,
        ENU_NED @ wind,
        now.readings,
    )
