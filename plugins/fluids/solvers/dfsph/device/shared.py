"""Kernels of divergence-free SPH that run device functions shared by all solvers."""

from seals.plugins.fluids.solvers.pbf.device.pressure import Pressure
from seals.plugins.fluids.solvers.pbf.device.substep import Stages
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class SharedParts:
    """Parts of a substep between which the host looks at residuals.

    Args:
        stages: what all solvers share.
        pressure: forces on bodies.
    """

    def __init__(self, stages: Stages, pressure: Pressure) -> None:
        self.stages, self.pressure, self.bodies = stages, pressure, stages.bodies

    @ti.kernel
    def sort(self, moving: ti.template()):
        """Sort and search, see `Stages.sort`."""
        self.stages.sort(moving)

    @ti.kernel
    def change_velocities(self, moving: ti.template()):
        """Viscosity, friction and surface tension, see `Stages.change_velocities`."""
        self.stages.change_velocities(moving)

    @ti.kernel
    def predict(self):
        """Move bodies by their known loads."""
        self.bodies.predict()

    @ti.kernel
    def react(self):
        """Let bodies answer to the last changes of the multipliers."""
        self.pressure.react()
        self.bodies.gather()

    @ti.kernel
    def fill_gaps(self):
        """Press bodies off the walls that they lie on."""
        self.stages.fill_gaps()

    @ti.kernel
    def travel(self):
        """Let bodies answer to what has touched them, and move them."""
        self.bodies.gather()
        self.bodies.travel()
