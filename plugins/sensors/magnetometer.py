"""Magnetometer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.schema import check_tree, param, setting, vector
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput


@dataclass(kw_only=True)
class SensorMagnetometer(Instrument):
    """Magnetometer: field of the Earth in sensor axes, with scale error and hard iron.

    Equation:
        magnetic_field = (R_WS^T B) (1 + gain_error) + hard_iron + noise.

    Args:
        rate: readings a second [Hz].
        east: field of the place, towards east [T].
        north: towards north, along the world's y axis [T].
        up: upwards [T].
        noise: standard deviation of each component [T].
        gain_error: error of the scale [1].
        hard_iron: constant field of the robot, sensor axes [T].
        resolution: quantisation, 0 for none [T].

    Assumptions:
        The field is the same everywhere in the scene.

    Valid range:
        Far from steel, cables and other robots.

    Limitations:
        No soft iron, no field of the motors' currents.

    References:
        IGRF-13 (Alken et al. 2021, Earth, Planets and Space 73, 49): between Frankfurt and Prague
        49 uT in 2020, dipping by 66 deg. ST LIS3MDL data sheet: 6842 counts a gauss.

    Example:
        >>> SensorMagnetometer().channels()
        {'magnetic_field': 3}
    """

    rate: float = setting(50.0, "Hz", bounds=(0.01, 1e4), source="chosen")
    east: float = param(1.2e-6, "T", bounds=(-1e-3, 1e-3), tolerance=1e-6, source="IGRF-13")
    north: float = param(2.0e-5, "T", bounds=(-1e-3, 1e-3), tolerance=1e-6, source="IGRF-13")
    up: float = param(-4.5e-5, "T", bounds=(-1e-3, 1e-3), tolerance=1e-6, source="IGRF-13")
    noise: float = param(3.5e-7, "T", bounds=(0.0, 1e-3), tolerance=1e-7, source="chosen")
    gain_error: float = param(0.0, "1", bounds=(-0.9, 0.9), tolerance=0.02, source="chosen")
    hard_iron: list[float] = vector((0.0, 0.0, 0.0), "T", bounds=(-1.0, 1.0), source="chosen")
    resolution: float = setting(1.46e-8, "T", bounds=(0.0, 1e-3), source="LIS3MDL at 4 gauss")

    late: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Store the field as a vector."""
        check_tree(self, where="magnetometer")
        super().__post_init__()
        self._field = np.array([self.east, self.north, self.up])

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"magnetic_field": 3}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return the field in the sensor's axes."""
        return {"magnetic_field": self._field @ felt.rotation}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of the field."""
        law = Noise(
            sigma=self.noise,
            gain=self.gain_error,
            bias=np.asarray(self.hard_iron, dtype=float),
            step=self.resolution,
        )
        return {"magnetic_field": law}
