"""Pressure sensor that measures depth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.environment.seawater import FRESH_WATER
from seals.schema import param, setting
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput


@dataclass(kw_only=True)
class SensorPressure(Instrument):
    """Gauge pressure of the water, and the depth computed from it.

    Equation:
        p = integral of rho (g + a_z) from the port to the local surface, a_z the vertical
        acceleration of the water as far below its mean level, rho by depth; reading =
        p (1 + gain_error) + bias + drift + noise; depth = reading / (density gravity).

    Args:
        rate: readings a second [Hz].
        noise: standard deviation of a reading [Pa].
        bias: constant error [Pa].
        gain_error: error of the scale [1].
        drift: standard deviation of the slow error in the long run [Pa].
        drift_time: its time constant [s].
        resolution: quantisation, 0 for none [Pa].
        largest: pressure at which it saturates [Pa].
        density: of the water, as the sensor believes for the depth [kg/m^3].
        gravity: likewise [m/s^2].
        shallowest: least depth that is given, as above it the port may be in air [m].

    Assumptions:
        The flow about the body does not change the pressure at the port.

    Valid range:
        Depths up to that of ``largest``.

    Limitations:
        No dynamic pressure, no temperature. The depth is that of the port; in a log ``depth`` is
        that of the body origin, so mount it there or correct it.

    References:
        TE Connectivity, MS5837-30BA data sheet: 0 to 30 bar, resolution 0.2 mbar. Newman 1977,
        Marine Hydrodynamics, section 6.1 (pressure in waves); Wheeler 1970, Offshore Technology
        Conference 1006 (up to the surface as it is).

    Example:
        >>> SensorPressure(noise=0.0).channels()
        {'pressure': 1, 'depth': 1}
    """

    rate: float = setting(50.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    noise: float = param(20.0, "Pa", bounds=(0.0, 1e6), tolerance=10.0, source="MS5837: 0.2 mbar")
    bias: float = param(
        0.0, "Pa", bounds=(-1e6, 1e6), tolerance=100.0, source="zero: the offset is taken in air"
    )
    gain_error: float = param(0.0, "1", bounds=(-0.9, 0.9), tolerance=0.002, source="chosen")
    drift: float = param(50.0, "Pa", bounds=(0.0, 1e6), tolerance=50.0, source="chosen: 5 mm")
    drift_time: float = param(
        600.0, "s", bounds=(1e-3, 1e7), tolerance=300.0, source="chosen: slower than a dive"
    )
    resolution: float = setting(20.0, "Pa", bounds=(0.0, 1e6), source="MS5837: 0.2 mbar")
    largest: float = setting(2.9e6, "Pa", bounds=(1.0, 2e8), source="MS5837: 30 bar absolute")
    density: float = param(
        round(FRESH_WATER, 1),
        "kg/m^3",
        bounds=(500.0, 2e4),
        tolerance=1.0,
        source="fresh water at 20 degC",
    )
    gravity: float = param(
        9.81, "m/s^2", bounds=(0.1, 30.0), tolerance=0.02, source="standard gravity, rounded"
    )
    shallowest: float = setting(0.02, "m", bounds=(-100.0, 100.0), source="chosen: ten sigmas")

    late: ClassVar[bool] = True

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"pressure": 1, "depth": 1}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return the pressure at the port."""
        return {"pressure": np.array([felt.around.pressure(felt.time, felt.position)])}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of the pressure."""
        law = Noise(
            sigma=self.noise,
            bias=self.bias,
            gain=self.gain_error,
            drift=self.drift,
            drift_time=self.drift_time,
            step=self.resolution,
            high=self.largest,
        )
        return {"pressure": law}

    def solve(self, seen: TrueValues, felt: SensorInput) -> dict[str, Floats]:
        """Return the pressure, and the depth unless the port may be out of the water."""
        depth = seen["pressure"] / (self.density * self.gravity)
        return {**seen, "depth": depth} if depth[0] >= self.shallowest else dict(seen)

    def sigmas(self) -> dict[str, float]:
        """Return the standard deviations by noise and quantisation."""
        spread = self._noise["pressure"].spread
        return {"pressure": spread, "depth": spread / (self.density * self.gravity)}
