"""Fields and kernels that all solvers on a device share: search, boundaries, bodies, sums."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_settings import Search
from seals.plugins.fluids.solvers.pbf.chebyshev import compliance
from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies, BodyNeighbourCount
from seals.plugins.fluids.solvers.pbf.device.cohesion import Adhesion, Cohesion
from seals.plugins.fluids.solvers.pbf.device.finish import Finish
from seals.plugins.fluids.solvers.pbf.device.gap import Gap
from seals.plugins.fluids.solvers.pbf.device.grid import Grid
from seals.plugins.fluids.solvers.pbf.device.isotropy import Isotropy
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.device.pressure import Pressure
from seals.plugins.fluids.solvers.pbf.device.rows import Rows
from seals.plugins.fluids.solvers.pbf.device.sorting import Sorting
from seals.plugins.fluids.solvers.pbf.device.substep import Stages
from seals.plugins.fluids.solvers.pbf.device.vorticity import Vorticity
from seals.plugins.fluids.solvers.pbf.fields import Fields, Globals, Particles, Samples

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.device_settings import DeviceSettings

Array = NDArray[np.float64]
# cells per support along z: finer cells spare candidates, and cost more to sort (benchmarks/fluid)
FINE_CPU, FINE_CUDA = 4, 2


class Sums(NamedTuple):
    """Sums over all particles: velocity (3,), its square, compression, largest, residual."""

    velocity: Array
    square: float
    compression: float
    largest: float
    residual: float


class DevicePipeline(ABC):
    """Fields and kernels of one fluid, run substep by substep; a solver adds its pressure.

    Args:
        domain: extent and capacities.
        settings: physics and solver.
        accelerated: whether the fields lie on a CUDA device.
    """

    in_place: ClassVar[bool] = False
    """Whether particles and bodies stay where they are until the end of a substep."""

    def __init__(self, domain: Domain, *, settings: DeviceSettings, accelerated: bool) -> None:
        spacing, capacity, bodies = domain.spacing, domain.capacity, domain.bodies
        size = np.asarray(domain.upper, dtype=np.float64) - np.asarray(domain.lower)
        self.settings, self.spacing = settings, spacing
        self.mass = settings.density * spacing**3
        walk = settings.search is Search.cells
        longest = 0 if walk else settings.neighbours
        self.smoothing = Smoothing(settings.kernel, spacing, settings.support, inverse=accelerated)
        self.fields = Fields()
        self.particles = Particles(
            self.fields,
            capacity,
            longest,
            accelerated,
            isotropic=settings.stress_correction > 0,
            damped=settings.artificial_viscosity > 0,
            rubbed=settings.body_friction > 0,
        )
        # only samples of bodies look for particles
        listed = longest if bodies else 0
        self.samples = Samples(self.fields, domain.boundary_capacity, listed, accelerated)
        self.numbers = Globals(self.fields, capacity)
        fine = FINE_CUDA if accelerated else FINE_CPU
        reach = self.smoothing.support
        self.grid = Grid(self.fields, size, reach, fine=fine)
        self.bounds = Grid(self.fields, size, reach, fine=fine, marked=True)
        self.bodies = Bodies(
            self.fields, bodies, self.samples, self.numbers, self.mass, in_place=self.in_place
        )
        parts = (self.fields, self.particles, self.grid, self.numbers, self.smoothing)
        pull, spin = self.settings.cohesion, self.settings.vorticity
        work = self.settings.adhesion if self.particles.longest else 0.0
        self.cohesion, self.vorticity, self.adhesion = (
            Cohesion(*parts, tension=pull, mass=self.mass, spacing=self.spacing)
            if pull > 0
            else None,
            Vorticity(*parts, strength=spin, spacing=self.spacing) if spin > 0 else None,
            Adhesion(
                self.particles,
                self.samples,
                self.bodies,
                self.numbers,
                work=work,
                mass=self.mass,
                spacing=self.spacing,
                support=self.smoothing.support,
            )
            if work > 0
            else None,
        )
        self._more_fields(capacity)
        self.fields.allocate()
        self._device(accelerated)
        self.rows = Rows(self.particles, self.numbers)
        self.stages = Stages(
            sorting=self.sorting,
            isotropy=self.isotropy,
            bodies=self.bodies,
            body_neighbours=self.body_neighbours,
            gap=self.gap,
            finish=self.finish,
            cohesion=self.cohesion,
            adhesion=self.adhesion,
            vorticity=self.vorticity,
            opening=self._opening,
        )
        # whether any body has samples
        self.moving = False
        self.numbers.gravity[None] = settings.gravity
        self.current = 0.0
        self.sound = math.inf
        self.level = -math.inf

    def _device(self, accelerated: bool) -> None:
        chosen, parts = self.settings, (self.particles, self.samples)
        self.sorting = Sorting(
            *parts,
            self.grid,
            self.bounds,
            self.numbers,
            chosen.deterministic,
            accelerated,
            predicting=not self.in_place,
        )
        self.isotropy = Isotropy(
            *parts,
            self.grid,
            self.bounds,
            self.numbers,
            self.smoothing,
            share=chosen.stress_correction,
            scale=chosen.solid_scale,
        )
        self.pressure = Pressure(
            particles=self.particles,
            samples=self.samples,
            bodies=self.bodies,
            grid=self.grid,
            bounds=self.bounds,
            numbers=self.numbers,
            smoothing=self.smoothing,
            spacing=self.spacing,
            scale=chosen.solid_scale,
            isotropy=self.isotropy,
            touching=not self.in_place,
            suction=chosen.suction > 0,
        )
        self.body_neighbours = BodyNeighbourCount(
            self.bodies, self.particles, self.smoothing, self.grid
        )
        self.gap = Gap(
            self.bodies,
            *parts,
            self.grid,
            self.bounds,
            self.numbers,
            self.smoothing,
            self.pressure,
            spacing=self.spacing,
        )
        self.finish = Finish(
            self.particles,
            self.grid,
            self.numbers,
            self.smoothing,
            self.samples,
            self.bodies,
            blended=chosen.viscosity > 0,
            damped=chosen.artificial_viscosity > 0,
            friction=(chosen.wall_friction, chosen.body_friction),
            spacing=self.spacing,
            last=not self.in_place,
        )

    @property
    def _opening(self) -> bool:
        """Whether the first iteration computes the isotropy correction as well."""
        return False

    def _more_fields(self, capacity: int) -> None:  # noqa: B027  optional
        """Declare the fields that only this solver has."""

    def prepare(self, step: float, sound: float, level: float) -> None:
        """Set constants for substep [s], speed of sound [m/s] and level over the origin [m]."""
        if (step, sound, level) == (self.current, self.sound, self.level):
            return
        soft = compliance(sound, step)
        self.numbers.step[None] = step
        self.numbers.compliance[None] = soft
        strain = self.settings.gravity / (self.smoothing.lattice.virial * sound**2)
        known = math.isfinite(level)
        self.numbers.strain[None], self.numbers.level[None] = (strain, level) if known else (0, 0)
        self.numbers.blend[None] = 1 - math.exp(-self.settings.viscosity * step)
        self.numbers.damping[None] = 1 - math.exp(-self.settings.artificial_viscosity * step)
        scale = self.smoothing.lattice.virial * self.settings.density / step**2
        self.numbers.tension[None] = self.settings.suction / scale
        self._plan(step, soft * self.spacing**2 / self.smoothing.lattice.stiffness)
        self.current, self.sound, self.level = step, sound, level

    @abstractmethod
    def _plan(self, step: float, softness: float) -> None:
        """Plan the iterations of a substep [s]; compliance over the constraint's diagonal [1]."""

    @abstractmethod
    def substep(self, *, static_changed: bool) -> int:
        """Advance by one substep; return the number of solver iterations."""

    def sums(self, *, velocity: int = 0) -> Sums:
        """Sum over all particles in double precision."""
        self.finish.sums(velocity, 0)
        table = self.numbers.partial.to_numpy()
        total = table.sum(axis=0)
        return Sums(total[:3], total[3], total[4], float(table[:, 5].max()), total[6])

    def send(self, table: Array) -> None:
        """Write the state of all bodies, one row each."""
        whole = np.zeros((table.shape[0] + 1, table.shape[1]))
        whole[1:] = table
        self.bodies.inbox.from_numpy(whole)
        self.bodies.receive()

    def collect(self) -> Array:
        """Read state and impulses of all bodies, one row each; impulses start anew."""
        if not self.bodies.bodies:
            return np.zeros((0, 24))
        self.bodies.report()
        return np.asarray(self.bodies.outbox.to_numpy()[1:])

    def wall_impulse(self) -> Any:
        """Return the impulse on static samples since the last call [N s], shape (3,)."""
        total = self.numbers.walls.to_numpy().sum(axis=0)
        self.numbers.walls.fill(0.0)
        return -self.mass * total
