"""Doppler velocity log: four beams to the bottom."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.frames import cross3
from seals.schema import check_order, param, setting
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import SensorInput

BEAMS = 4
LEAST = 3
"""Beams that a velocity needs."""
BEAM, RANGE, SPIN = "dvl_beam_velocity", "dvl_beam_range", "dvl_spin"


@roles(data="at_origin")
@dataclass(kw_only=True)
class SensorDvl(Instrument):
    """Doppler velocity log: velocity over ground from four slanted beams with bottom lock.

    Equation:
        b_k = d_k . v (1 + scale_error) + noise, with d_k = (sin a cos c_k, sin a sin c_k, -cos a)
        in the sensor's axes, a the beam angle, c_k = azimuth + k 90 deg; v = pinv(D) b over the
        beams that return, turned into link axes, less w x r of the mounting when ``at_origin``. A
        beam returns if sensor and footprint are under water and its range times cos a lies
        between ``nearest`` and ``farthest``; the velocity is valid with three beams.

    Args:
        rate: readings a second [Hz].
        beam_angle: a, of the beams against the axis, which is -z of the sensor [rad].
        azimuth: of the first beam from x, anticlockwise seen from above [rad].
        noise: standard deviation of one beam's velocity [m/s].
        scale_error: of all velocities, as from a wrong speed of sound [1].
        bias: constant error of the velocity, sensor axes [m/s].
        range_noise: standard deviation of one beam's range, as a share of ``farthest`` [1].
        spin_noise: standard deviation of the gyroscope behind ``at_origin`` [rad/s].
        nearest: least altitude along the axis [m].
        farthest: largest altitude along the axis [m].
        largest_tilt: of the axis against the vertical [rad].
        fastest: largest velocity along a beam [m/s].
        at_origin: whether the velocity is that of the link's origin rather than the sensor's own.

    Assumptions:
        Beams are lines; all four are heard at one instant, at which the reading is taken.

    Valid range:
        Bottoms without weed; speeds below ``fastest``.

    Limitations:
        No water track: without the bottom there is no velocity. Noise does not grow with range. A
        beam that another body hides does not return.

    References:
        Water Linked DVL-A50 documentation: 0.05 to 50 m, 1 MHz, 4 to 26 Hz, long-term accuracy
        0.1 cm/s, speeds up to 2 m/s. Beam angle of 22.5 deg and largest tilt are chosen.
        Brokloff 1994, IEEE OCEANS (beams to velocity).

    Example:
        >>> SensorDvl().channels()["velocity"]
        3
    """

    rate: float = setting(10.0, "Hz", bounds=(0.01, 1e3), source="DVL-A50: 4 to 26 Hz")
    beam_angle: float = setting(0.3927, "rad", bounds=(0.05, 1.4), source="chosen: 22.5 deg")
    azimuth: float = setting(0.7854, "rad", bounds=(-6.3, 6.3), source="chosen: crosswise")
    noise: float = param(
        0.01, "m/s", bounds=(0.0, 10.0), tolerance=0.005, source="chosen: 1 cm/s a ping"
    )
    scale_error: float = param(
        0.0, "1", bounds=(-0.5, 0.5), tolerance=0.01, source="DVL-A50 standard edition: 1 %"
    )
    bias: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    range_noise: float = param(
        0.001, "1", bounds=(0.0, 1.0), tolerance=0.001, source="chosen: 5 cm of 50 m"
    )
    spin_noise: float = param(0.005, "rad/s", bounds=(0.0, 1.0), tolerance=0.002, source="chosen")
    nearest: float = setting(0.05, "m", bounds=(0.0, 1e4), source="DVL-A50")
    farthest: float = setting(50.0, "m", bounds=(1e-3, 1e4), source="DVL-A50")
    largest_tilt: float = setting(0.5236, "rad", bounds=(0.0, 1.5), source="chosen: 30 deg")
    fastest: float = setting(2.0, "m/s", bounds=(1e-3, 1e3), source="DVL-A50: 2 m/s")
    at_origin: bool = True

    late: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Turn angles into beams."""
        super().__post_init__()
        check_order(self, "nearest", "farthest", where="dvl")
        if len(self.bias) != 3:
            raise ConfigError(f"dvl: bias={self.bias}.\nAllowed: three numbers.")
        a, c = self.beam_angle, self.azimuth + 0.5 * math.pi * np.arange(BEAMS)
        flat = math.sin(a)
        self._beams: Floats = np.stack(
            [flat * np.cos(c), flat * np.sin(c), np.full(BEAMS, -math.cos(a))], axis=1
        )
        self._solver: Floats = np.asarray(np.linalg.pinv(self._beams), dtype=float)

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        beams = {BEAM: BEAMS, RANGE: BEAMS}
        return {"velocity": 3, "velocity_valid": 1, "dvl_altitude": 1, **beams}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return velocity and range along the returning beams, and the angular velocity."""
        ranges = self._returns(felt)
        speeds = self._beams @ felt.velocity
        heard = np.isfinite(ranges) & (np.abs(speeds) <= self.fastest)
        ranges = np.where(heard, ranges, math.nan)
        speeds = np.where(heard, speeds, math.nan)
        return {BEAM: speeds, RANGE: ranges, SPIN: felt.angular_velocity}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of beams, ranges and angular velocity."""
        return {
            BEAM: Noise(sigma=self.noise, gain=self.scale_error),
            RANGE: Noise(sigma=self.range_noise * self.farthest),
            SPIN: Noise(sigma=self.spin_noise if self.at_origin and not self._mount.centred else 0),
        }

    def solve(self, seen: TrueValues, felt: SensorInput) -> dict[str, Floats]:
        """Return the velocity, where at least three beams return."""
        speeds, ranges = seen[BEAM], seen[RANGE]
        heard = np.isfinite(speeds)
        out = {BEAM: speeds, RANGE: ranges, "velocity_valid": np.array([0.0])}
        if np.count_nonzero(heard) < LEAST:
            return out
        solver = self._solver if heard.all() else np.linalg.pinv(self._beams[heard])
        own = solver @ speeds[heard] + self.bias
        velocity = self._mount.turn @ own
        if self.at_origin and not self._mount.centred:
            velocity = velocity - cross3(self._mount.turn @ seen[SPIN], self._mount.arm)
        altitude = np.array([np.mean(ranges[heard]) * math.cos(self.beam_angle)])
        return {**out, "velocity": velocity, "velocity_valid": np.ones(1), "dvl_altitude": altitude}

    def sigmas(self) -> dict[str, float]:
        """Return the standard deviations of the white noise, for the velocity the largest axis."""
        each = np.sqrt(np.diag(np.linalg.inv(self._beams.T @ self._beams)))
        ranges = self.range_noise * self.farthest
        return {BEAM: self.noise, RANGE: ranges, "velocity": self.noise * float(each.max())}

    def _returns(self, felt: SensorInput) -> Floats:
        """Ranges of the beams that return, NaN for the others."""
        around, none = felt.around, np.full(BEAMS, math.nan)
        axis_down = felt.rotation[2, 2]
        if axis_down < math.cos(self.largest_tilt) or not around.wet(felt.time, felt.position):
            return none
        ways = self._beams @ felt.rotation.T
        ranges = around.ground_ahead(felt.position, ways)
        hidden = around.bodies_ahead(felt.position, ways) < ranges
        altitude = ranges * math.cos(self.beam_angle)
        good = (altitude >= self.nearest) & (altitude <= self.farthest) & ~hidden
        if good.any():
            feet = felt.position + np.where(good, ranges, 0.0)[:, None] * ways
            good &= feet[:, 2] < around.surface(felt.time, feet)
        return np.where(good, ranges, none)
