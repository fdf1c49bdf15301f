"""Coupling of the SEALS dynamics to a rigid-body engine.

An engine integrates rigid links under wrenches and joint forces with first-order steps. Added mass
that is not isotropic, joint drives of any stiffness and second-order steps are put on top of it
here, once for all engines: `CoupledBody` is the `seals.backend.RigidBody` of a robot, made from the
calls of `EngineBody`. The backend opens the scene, steps the engine and calls
`CoupledBody.after_step` of every robot after each step.
"""

from seals.coupling.body import CoupledBody as CoupledBody
from seals.coupling.body import HalfStep as HalfStep
from seals.coupling.engine import ContactPoints as ContactPoints
from seals.coupling.engine import EngineBody as EngineBody
from seals.coupling.engine import ImplicitDrive as ImplicitDrive
from seals.coupling.engine import SolvingEngineBody as SolvingEngineBody
from seals.coupling.engine import drive_over as drive_over
