"""Batch dynamics: equations of motion of many robots in one array, without contacts."""

from seals.batch.model import BatchDynamics
from seals.batch.state import Rates, TwinState

__all__ = ["BatchDynamics", "Rates", "TwinState"]
