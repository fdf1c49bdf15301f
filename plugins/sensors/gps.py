"""Receiver of a satellite navigation system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.schema import check_fields, param, setting, vector
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput

_CEP = "u-blox M8 data sheet: 2.5 m CEP, most of it slow"


@dataclass(kw_only=True)
class SensorGps(Instrument):
    """Satellite navigation: position and velocity of the antenna; no readings under water.

    Equation:
        gps_position = p + bias + d + noise, with d a first-order Gauss-Markov process for each
        axis; gps_velocity = v + noise, both in world axes. No reading while the antenna is below
        the local water surface, and for ``acquire`` after that.

    Args:
        rate: readings a second [Hz].
        noise: standard deviation of the white error, east and north [m].
        noise_up: the same upwards [m].
        drift: standard deviation of the slow error in the long run, east and north [m].
        drift_up: the same upwards [m].
        drift_time: time constant of the slow error [s].
        velocity_noise: standard deviation of each component of the velocity [m/s].
        bias: constant error of the position, world axes [m].
        acquire: time above the surface until the first reading [s].

    Assumptions:
        Open sky; the place of the world's origin is known.

    Valid range:
        Speeds up to those of vehicles.

    Limitations:
        Under water at an instant between two readings is not noticed. No multipath, no jumps when
        satellites change, no dilution by geometry. East, north, up only: no latitudes.

    References:
        u-blox NEO-M8 data sheet: 2.5 m CEP, 0.05 m/s, hot start within 1 s. Comparison of Enhanced
        Noise Model Performance Based on Analysis of Civilian GPS Data, 2020, Sensors 20(21), 6050
        (the slow error as an Ornstein-Uhlenbeck process).

    Example:
        >>> SensorGps(position=[0.0, 0.0, 0.1]).channels()
        {'gps_position': 3, 'gps_velocity': 3}
    """

    rate: float = setting(5.0, "Hz", bounds=(0.01, 1e3), source="chosen: M8 allows 10 Hz")
    noise: float = param(0.3, "m", bounds=(0.0, 1e3), tolerance=0.2, source="chosen")
    noise_up: float = param(0.6, "m", bounds=(0.0, 1e3), tolerance=0.4, source="chosen: twice")
    drift: float = param(2.1, "m", bounds=(0.0, 1e3), tolerance=0.5, source=_CEP)
    drift_up: float = param(4.0, "m", bounds=(0.0, 1e3), tolerance=1.0, source="chosen: twice")
    drift_time: float = param(
        300.0, "s", bounds=(1e-3, 1e6), tolerance=200.0, source="chosen: minutes"
    )
    velocity_noise: float = param(
        0.05, "m/s", bounds=(0.0, 100.0), tolerance=0.02, source="u-blox M8 data sheet"
    )
    bias: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e5, 1e5), source="chosen")
    acquire: float = setting(1.0, "s", bounds=(0.0, 1e4), source="u-blox M8: hot start")

    late: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_fields(type(self), {"bias": self.bias}, where="gps")
        super().__post_init__()

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"gps_position": 3, "gps_velocity": 3}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return position and velocity of the antenna, and the time it was last under water."""
        if felt.around.wet(felt.time, felt.position):
            return None, felt.time
        if own is not None and felt.time - own < self.acquire:
            return None, own
        return {"gps_position": felt.position, "gps_velocity": felt.rotation @ felt.velocity}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of position and velocity."""
        place = Noise(
            sigma=np.array([self.noise, self.noise, self.noise_up]),
            bias=np.asarray(self.bias, dtype=float),
            drift=np.array([self.drift, self.drift, self.drift_up]),
            drift_time=self.drift_time,
        )
        return {"gps_position": place, "gps_velocity": Noise(sigma=self.velocity_noise)}
