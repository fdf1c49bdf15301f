"""Residual force of a model: time course, location, dependences, and a fitted formula."""

from seals.sysid.residual_force.formula import Formula
from seals.sysid.residual_force.localisation import Localisation, locate_residual_force
from seals.sysid.residual_force.residual import Residual
from seals.sysid.residual_force.signature import Signature

__all__ = ["Formula", "Localisation", "Residual", "Signature", "locate_residual_force"]
