"""Guide of a robot that an external autopilot flies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from seals.control import Plant, Reference, RobotState
from seals.schema import param
from seals.teleop.autopilot.link import Link


@dataclass(kw_only=True)
class External:
    """Guide without a reference of its own: the run ends when the autopilot does.

    Args:
        rate: calls a second [Hz].

    Example:
        >>> External().stage(())
        'autopilot'
    """

    rate: float = param(
        1.0, "Hz", bounds=(1e-3, 1e4), tolerance=0.0, source="chosen: nothing changes", fit=False
    )

    def __post_init__(self) -> None:
        """Have no autopilot as yet."""
        self._link: Link | None = None

    def use(self, link: Link) -> None:
        """End with a connection to an autopilot."""
        self._link = link

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def start(self, situation: RobotState) -> Any:
        """Return an empty state."""
        return ()

    def aim(self, situation: RobotState, memory: Any) -> tuple[Reference, Any]:
        """Return no motion, with the present heading."""
        return Reference(yaw=situation.yaw), memory

    def finished(self, memory: Any) -> bool | None:
        """Return True once the autopilot has disconnected."""
        return True if self._link is not None and self._link.ended else None

    def stage(self, memory: Any) -> str:
        """Return ``autopilot``, the only stage."""
        return "autopilot"
