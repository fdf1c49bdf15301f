"""The batched twin: a floating-base or bolted robot with moving joints, for fitting and for thousands at once."""

from seals.twin.model import Twin
from seals.twin.state import Rates, TwinState

__all__ = ["Rates", "Twin", "TwinState"]
