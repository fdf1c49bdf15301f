"""Joint encoders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from seals.errors import refuse_unlisted
from seals.field_roles import roles
from seals.schema import param, setting
from seals.sensors.instrument import Instrument, TrueValues
from seals.sensors.noise import Noise
from seals.sensors.protocol import RobotEquipment, SensorInput


@roles(data="joints")
@dataclass(kw_only=True)
class SensorEncoders(Instrument):
    """Joint encoders: positions in whole counts, measured on the link side of the gear.

    Equation:
        joint_position = q + bias + noise, rounded to whole steps.

    Args:
        joints: names of the joints that are read; empty for all, in the order of the robot.
        rate: readings a second [Hz].
        resolution: one count [rad or m].
        noise: standard deviation of a reading [rad or m].
        bias: error of the zero, the same for all [rad or m].

    Assumptions:
        No backlash between joint and encoder.

    Valid range:
        Any joint speed: counts are not lost.

    Limitations:
        One resolution for all joints; no eccentricity. Take several for different joints.

    References:
        ams AS5600 data sheet: 12 bit a turn.

    Example:
        >>> sensor = SensorEncoders(resolution=0.01)
        >>> sensor.bind(RobotEquipment(joints=("hip", "knee")))
        >>> sensor.channels()
        {'joint_position': 2}
    """

    joints: list[str] = field(default_factory=list)
    rate: float = setting(100.0, "Hz", bounds=(0.01, 1e5), source="chosen")
    resolution: float = setting(
        0.001534, "rad or m", bounds=(0.0, 10.0), source="AS5600: 4096 counts per turn"
    )
    noise: float = param(0.0, "rad or m", bounds=(0.0, 10.0), tolerance=0.001, source="chosen")
    bias: float = param(0.0, "rad or m", bounds=(-10.0, 10.0), tolerance=0.005, source="chosen")

    def __post_init__(self) -> None:
        """Number the joints as stated, until the robot is known."""
        super().__post_init__()
        self._columns = list(range(len(self.joints)))

    def bind(self, outfit: RobotEquipment) -> None:
        """Find the joints.

        Raises:
            ConfigError: the robot has no such joint, or none.
        """
        for name in self.joints or [""] * (not outfit.joints):
            refuse_unlisted(
                name, outfit.joints, f"encoders: the robot has no joint '{name}'", label="Joints"
            )
        self._columns = [outfit.joints.index(name) for name in self.joints or outfit.joints]

    def channels(self) -> dict[str, int]:
        """Return the channels; one component for each joint once the robot is known."""
        return {"joint_position": len(self._columns) or 1}

    def look(self, felt: SensorInput, own: Any) -> tuple[TrueValues | None, Any]:
        """Return the joint positions."""
        return {"joint_position": np.asarray(felt.board.joints())[self._columns]}, own

    def noise_laws(self) -> Mapping[str, Noise]:
        """Return the error models of the positions."""
        law = Noise(sigma=self.noise, bias=self.bias, step=self.resolution)
        return {"joint_position": law}
