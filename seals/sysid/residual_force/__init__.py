"""When, where and how a missing force acts, and a formula for one that has no name."""

from seals.sysid.residual_force.formula import Formula
from seals.sysid.residual_force.localisation import Localisation, localise
from seals.sysid.residual_force.residual import Residual
from seals.sysid.residual_force.signature import Signature

__all__ = ["Formula", "Localisation", "Residual", "Signature", "localise"]
