"""Odometry: noisy pose and velocity at a rate of its own."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.control.estimate import ORIENTATION, POSITION, SPIN, VELOCITY
from seals.frames import exponential, multiply, quaternion_of
from seals.schema import param, setting
from seals.sensors.mount import MountedSensor
from seals.sensors.protocol import SensorInput

_SIGMA: dict[str, Any] = {"tolerance": 0.3, "relative": True}


@dataclass(kw_only=True)
class SensorOdometry(MountedSensor):
    """Pose and twist of a link, as motion capture or odometry report them.

    Equation:
        estimated_position = p + n_p; estimated_velocity = v + n_v in link axes;
        estimated_orientation = q exp(n_q / 2), x y z w turned to w x y z;
        estimated_spin = w + n_w, all n white and normal.

    Args:
        rate: readings per second [Hz].
        position_noise: standard deviation of each component [m].
        velocity_noise: standard deviation of each component [m/s].
        attitude_noise: standard deviation of a small turn about each axis [rad].
        gyroscope_noise: noise density of the rates [rad/s/sqrt(Hz)].

    Assumptions:
        Errors are white: drift is left out.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        No drift of the position, no bias of the gyroscope; see ``imu`` for those.

    References:
        Noise as of motion capture with onboard filtering: chosen.

    Example:
        >>> SensorOdometry(rate=100.0).rate
        100.0
    """

    rate: float = setting(250.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    position_noise: float = param(0.001, "m", bounds=(0.0, 10.0), source="chosen", **_SIGMA)
    velocity_noise: float = param(0.01, "m/s", bounds=(0.0, 10.0), source="chosen", **_SIGMA)
    attitude_noise: float = param(0.002, "rad", bounds=(0.0, 1.0), source="chosen", **_SIGMA)
    gyroscope_noise: float = param(
        9e-5,
        "rad/s/sqrt(Hz)",
        bounds=(0.0, 1.0),
        source="InvenSense MPU-6000 class, data sheet 0.005 deg/s/sqrt(Hz)",
        **_SIGMA,
    )

    idles: ClassVar[bool] = True
    late: ClassVar[bool] = True

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {POSITION: 3, ORIENTATION: 4, VELOCITY: 3, SPIN: 3}

    def start(self, rng: np.random.Generator) -> Any:
        """Return an empty state: white noise has no memory."""
        return None

    def sense(
        self, felt: SensorInput, memory: Any, rng: np.random.Generator, *, due: bool
    ) -> tuple[dict[str, Floats] | None, Any]:
        """Return a reading when due."""
        if not due:
            return None, memory
        noise = rng.standard_normal((4, 3))
        turn = quaternion_of(felt.rotation)
        small = exponential(self.attitude_noise * noise[2:3])
        x, y, z, w = multiply(turn[None], small)[0]
        density = self.gyroscope_noise * math.sqrt(self.rate)
        return {
            POSITION: felt.position + self.position_noise * noise[0],
            ORIENTATION: np.array([w, x, y, z]),
            VELOCITY: felt.velocity + self.velocity_noise * noise[1],
            SPIN: felt.angular_velocity + density * noise[3],
        }, memory
