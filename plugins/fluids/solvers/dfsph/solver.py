"""Divergence-free SPH solver with moving boundaries."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solver import Domain, Exchange, Snapshot
from seals.plugins.fluids.solvers.device_pipeline import DevicePipeline
from seals.plugins.fluids.solvers.device_solver import DeviceSolver
from seals.plugins.fluids.solvers.dfsph.device.incompressible import (
    QUANTUM,
    Incompressible,
    SharedParts,
    SolverFields,
)
from seals.plugins.fluids.solvers.pbf.chebyshev import weights

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.dfsph.settings import DfsphSettings


Array = NDArray[np.float64]


EXPANSIONS, EVEN = 5, 5e-4
"""Most substeps in which a first filling expands, and the mean compression that ends them [1]."""


class SolverDfsph(DeviceSolver):
    """Divergence-free SPH with moving boundaries; fulfils `ParticleSolver`.

    Equation:
        Both of rho_i + h D rho_i / D t <= rho_0 and D rho_i / D t <= 0 at every particle, by
        pressures p_i >= 0 with m dv_i/dt = -V sum_j (p_i + p_j) grad W_ij; solved one after the
        other by Jacobi iterations with Chebyshev acceleration, bodies and their mobility among the
        unknowns, until the mean residual is below the one that is asked for.

    Args:
        domain: extent and capacities.
        settings: physics and solver.
        engine: the owner of Taichi.

    Limitations:
        With ``sound_speed`` zero the water is incompressible: an impact is felt by all of it
        within a substep, and its peak depends on the substep. No pressure below zero: no suction.

    References:
        Bender and Koschier 2015, doi:10.1145/2786784.2786796; Akinci et al. 2012,
        doi:10.1145/2185520.2185558 (boundaries).
    """

    settings: DfsphSettings
    pipeline: _DfsphPipeline

    def _pipeline(self, domain: Domain, accelerated: bool) -> _DfsphPipeline:
        self._swiftest, self._fresh = 0.0, False
        return _DfsphPipeline(domain, settings=self.settings, accelerated=accelerated)

    def add_particles(
        self, positions: Array, velocities: Array | None = None, *, trusted: bool = False
    ) -> None:
        """Add particles, see `ParticleSolver.add_particles`; a first filling expands in place."""
        self._fresh = self._fresh or not self.count
        super().add_particles(positions, velocities, trusted=trusted)

    def advance(self, step: float, *, substeps: int) -> Exchange:
        """Advance by ``step`` [s], see `ParticleSolver.advance`."""
        if self._fresh and self._placed:
            self._fresh = False
            self._expand(step / substeps)
        return super().advance(step, substeps=substeps)

    def _expand(self, substep: float) -> None:
        """Undo the compression of a first filling by the places of its particles alone.

        A lattice is a per cent too dense beside walls. Undone by velocities within a substep, that
        throws the water up.
        """
        speeds, pipeline = self.velocities(), self.pipeline
        for k in range(EXPANSIONS):
            if self.boundary.stale:
                self.boundary.upload(self.origin)
            pipeline.moving = self.boundary.moving > 0
            pipeline.prepare(substep, self.sound_speed, self.level - self.origin[2])
            pipeline.substep(static_changed=k == 0)
            compression = pipeline.sums().compression / max(self.count, 1)
            # without the pressure that did it, and as if nothing had been pushed
            self.set_particles(velocities=speeds)
            place = pipeline.particles.place[0].to_numpy()
            place[:, 3] = 0.0
            pipeline.particles.place[0].from_numpy(place)
            pipeline.bodies.receive()
            pipeline.collect()
            pipeline.wall_impulse()
            if compression < EVEN:
                break

    @property
    def sound_speed(self) -> float:
        """Speed of sound of the compliance in use [m/s]; infinite for incompressible water."""
        return self.sound or math.inf

    @property
    def longest_substep(self) -> float:
        """Longest substep of the Courant condition, what falls meanwhile included [s]."""
        way = self.settings.own.courant * self.spacing
        if self._written and self.count:
            speeds = self.velocities()
            fastest = max(self._swiftest, float(np.sqrt((speeds**2).sum(axis=1).max())))
        else:
            fastest = max(self._swiftest, self.pipeline.fastest())
        return _courant_step(fastest, self.settings.gravity, way)

    def place_bodies(self, **bodies: Any) -> None:
        """Place all bodies for the coming ``advance``, see `ParticleSolver.place_bodies`."""
        super().place_bodies(**bodies)
        speed = np.linalg.norm(np.asarray(bodies["velocity"]), axis=1)
        spin = np.linalg.norm(np.asarray(bodies["spin"]), axis=1)
        far = [
            float(np.linalg.norm(self.boundary.points[k + 1], axis=1).max(initial=0.0))
            if k + 1 in self.boundary.points
            else 0.0
            for k in range(self.bodies)
        ]
        self._swiftest = float((speed + spin * np.array(far)).max(initial=0.0))

    def _pressed(self) -> Array:
        return self._rows(self.pipeline.own.pressed)

    def snapshot(self) -> Snapshot:
        """Return everything needed to continue bit for bit (deterministic mode)."""
        arrays = dict(super().snapshot().arrays)
        arrays |= {"pressed": self.pipeline.own.pressed.to_numpy()}
        return Snapshot(arrays | {"substep": self.pipeline.current, "fresh": self._fresh})

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot; the caller sets the bodies again."""
        super().restore(snapshot)
        self.pipeline.own.pressed.from_numpy(snapshot.arrays["pressed"])
        self._fresh = bool(snapshot.arrays["fresh"])
        self.pipeline.current, self.pipeline.sound = float(snapshot.arrays["substep"]), 0.0


def _courant_step(speed: float, gravity: float, way: float) -> float:
    """Return the time in which a way is gone from a speed under gravity [s].

    Example:
        >>> round(_courant_step(1.0, 0.0, 0.1), 6)
        0.1
    """
    if gravity <= 0.0 and speed <= 0.0:
        return math.inf
    # way = speed t + gravity t^2 / 2, in the form that does not cancel
    return 2.0 * way / (speed + math.sqrt(speed * speed + 2.0 * gravity * way))


LOOK = 2
"""Iterations between two looks at the residual."""
MARGINS = (1.4, 2.1, 4.0)
"""Safety on the top of the spectrum, the next one where iterations diverge with one [1]."""
GROWTH = 1.5
"""Growth of the least residual between two looks that is taken for divergence [1]."""
STIFF = 1 / 100
"""Smallest share of the spectrum that is damped at the full rate [1]."""


class _DfsphPipeline(DevicePipeline):
    """Fields and kernels of one divergence-free SPH fluid.

    Args:
        domain: extent and capacities.
        settings: physics and solver.
        accelerated: whether the fields lie on a CUDA device.
    """

    settings: DfsphSettings
    in_place: ClassVar[bool] = True

    def __init__(self, domain: Domain, *, settings: DfsphSettings, accelerated: bool) -> None:
        super().__init__(domain, settings=settings, accelerated=accelerated)
        self.incompressible = Incompressible(self.own, self.pressure, self.finish, self.sorting)
        self.kernels = SharedParts(self.stages, self.pressure)
        self.schedules: list[list[tuple[float, float]]] = []

    def _more_fields(self, capacity: int) -> None:
        self.own = SolverFields(self.fields, capacity)

    def _plan(self, step: float, softness: float) -> None:
        chosen = self.settings.own
        # the pressure is kept: a multiplier goes with the square of the substep
        ratio = (step / self.current) ** 2 if self.current else 1.0
        self.numbers.warm[None] = chosen.warm * ratio
        self.schedules = [
            weights(
                chosen.iterations,
                softness=softness,
                lattice=self.smoothing.lattice,
                margin=margin,
                stiff=STIFF,
            )
            for margin in MARGINS
        ]

    def substep(self, *, static_changed: bool) -> int:
        """Advance by one substep; return the number of solver iterations."""
        now, moving = self.incompressible, self.moving
        if static_changed and not moving:
            self.stages.place_samples()
        # Bender and Koschier 2015, algorithm 1, which is cyclic, entered after its search: first
        # no divergence, then forces, then constant density at the end of the substep
        self.kernels.sort(moving)
        self.numbers.warm[None] = self.settings.own.warm
        now.factors()
        done = self._iterate(now.correct_divergence, 1, self.settings.own.divergence)
        self.kernels.change_velocities(moving)
        now.fall()
        if moving:
            self.kernels.predict()
        if self.settings.own.warm > 0:
            self._accelerate(0)
        done += self._iterate(now.correct_density, 0, self.settings.own.compression)
        now.keep_off()
        if moving:
            self.kernels.fill_gaps()
            now.react_to_touch()
            self.kernels.travel()
        now.travel()
        return done

    def _iterate(self, correct: Any, buffer: int, goal: float) -> int:
        """Iterate one constraint until its mean residual is below a goal; return how often."""
        if goal <= 0.0:
            return 0
        least, level, k = math.inf, 0, 0
        for done in range(1, self.settings.own.iterations + 1):
            correct(*self.schedules[level][k])
            # looking costs as much as an iteration on a fast device
            left = self._residual() if done % LOOK == 0 else math.nan
            self._accelerate(buffer)
            k += 1
            if left < goal:
                break
            if left > GROWTH * least and level + 1 < len(MARGINS):
                # the water is in more disorder than the margin covers: start again with a wider one
                least, level, k = left, level + 1, 0
            elif left < least:
                least = left
        return done

    def _accelerate(self, buffer: int) -> None:
        self.incompressible.accelerate(buffer)
        if self.moving:
            self.kernels.react()

    def _residual(self) -> float:
        total = int(self.own.residual.to_numpy().sum(dtype="int64"))
        return total * QUANTUM / max(int(self.numbers.count[None]), 1)

    def fastest(self) -> float:
        """Return the largest speed of a particle at the end of the last substep [m/s]."""
        return math.sqrt(float(self.own.fastest.to_numpy().max(initial=0.0)))
