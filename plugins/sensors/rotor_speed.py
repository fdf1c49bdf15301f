"""Rotor speeds, as electronic speed controllers report them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from seals.errors import ConfigError
from seals.schema import param, setting
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import RobotEquipment, SensorInput


@dataclass(kw_only=True)
class SensorRotorSpeed(Instrument):
    """Speed of every rotor, positive in its own direction of turning.

    Equation:
        rotor_speed = w (1 + gain_error) + noise, rounded to whole steps; w is the speed that
        medium, lag and battery really leave it, in the last step of the simulation.

    Args:
        rate: readings a second [Hz].
        noise: standard deviation of a reading [rad/s].
        bias: constant error [rad/s].
        gain_error: error of the scale [1].
        resolution: quantisation, 0 for none [rad/s].

    Assumptions:
        All rotors are read at one instant.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        No sign is lost in reverse, as it is with many controllers. Thrusters have no speed.

    References:
        BLHeli_32 telemetry: steps of 100 electrical revolutions a minute; seven pole pairs.

    Example:
        >>> sensor = SensorRotorSpeed()
        >>> sensor.bind(RobotEquipment(rotors=4))
        >>> sensor.channels()
        {'rotor_speed': 4}
    """

    rate: float = setting(50.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    noise: float = param(1.0, "rad/s", bounds=(0.0, 1e4), tolerance=1.0, source="chosen")
    bias: float = param(0.0, "rad/s", bounds=(-1e4, 1e4), tolerance=1.0, source="chosen")
    gain_error: float = param(0.0, "1", bounds=(-0.9, 0.9), tolerance=0.001, source="chosen")
    resolution: float = setting(1.496, "rad/s", bounds=(0.0, 1e4), source="BLHeli_32, 7 pole pairs")

    _rotors = 1

    def bind(self, outfit: RobotEquipment) -> None:
        """Count the rotors.

        Raises:
            ConfigError: the robot has none.
        """
        if not outfit.rotors:
            raise ConfigError(
                "sensor rotor_speed: the robot has no rotors.\n"
                "Thrusters report no speed; remove the sensor."
            )
        self._rotors = outfit.rotors

    def channels(self) -> dict[str, int]:
        """Return the channels; one component for each rotor once the robot is known."""
        return {"rotor_speed": self._rotors}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return the speeds."""
        return {"rotor_speed": np.asarray(felt.board.rotors(), dtype=float)}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of the speeds."""
        law = Noise(sigma=self.noise, bias=self.bias, gain=self.gain_error, step=self.resolution)
        return {"rotor_speed": law}
