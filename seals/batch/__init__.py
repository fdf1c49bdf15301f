"""Batch dynamics: equations of motion of many robots in one array, without contacts."""

from seals.batch.model import BatchDynamics as BatchDynamics
from seals.batch.state import Rates as Rates
from seals.batch.state import TwinState as TwinState
