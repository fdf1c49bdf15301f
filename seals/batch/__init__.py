"""The batched twin: a free or bolted robot with moving joints, for fitting and for thousands."""

from seals.batch.model import Twin
from seals.batch.state import Rates, TwinState

__all__ = ["Rates", "Twin", "TwinState"]
