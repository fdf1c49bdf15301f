"""Control: interfaces of guides and controllers, control allocation, state estimates."""

from seals.control.plant import Layout, Plant
from seals.control.protocols import (
    ActuatorCommand,
    Buoyancy,
    Controller,
    Guide,
    Reference,
    RobotState,
)
from seals.deprecation import renamed_members

__all__ = [
    "ActuatorCommand",
    "Buoyancy",
    "Controller",
    "Guide",
    "Layout",
    "Plant",
    "Reference",
    "RobotState",
]

__getattr__ = renamed_members(
    __name__, {"Aim": "Reference", "Order": "ActuatorCommand", "Situation": "RobotState"}
)
