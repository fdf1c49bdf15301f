"""The batched twin: a free or bolted robot with moving joints, for fitting and for thousands."""

from seals.twin.model import Twin
from seals.twin.state import Rates, TwinState

__all__ = ["Rates", "Twin", "TwinState"]
