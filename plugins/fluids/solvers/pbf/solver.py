"""The position-based fluid solver: XPBD with a density constraint (PBF) and moving boundaries."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_pipeline import DevicePipeline
from seals.plugins.fluids.solvers.device_solver import DeviceSolver
from seals.plugins.fluids.solvers.pbf.chebyshev import weights
from seals.plugins.fluids.solvers.pbf.device.substep import Substep
from seals.plugins.fluids.solvers.pbf.language import ti

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.pbf.settings import PbfSettings


# largest travel of a sound wave in a substep that a few sweeps can carry [spacings]
CARRIED = 3.0


class SolverPbf(DeviceSolver):
    """Position-based fluid (PBF) with moving boundaries; fulfils `ParticleSolver`.

    Equation:
        C_i = rho_i / rho_0 - 1 <= 0 with multiplier lambda_i and compliance alpha / h^2
        (XPBD), which makes pressure = rho_0 c^2 max(C_i, 0) with the sound speed c; solved by
        Jacobi sweeps with Chebyshev acceleration.

    Args:
        domain: extent and capacities.
        settings: physics and solver.
        engine: the owner of Taichi.

    References:
        Macklin and Mueller 2013, doi:10.1145/2461912.2461984 (PBF); Macklin, Mueller and Chentanez
        2016, doi:10.1145/2994258.2994272 (XPBD); Akinci et al. 2012,
        doi:10.1145/2185520.2185558 (boundaries).

    Example:
        >>> room = Domain(0.02, (0, 0, 0), (1, 1, 1), 20_000, 10_000, 1)
        >>> SolverPbf(room, settings=PbfSettings(), engine=Engine())  # doctest: +SKIP
    """

    settings: PbfSettings
    pipeline: _SubstepPipeline

    def _pipeline(self, domain: Domain, accelerated: bool) -> _SubstepPipeline:
        return _SubstepPipeline(domain, settings=self.settings, accelerated=accelerated)

    @property
    def sound_speed(self) -> float:
        """Speed of sound of the compliance in use [m/s]."""
        if self.sound > 0:
            return self.sound
        return 10 * math.sqrt(max(self.settings.gravity * self._depth, 1e-6))

    @property
    def longest_substep(self) -> float:
        """Longest substep that the speed of sound allows [s]."""
        return CARRIED * self.spacing / self.sound_speed

    def substeps(self, step: float) -> int:
        """Return the number of substeps of ``step`` [s] required by the sound speed."""
        return max(1, math.ceil(step * self.sound_speed / (CARRIED * self.spacing)))


UNROLLED = 12
"""Most iterations that one kernel holds: each is compiled."""


class _SubstepPipeline(DevicePipeline):
    """Fields and kernels of one position-based fluid.

    Args:
        domain: extent and capacities.
        settings: physics and solver.
        accelerated: whether the fields lie on a CUDA device.
    """

    settings: PbfSettings

    def __init__(self, domain: Domain, *, settings: PbfSettings, accelerated: bool) -> None:
        super().__init__(domain, settings=settings, accelerated=accelerated)
        self.numbers.warm[None] = settings.warm_start
        self.kernels = Substep(self.stages, self.pressure, warm=settings.warm_start > 0)
        few = settings.tolerance <= 0 and settings.iterations <= UNROLLED
        self.at_once = accelerated and few

    def _more_fields(self, capacity: int) -> None:
        self.numbers.weights = self.fields.vector(2, ti.f32, self.settings.iterations)

    @property
    def _opening(self) -> bool:
        listed = self.particles.longest > 0
        return self.particles.isotropic and listed and self.settings.warm_start <= 0

    def _plan(self, step: float, softness: float) -> None:
        schedule = weights(
            self.settings.iterations, softness=softness, lattice=self.smoothing.lattice
        )
        self.numbers.weights.from_numpy(np.asarray(schedule, dtype=np.float32))

    def substep(self, *, static_changed: bool) -> int:
        """Advance by one substep; return the number of solver iterations."""
        moving, most = self.moving, self.settings.iterations
        if static_changed and not moving:
            self.stages.place_samples()
        warm = int(self.settings.warm_start > 0)
        if self.at_once:
            self.kernels.whole(most, moving)
            return most + warm
        self.kernels.start(moving)
        done = 0
        for k in range(most):
            self.kernels.iteration(k, k == 0, moving)
            done += 1
            if (
                self.settings.tolerance > 0
                and k
                and (self.sums(velocity=1).residual / max(int(self.numbers.count[None]), 1))
                < self.settings.tolerance
            ):
                break
        self.kernels.finish(moving)
        return done + warm
