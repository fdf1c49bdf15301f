"""Control: what a guide wants, what a controller commands, what both may know."""

from seals.control.plant import Layout, Plant
from seals.control.protocols import Aim, Buoyancy, Controller, Guide, Order, Situation

__all__ = [
    "Aim",
    "Buoyancy",
    "Controller",
    "Guide",
    "Layout",
    "Order",
    "Plant",
    "Situation",
]
