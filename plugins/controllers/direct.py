"""Controller with externally set commands; joints follow the guide where none is set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.limbs import joint_targets, stowed
from seals.control.protocols import ControllerOptions
from seals.schema import param


@dataclass(kw_only=True)
class Direct(ControllerOptions):
    """Passes set commands (`tell`) to drives and servos; joints without one follow the guide.

    Drives without a command rest. So an arm moves (``guide=hover guide.arm=sweep``) on a robot that
    has no drives, bolted to the world or free.

    Args:
        rate: calls a second [Hz].

    Example:
        >>> Direct(rate=100.0).rate
        100.0
    """

    rate: float = param(
        250.0, "Hz", bounds=(1.0, 1e4), tolerance=0.0, source="chosen: every step", fit=False
    )
    sense: ClassVar[str] = "truth"
    needs_mass_properties: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Start without commands."""
        self._wanted: Floats = np.zeros(0)

    def tell(self, commands: Floats) -> None:
        """Set the commands from the next call on: the drives [rad/s or N], then the joints."""
        self._wanted = commands

    def bind(self, plant: Plant) -> None:
        """Store the limits of drives and joints."""
        layout, robot = plant.layout, plant.robot
        self._robot, self._drives = robot, layout.drives
        self._low = np.concatenate((layout.low, robot.lower))
        self._high = np.concatenate((layout.limit, robot.upper))

    def start(self) -> Any:
        """Return the joint targets at rest, shape (J,)."""
        return stowed(self._robot)

    def command(
        self, situation: RobotState, aim: Reference, memory: Any
    ) -> tuple[ActuatorCommand, Any]:
        """Return the commands that were set.

        Where they are missing or not finite, drives rest and joints go where the guide says.
        """
        joints = joint_targets(aim, memory, self._robot)
        wanted = np.concatenate((np.zeros(self._drives), joints))
        given = self._wanted[: len(wanted)]
        wanted[: len(given)] = np.where(np.isfinite(given), given, wanted[: len(given)])
        wanted = np.clip(wanted, self._low, self._high)
        return ActuatorCommand(wanted[: self._drives], wanted[self._drives :]), joints
