"""Coupling of SEALS' dynamics to a rigid-body engine, whatever the engine.

An engine integrates rigid links under wrenches and joint forces with first-order steps. Added mass
that is not isotropic, joint drives of any stiffness and second-order steps are put on top of it
here, once for all engines: an engine needs the calls of `EngineBody` and nothing else.
"""

from seals.coupling.body import CoupledBody
from seals.coupling.engine import ContactPoints, EngineBody
from seals.coupling.implicit_drive import ImplicitDrive, ImplicitDrives
from seals.coupling.leapfrog import HalfStep

__all__ = [
    "ContactPoints",
    "CoupledBody",
    "EngineBody",
    "HalfStep",
    "ImplicitDrive",
    "ImplicitDrives",
]
