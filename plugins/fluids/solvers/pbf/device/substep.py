"""Order of the device functions of a substep, and the kernels that run it.

A kernel that runs many functions starts them one after the other without the host: at 100,000
particles and less a CUDA device is quicker than calls from Python.
"""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies, BodyNeighbourCount
from seals.plugins.fluids.solvers.pbf.device.cohesion import Adhesion, Cohesion
from seals.plugins.fluids.solvers.pbf.device.finish import Finish
from seals.plugins.fluids.solvers.pbf.device.gap import Gap
from seals.plugins.fluids.solvers.pbf.device.isotropy import Isotropy
from seals.plugins.fluids.solvers.pbf.device.pressure import Pressure
from seals.plugins.fluids.solvers.pbf.device.sorting import Sorting
from seals.plugins.fluids.solvers.pbf.device.vorticity import Vorticity
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class Stages:
    """What the substeps of all solvers have in common.

    Args:
        sorting: sort and search.
        isotropy: correction of the stress.
        bodies: rigid bodies.
        body_neighbours: what presses on bodies at once.
        gap: water between bodies and walls.
        finish: viscosity and friction.
        cohesion: surface tension, or None.
        adhesion: wetting of boundaries, or None.
        vorticity: confinement, or None.
        opening: whether `Pressure.open` computes the correction, see `Substep`.
    """

    def __init__(
        self,
        *,
        sorting: Sorting,
        isotropy: Isotropy,
        bodies: Bodies,
        body_neighbours: BodyNeighbourCount,
        gap: Gap,
        finish: Finish,
        cohesion: Cohesion | None,
        adhesion: Adhesion | None,
        vorticity: Vorticity | None,
        opening: bool,
    ) -> None:
        self.sorting, self.isotropy, self.bodies = sorting, isotropy, bodies
        self.body_neighbours, self.gap, self.finish = body_neighbours, gap, finish
        self.opening, self.sticking = opening, adhesion is not None
        self.cohesion: Any = cohesion
        self.adhesion: Any = adhesion
        self.vorticity: Any = vorticity
        self.pulling, self.confining = cohesion is not None, vorticity is not None
        self.finding = sorting.p.isotropic and not opening
        self.reaching = sorting.s.longest > 0
        self.rubbing = finish.skin > 0 and self.reaching

    @ti.kernel
    def place_samples(self):
        """Sort the samples by cell where they are now."""
        self.bodies.carry()
        self.sorting.bin_samples()

    @ti.func
    def sort(self, moving: ti.template()):
        """Sort particles and moving samples, find neighbours, and what is next to bodies."""
        if ti.static(moving):
            self.bodies.carry()
            self.sorting.bin_samples()
        self.sorting.begin()
        self.sorting.survey()
        if ti.static(self.finding):
            self.isotropy.find()
        if ti.static(moving):
            if ti.static(self.reaching):
                self.sorting.survey_samples()
            self.body_neighbours.count()

    @ti.func
    def fill_gaps(self):
        """Press bodies off the walls that they lie on."""
        self.gap.find_heads()
        self.gap.fill()
        self.bodies.gather()
        self.gap.book()

    @ti.func
    def change_velocities(self, moving: ti.template()):
        """Apply surface tension, wetting, vorticity, viscosity and friction."""
        if ti.static(self.pulling):
            self.cohesion.pull()
        if ti.static(self.sticking):
            self.adhesion.stick()
            if ti.static(moving and self.reaching):
                self.adhesion.react()
                self.bodies.gather()
        if ti.static(self.confining):
            self.vorticity.confine()
        if ti.static(self.finish.damped):
            self.finish.find_laplacian()
        self.finish.close()
        if ti.static(moving and self.rubbing):
            self.finish.rub()
            self.bodies.gather()


@ti.data_oriented
class Substep:
    """Substep of the position-based fluid.

    Args:
        stages: what all solvers share.
        pressure: multipliers and displacements.
        warm: whether it begins with the multipliers of the last substep.
    """

    def __init__(self, stages: Stages, pressure: Pressure, *, warm: bool) -> None:
        self.stages, self.pressure, self.warm = stages, pressure, warm
        self.bodies, self.opening = stages.bodies, stages.opening

    @ti.kernel
    def whole(self, iterations: ti.template(), moving: ti.template()):
        """Run a substep of a fixed number of iterations."""
        self.begin(moving)
        for k in ti.static(range(iterations)):
            self.iterate(k, k == 0, moving)
        self.end(moving)

    @ti.kernel
    def start(self, moving: ti.template()):
        """Run what comes before the iterations."""
        self.begin(moving)

    @ti.kernel
    def iteration(self, k: ti.i32, first: ti.template(), moving: ti.template()):
        """Run one iteration."""
        self.iterate(k, first, moving)

    @ti.kernel
    def finish(self, moving: ti.template()):
        """Run what comes after the iterations."""
        self.end(moving)

    @ti.func
    # the loop of Macklin and Mueller 2013, algorithm 1, with one search for all iterations
    def begin(self, moving: ti.template()):
        """Prediction, sort, search, and the displacement of a warm start."""
        if ti.static(moving):
            self.bodies.predict()
        self.stages.sort(moving)
        if ti.static(self.warm):
            self.pressure.begin()
            self.displace(moving)

    @ti.func
    def iterate(self, k, first: ti.template(), moving: ti.template()):
        """Multipliers, displacements, and the answer of bodies."""
        if ti.static(first and self.opening):
            self.pressure.open()
        else:
            self.pressure.multipliers(k)
        self.displace(moving)

    @ti.func
    def displace(self, moving: ti.template()):
        """Displacements, and the answer of bodies."""
        self.pressure.displace()
        if ti.static(moving):
            self.pressure.react()
            self.bodies.gather()

    @ti.func
    def end(self, moving: ti.template()):
        """Gaps under bodies, and all that changes velocities."""
        if ti.static(moving):
            self.stages.fill_gaps()
        self.stages.change_velocities(moving)
