"""Inertial measurement unit: accelerometer and gyroscope."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.schema import param, setting
from seals.sensors.mount import Mount, PlacedSensor
from seals.sensors.protocol import SensorInput
from seals.state_records import state_record


@state_record
class _Memory(NamedTuple):
    """Biases [m/s^2, rad/s] and the state of the low-pass filter, shape (2, 3) each."""

    bias: Floats
    filtered: Floats | None


@dataclass(kw_only=True)
class SensorImu(PlacedSensor):
    """Accelerometer and gyroscope at a mounting point of a link.

    Equation:
        f = R_SL (f_o + w' x r + w x (w x r)), with f_o the specific force of the link origin (+g
        at rest, 0 in free fall); w_S = R_SL w. Then first-order bandwidth, bias with random walk,
        white noise, range, quantisation.

    Args:
        position: mounting point in link axes [m].
        rpy: turn of the sensor axes against the link axes [rad].
        rate: readings a second [Hz].
        accelerometer_noise: noise density [m/s^2/sqrt(Hz)].
        gyroscope_noise: noise density [rad/s/sqrt(Hz)].
        accelerometer_walk: bias random walk [m/s^2/sqrt(s)].
        gyroscope_walk: bias random walk [rad/s/sqrt(s)].
        accelerometer_range: largest reading [m/s^2].
        gyroscope_range: largest reading [rad/s].
        accelerometer_step: quantisation [m/s^2], 0 for none.
        gyroscope_step: quantisation [rad/s], 0 for none.
        bandwidth: cut-off of the first-order low-pass [Hz], 0 for none.

    Assumptions:
        The accelerometer reads the acceleration of the last simulation step: the change of the mean
        velocity of its link's origin since the step before, over h. Between contacts it is that of
        the forces at the start of the step, in the axes that the link had then; so are w and w' of
        the arm r. The gyroscope reads the velocity at the end of the step.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        No temperature drift, no cross-axis sensitivity, no vibration rectification. A unit that is
        slower than the simulation reads single steps, not means over its period, but for its
        ``bandwidth``.

    References:
        IEEE Std 952-1997, annex C (noise terms); Woodman 2007, UCAM-CL-TR-696.

    Example:
        >>> SensorImu(rate=100.0).rate
        100.0
    """

    rate: float = setting(250.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    accelerometer_noise: float = param(
        2e-3,
        "m/s^2/sqrt(Hz)",
        bounds=(0.0, 10.0),
        tolerance=5e-4,
        source="InvenSense MPU-6000 class, data sheet 0.4 mg/sqrt(Hz) halved",
    )
    gyroscope_noise: float = param(
        9e-5,
        "rad/s/sqrt(Hz)",
        bounds=(0.0, 1.0),
        tolerance=2e-5,
        source="InvenSense MPU-6000 class, data sheet 0.005 deg/s/sqrt(Hz)",
    )
    accelerometer_walk: float = param(
        1e-4, "m/s^2/sqrt(s)", bounds=(0.0, 1.0), tolerance=1e-4, source="chosen"
    )
    gyroscope_walk: float = param(
        1e-5, "rad/s/sqrt(s)", bounds=(0.0, 1.0), tolerance=1e-5, source="chosen"
    )
    accelerometer_range: float = setting(
        156.9, "m/s^2", bounds=(1.0, 1e5), source="16 g, data sheet"
    )
    gyroscope_range: float = setting(
        34.9, "rad/s", bounds=(0.1, 1e4), source="2000 deg/s, data sheet"
    )
    accelerometer_step: float = setting(
        4.79e-3, "m/s^2", bounds=(0.0, 10.0), source="16 bit over 16 g, data sheet"
    )
    gyroscope_step: float = setting(
        1.065e-3, "rad/s", bounds=(0.0, 1.0), source="16 bit over 2000 deg/s, data sheet"
    )
    bandwidth: float = setting(0.0, "Hz", bounds=(0.0, 1e5), source="chosen: none")

    def __post_init__(self) -> None:
        """Turn mounting and errors into arrays."""
        self._mount = Mount("imu", self.position, self.rpy)
        # arrays of one shape: broadcasting would take four times as long
        self._range = _rows(self.accelerometer_range, self.gyroscope_range)
        self._lowest = -self._range
        self._step = _rows(self.accelerometer_step, self.gyroscope_step)
        self._coarse = int((self._step[:, 0] > 0.0).sum())
        self._grid = np.where(self._step > 0.0, self._step, 1.0)
        density = _rows(self.accelerometer_noise, self.gyroscope_noise)
        self._sigma = density * math.sqrt(self.rate)
        walk = _rows(self.accelerometer_walk, self.gyroscope_walk)
        self._drift = walk * math.sqrt(1.0 / self.rate)

    inertial: ClassVar[bool] = True
    late: ClassVar[bool] = True

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"specific_force": 3, "angular_velocity": 3}

    def start(self, rng: np.random.Generator) -> Any:
        """Return zero bias and an empty filter."""
        return _Memory(np.zeros((2, 3)), None)

    def draws(self) -> int | None:
        """Return how many numbers a reading draws: a low-pass looks at every step."""
        return None if self.bandwidth > 0.0 else 12

    def passed(self, memory: Any, noise: Floats) -> Any:
        """Return the memory after readings: the bias walks."""
        return _Memory(self._walked(memory.bias, noise)[-1], memory.filtered)

    def _walked(self, bias: Floats, noise: Floats) -> Floats:
        """Biases of readings, shape (N, 2, 3), from that before them."""
        walk = self._drift * noise.reshape(-1, 2, 2, 3)[:, 0]
        walk[0] += bias
        # one after the other, as `sense` adds them
        found: Floats = np.add.accumulate(walk, axis=0)
        return found

    def taken(self, felt: SensorInput, memory: Any, noise: Floats) -> tuple[dict[str, Floats], Any]:
        """Return readings, a row each, and the memory after them."""
        if self._mount.plain and felt.axis_misalignment is None:
            true = np.stack((felt.specific_force, felt.angular_velocity), axis=1)
        else:
            true = np.array([self.ideal(felt.row(k)) for k in range(len(noise))])
        bias = self._walked(memory.bias, noise)
        reading = self._reading(bias, true, noise.reshape(-1, 2, 2, 3)[:, 1])
        found = {"specific_force": reading[:, 0], "angular_velocity": reading[:, 1]}
        return found, _Memory(bias[-1], memory.filtered)

    def ideal(self, felt: SensorInput) -> Floats:
        """Specific force and angular velocity at the mounting point, sensor axes, shape (2, 3)."""
        here = self._mount.felt(felt)
        return np.array((here.specific_force, here.angular_velocity))

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return a reading when due."""
        bias, filtered = memory
        true: Floats | None = None
        if self.bandwidth > 0.0:
            true = self.ideal(felt)
            keep = math.exp(-2.0 * math.pi * self.bandwidth * felt.step)
            filtered = true if filtered is None else keep * filtered + (1.0 - keep) * true
            true = filtered
        if not due:
            return None, _Memory(bias, filtered)
        true = self.ideal(felt) if true is None else true
        noise = rng.standard_normal((2, 2, 3))
        bias = bias + self._drift * noise[0]
        reading = self._reading(bias, true, noise[1])
        return {"specific_force": reading[0], "angular_velocity": reading[1]}, _Memory(
            bias, filtered
        )

    def _reading(self, bias: Floats, true: Floats, noise: Floats) -> Floats:
        """Readings of true values within range, in whole steps; shapes (2, 3) or (N, 2, 3)."""
        reading: Floats = self._sigma * noise
        reading += bias
        reading += true
        np.maximum(reading, self._lowest, out=reading)
        np.minimum(reading, self._range, out=reading)
        if self._coarse:
            whole = np.rint(reading / self._grid)
            whole *= self._grid
            reading = whole if self._coarse == 2 else np.where(self._step > 0.0, whole, reading)
        return reading


def _rows(accelerometer: float, gyroscope: float) -> Floats:
    """Three equal numbers for either instrument, shape (2, 3)."""
    return np.repeat([[accelerometer], [gyroscope]], 3, axis=1)
