"""Controller with externally set commands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.control import ActuatorCommand, Plant, Reference, RobotState
from seals.control.limbs import stowed
from seals.control.protocols import ControllerOptions
from seals.schema import param


@dataclass(kw_only=True)
class Direct(ControllerOptions):
    """Passes externally set commands (`tell`) to drives and servos; at rest until the first ones.

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
        self._drives = layout.drives
        self._low = np.concatenate((layout.low, robot.lower))
        self._high = np.concatenate((layout.limit, robot.upper))
        self._rest = np.concatenate((np.zeros(layout.drives), stowed(robot)))

    def start(self) -> Any:
        """Return an empty state."""
        return ()

    def command(
        self, situation: RobotState, aim: Reference, memory: Any
    ) -> tuple[ActuatorCommand, Any]:
        """Return the commands that were set; those that are missing or not finite rest."""
        wanted, given = self._rest.copy(), self._wanted[: len(self._rest)]
        wanted[: len(given)] = np.where(np.isfinite(given), given, wanted[: len(given)])
        wanted = np.clip(wanted, self._low, self._high)
        return ActuatorCommand(wanted[: self._drives], wanted[self._drives :]), memory
