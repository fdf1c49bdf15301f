"""Inertial sensor turned against the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from seals.effects.effect import Effect, Parameters
from seals.frames import exponential, matrix_of, unrotate
from seals.motion import Reading
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-3.2, 3.2),
    "tolerance": 0.003,
    "source": "zero: the stated mounting rules",
}


@dataclass(kw_only=True)
class SensorMisalignment(Effect):
    """Inertial sensor whose axes are those of the body turned by a rotation vector.

    Equation:
        Both readings: measured = Exp(r)^T true, before scale and bias.

    Args:
        rotation_x: r about sensor x [rad].
        rotation_y: r about sensor y [rad].
        rotation_z: r about sensor z [rad].
        links: not used; it acts on the inertial sensors.
        correction: see `seals.effects.Effect`.

    Assumptions:
        Gyroscope and accelerometer are turned together, as one block.

    Valid range:
        Any turn; a turn by more than half a circle has another vector.

    Limitations:
        No error of the angles between the axes of one sensor.

    References:
        Sola 2017, Quaternion kinematics for the error-state Kalman filter, arXiv:1711.02508.

    Example:
        >>> SensorMisalignment(rotation_x=0.02).rotation_x
        0.02
    """

    rotation_x: float = param(0.0, "rad", **_LIMITS)
    rotation_y: float = param(0.0, "rad", **_LIMITS)
    rotation_z: float = param(0.0, "rad", **_LIMITS)
    order: ClassVar[int] = 1
    accounts_for: ClassVar[tuple[str, ...]] = ("sensor misalignment",)

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Both readings in the turned axes [rad/s, m/s^2]."""
        turn = matrix_of(exponential(params["rotation"]))
        return Reading(
            angular_velocity=unrotate(turn, reading.angular_velocity),
            specific_force=unrotate(turn, reading.specific_force),
        )
