"""Residual force of a model: time course, location, dependences, and a fitted formula."""

from seals.sysid.residual_force.formula import Formula as Formula
from seals.sysid.residual_force.localisation import Localisation as Localisation
from seals.sysid.residual_force.localisation import locate_residual_force as locate_residual_force
from seals.sysid.residual_force.localisation import residual_of as residual_of
from seals.sysid.residual_force.residual import Residual as Residual
from seals.sysid.residual_force.signature import Signature as Signature
