"""Inertial sensor that sits beside its stated place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from seals.effects import Addition, Identification, Stage, Subject, along_axes
from seals.effects.effect import Effect, Parameters
from seals.frames import cross
from seals.motion import Reading
from seals.schema import param

_LIMITS: dict[str, Any] = {
    "bounds": (-10.0, 10.0),
    "tolerance": 0.005,
    "source": "zero: it is mounted at the stated place",
}
_LEAST = 0.01
"""Offset that nobody calls a fault: places are stated to a centimetre [m]."""


@dataclass(kw_only=True)
class SensorPlace(Effect):
    """Inertial sensor beside its stated place: rotation changes the accelerometer reading.

    Equation:
        f = f_true + w' x d + w x (w x d), before misalignment, scale and bias; the gyroscope reads
        the same everywhere on a rigid body.

    Args:
        offset_x: d along sensor x, from the stated place to the true one [m].
        offset_y: d along sensor y [m].
        offset_z: d along sensor z [m].
        links: not used; it acts on the accelerometer.

    Assumptions:
        Sensor and body are rigid: no isolation from vibration.

    Valid range:
        Any place on the link that carries the sensor.

    Limitations:
        A body that hardly turns does not show it; d along a steady turn has no effect at all.

    References:
        Wittenburg 2008, Dynamics of Multibody Systems (acceleration of a point of a rigid body).

    Example:
        >>> SensorPlace(offset_x=0.1).offset_x
        0.1
    """

    offset_x: float = param(0.0, "m", **_LIMITS)
    offset_y: float = param(0.0, "m", **_LIMITS)
    offset_z: float = param(0.0, "m", **_LIMITS)
    order: ClassVar[int] = 0
    accounts_for: ClassVar[tuple[str, ...]] = ("sensor place",)
    identification: ClassVar[Identification] = Identification(
        confounders=("centre_of_gravity", "sensor_misalignment"),
        measurement="Measuring the distance from the centre of gravity to the sensor would "
        "determine it.",
        words={"offset": "place of the inertial sensor"},
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: three numbers; a vehicle's own size is a plausible mistake."""
        if "specific_force" not in subject.sigma:
            return []
        offsets = along_axes("offset", subject.spread(name), 0.3 * subject.length)
        parameters = {key: replace(one, least=_LEAST) for key, one in offsets.items()}
        order = (Stage.sensors, 0, 6)
        return [Addition(instance=name, effect=cls(), parameters=parameters, order=order)]

    @staticmethod
    def measure(reading: Reading, params: Parameters) -> Reading:
        """Specific force at the true place [m/s^2]; what cannot turn has none to add."""
        if reading.angular_acceleration is None or reading.turning is None:
            return reading
        arm = params["offset"]
        along = cross(reading.angular_acceleration, arm)
        inward = cross(reading.turning, cross(reading.turning, arm))
        return reading._replace(specific_force=reading.specific_force + along + inward)
