"""Delay of inertial sensors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from seals.effects.effect import Effect, Parameters
from seals.effects.identification import Addition, Freed, Identification, Stage, Subject
from seals.field_roles import roles
from seals.motion import Timing
from seals.schema import param


@roles(data="sensors")
@dataclass(kw_only=True)
class SensorDelay(Effect):
    """Delay of sensors against the log's time base; by default of gyroscope and accelerometer.

    Equation:
        Row t holds the value of t - d.

    Args:
        delay: d [s].
        sensors: names of the sensors that are late, ``*`` for all; empty for the inertial ones.
        links: not used; the delay is that of sensors.

    Assumptions:
        Constant, the same for all those sensors; comes before misalignment, scale and bias.

    Valid range:
        Delays below the length of the log.

    Limitations:
        No smoothing: a low-pass filter also delays, see the sensor's bandwidth. Sensors other than
        inertial ones are late by whole steps of the simulation. A diagnosis knows late inertial
        sensors alone.

    References:
        None needed: a shift in time.

    Example:
        >>> SensorDelay(delay=0.02).delay
        0.02
    """

    delay: float = param(
        0.0, "s", bounds=(-0.5, 0.5), tolerance=0.0005, source="zero: the stated delay applies"
    )
    sensors: list[str] = field(default_factory=list)
    accounts_for: ClassVar[tuple[str, ...]] = ("sensor delay",)
    identification: ClassVar[Identification] = Identification(
        may_begin=True,
        may_end=True,
        always_fitted=True,
        adds_only=("delay",),
        starts=((0.008,), (0.02,), (0.035,)),
        words={"delay": "delay of the inertial sensors"},
        compared=None,
    )

    @classmethod
    def additions(cls, name: str, subject: Subject) -> list[Addition]:
        """Return the candidate: a delay of the inertial sensors."""
        return [
            Addition(
                instance=name,
                effect=cls(),
                parameters={"delay": Freed(tolerance=subject.spread(name), scale=0.02)},
                starts=cls.identification.starts,
                order=(Stage.sensors, 0, 4),
            )
        ]

    @staticmethod
    def timing(params: Parameters) -> Timing:
        """Additional delay of the sensors [s]."""
        return Timing(sensor_delay=params["delay"])
