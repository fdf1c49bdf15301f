"""When, where and how a missing force acts, and a formula for one that has no name."""

from seals.localise.formula import Formula
from seals.localise.localisation import Localisation, localise
from seals.localise.residual import Residual
from seals.localise.signature import Signature

__all__ = ["Formula", "Localisation", "Residual", "Signature", "localise"]
