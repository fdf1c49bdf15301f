"""Base of sensors on a link: mounting link, latency and dropouts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from seals.schema import setting
from seals.sensors.options import SensorOptions


@dataclass(kw_only=True)
class MountedSensor(SensorOptions):
    """Base of sensors: mounting link, latency and dropouts.

    The world acts on these fields, see `seals.sensors.delivery`; a sensor itself never looks at
    them. A reading stands in the log at the time at which it was taken.

    Args:
        link: link that carries the sensor; ``root`` is the base.
        latency: time from the taking of a reading to its arrival at guide and controller [s].
        dropout: share of the readings that are lost [1].
        outage: mean length of a loss, at least one reading; 0 loses each by itself [s].
    """

    link: str = "root"
    latency: float = setting(0.0, "s", bounds=(0.0, 60.0), source="chosen: none")
    dropout: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen: none")
    outage: float = setting(0.0, "s", bounds=(0.0, 1e4), source="chosen: none")

    inertial: ClassVar[bool] = False
    """Whether it reads ``specific_force`` or ``angular_acceleration``; else these are zero."""
