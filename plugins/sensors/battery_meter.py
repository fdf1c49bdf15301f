"""Battery voltage and current meter."""

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
class SensorBatteryMeter(Instrument):
    """Terminal voltage under load and current of the battery.

    Equation:
        battery_voltage = U + voltage_bias + noise; battery_current = I (1 + current_error) +
        current_bias + noise; both rounded to whole steps.

    Args:
        rate: readings a second [Hz].
        voltage_noise: standard deviation [V].
        voltage_bias: constant error [V].
        voltage_step: quantisation, 0 for none [V].
        current_noise: standard deviation [A].
        current_bias: constant error [A].
        current_error: error of the scale [1].
        current_step: quantisation, 0 for none [A].

    Assumptions:
        Both are read at one instant.

    Valid range:
        Rates up to that of the simulation.

    Limitations:
        No ripple of the speed controllers; the state of charge is not read.

    References:
        Noise and steps chosen, as of a 12-bit converter over 60 V and a shunt for 120 A.

    Example:
        >>> SensorBatteryMeter().channels()
        {'battery_voltage': 1, 'battery_current': 1}
    """

    rate: float = setting(10.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    voltage_noise: float = param(0.01, "V", bounds=(0.0, 100.0), tolerance=0.01, source="chosen")
    voltage_bias: float = param(0.0, "V", bounds=(-100.0, 100.0), tolerance=0.05, source="chosen")
    voltage_step: float = setting(0.0146, "V", bounds=(0.0, 100.0), source="12 bits over 60 V")
    current_noise: float = param(0.05, "A", bounds=(0.0, 1e3), tolerance=0.05, source="chosen")
    current_bias: float = param(0.0, "A", bounds=(-1e3, 1e3), tolerance=0.1, source="chosen")
    current_error: float = param(0.0, "1", bounds=(-0.9, 0.9), tolerance=0.02, source="chosen")
    current_step: float = setting(0.0293, "A", bounds=(0.0, 1e3), source="12 bits over 120 A")

    def bind(self, outfit: RobotEquipment) -> None:
        """Refuse a robot without a battery.

        Raises:
            ConfigError: the robot has none.
        """
        if not outfit.battery:
            raise ConfigError(
                "sensor battery_meter: the robot has no battery.\n"
                "Add one: +effect@effects.battery=battery"
            )

    def channels(self) -> dict[str, int]:
        """Return the channels."""
        return {"battery_voltage": 1, "battery_current": 1}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return voltage and current."""
        voltage, current, _ = felt.board.battery_state()
        seen = {"battery_voltage": np.array([voltage]), "battery_current": np.array([current])}
        return seen, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of voltage and current."""
        volts = Noise(sigma=self.voltage_noise, bias=self.voltage_bias, step=self.voltage_step)
        amperes = Noise(
            sigma=self.current_noise,
            bias=self.current_bias,
            gain=self.current_error,
            step=self.current_step,
        )
        return {"battery_voltage": volts, "battery_current": amperes}
