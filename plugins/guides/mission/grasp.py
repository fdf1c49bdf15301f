"""Mission that fetches an object, from a few parameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from seals.plugins.guides.mission.guide import Mission
from seals.schema import setting, vector


@dataclass(kw_only=True)
class Grasp(Mission):
    """Mission that approaches an object, grasps it, lifts it and carries it to a goal.

    Args:
        goal: where the hand shall bring the object, world [m].
        clearance: of the hand above the object before it descends [m].
        unfolded: angles of the arm while it grasps [rad or m].
        stages: not used; they follow from the other values.

    Example:
        >>> [stage.name for stage in Grasp()._stages]
        ['unfold', 'above', 'descend', 'close', 'lift', 'carry', 'hold']
    """

    goal: list[float] = vector((0.0, 0.0, 1.0), "m", bounds=(-1e5, 1e5), source="chosen")
    clearance: float = setting(0.25, "m", bounds=(0.0, 100.0), source="chosen")
    unfolded: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def listed(self) -> list[Any]:
        """Return the stages of the mission."""
        return [
            {"do": "pose", "name": "unfold", "angles": list(self.unfolded), "time": 2.0},
            {"do": "reach", "name": "above", "height": self.clearance, "speed": 0.4},
            {
                "do": "reach",
                "name": "descend",
                "height": 0.0,
                "speed": 0.12,
                "within_height": 0.015,
            },
            {"do": "close", "name": "close"},
            {"do": "rise", "name": "lift", "height": 0.2, "speed": 0.15, "holding": True},
            {"do": "go", "name": "carry", "to": list(self.goal), "hand": True, "holding": True},
            {"do": "wait", "name": "hold", "time": 1.0, "holding": True},
        ]
