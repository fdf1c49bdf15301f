"""Misalignment of the inertial sensor."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from seals.arrays import Array
from seals.effects import (
    Addition,
    Comparison,
    Identification,
    Stage,
    Subject,
    addition_along_axes,
)
from seals.effects.effect import Effect, Parameters
from seals.field_roles import roles
from seals.frames import exponential, matrix_of, unrotate
from seals.motion import Reading
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-3.2, 3.2),
    "tolerance": 0.003,
    "source": "zero: the stated mounting applies",
}


@roles(data="sensors")
@dataclass(kw_only=True)
class SensorMisalignment(Effect):
    """Misalignment of sensor axes by a rotation vector; by default of inertial sensors.

    Equation:
        Both readings: measured = Exp(r)^T true, before scale and bias.

    Args:
        rotation_x: r about sensor x [rad].
        rotation_y: r about sensor y [rad].
        rotation_z: r about sensor z [rad].
        sensors: names of the sensors that are turned, ``*`` for all; empty for the inertial ones.
        links: not used; it acts on sensors.

    Assumptions:
        Gyroscope and accelerometer are turned together, as one block. Other sensors are turned
        about their mounting point and look in the turned direction.

    Valid range:
        Any turn; a turn by more than half a circle has another vector.

    Limitations:
        No error of the angles between the axes of one sensor. Sensors without a mounting cannot be
        turned. A diagnosis knows turned inertial sensors alone.

    References:
        Sola 2017, Quaternion kinematics for the error-state Kalman filter, arXiv:1711.02508.

    Example:
        >>> SensorMisalignment(rotation_x=0.02).rotation_x
        0.02
    """

    rotation_x: float = param(0.0, "rad", **_LIMITS)
    rotation_y: float = param(0.0, "rad", **_LIMITS)
    rotation_z: float = param(0.0, "rad", **_LIMITS)
    sensors: list[str] = field(default_factory=list)
    order: ClassVar[int] = 1
    accounts_for: ClassVar[tuple[str, ...]] = ("sensor misalignment",)
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        words={"rotation": "mounting angle of the inertial sensors"},
        compared=Comparison(order=(Stage.sensors, 2)),
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a rotation about three axes."""
        sizes = subject.spread(name), 0.05
        return addition_along_axes(cls, name, "rotation", sizes, (Stage.sensors, 0, 3))

    @staticmethod
    def axis_misalignment(params: Parameters) -> Array:
        """Return the rotation of the sensor axes, Exp(r), shape (1 or N, 3, 3)."""
        return matrix_of(exponential(params["rotation"]))

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Angular velocity and specific force in the misaligned axes [rad/s, m/s^2]."""
        turn = SensorMisalignment.axis_misalignment(params)
        return reading._replace(
            angular_velocity=unrotate(turn, reading.angular_velocity),
            specific_force=unrotate(turn, reading.specific_force),
        )
