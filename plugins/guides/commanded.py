"""Guide with an external reference: from a learner, a script, another process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from seals.control import Plant, Reference, RobotState
from seals.control.protocols import Steady
from seals.schema import setting


@dataclass(kw_only=True)
class Commanded:
    """Guide with an externally set reference (`tell`); at rest until the first one.

    Args:
        rate: calls a second [Hz].

    Example:
        >>> guide = Commanded()
        >>> guide.tell(Reference(yaw=0.5))
        >>> guide.wanted.yaw
        0.5
    """

    rate: float = setting(250.0, "Hz", bounds=(1.0, 1e4), source="chosen: every step")

    def __post_init__(self) -> None:
        """Start without a reference."""
        self.wanted = Reference()

    def tell(self, aim: Reference) -> None:
        """Set the reference from the next call on."""
        self.wanted = aim

    def bind(self, plant: Plant) -> None:
        """Accept any robot."""

    def start(self, situation: RobotState) -> Any:
        """Return an empty state."""
        return ()

    def aim(self, situation: RobotState, memory: Any) -> tuple[Reference, Any]:
        """Return the reference that was set."""
        return self.wanted, memory

    def steady(self, memory: Any) -> Steady:
        """Return the reference that was set."""
        return Steady(self.wanted)

    def finished(self, memory: Any) -> bool | None:
        """Return None: the caller decides when to stop."""
        return None

    def stage(self, memory: Any) -> str:
        """Return ``commanded``, the only stage."""
        return "commanded"
