"""The position-based fluid solver: XPBD with a density constraint (PBF) and moving boundaries."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_solver import DeviceSolver
from seals.plugins.fluids.solvers.pbf.pipeline import SubstepPipeline

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
        >>> water = SolverPbf(
        ...     Domain(
        ...         spacing=0.02,
        ...         lower=(0, 0, 0),
        ...         upper=(1, 1, 1),
        ...         capacity=20_000,
        ...         boundary_capacity=10_000,
        ...         bodies=1,
        ...     ),
        ...     settings=PbfSettings(),
        ...     engine=Engine(),
        ... )  # doctest: +SKIP
    """

    settings: PbfSettings
    pipeline: SubstepPipeline

    def _pipeline(self, domain: Domain, accelerated: bool) -> SubstepPipeline:
        return SubstepPipeline(domain, settings=self.settings, accelerated=accelerated)

    @property
    def sound_speed(self) -> float:
        """Speed of sound of the compliance in use [m/s]."""
        if self.settings.sound_speed > 0:
            return self.settings.sound_speed
        return 10 * math.sqrt(max(self.settings.gravity * self._depth, 1e-6))

    @property
    def longest_substep(self) -> float:
        """Longest substep that the speed of sound allows [s]."""
        return CARRIED * self.spacing / self.sound_speed

    def substeps(self, step: float) -> int:
        """Return the number of substeps of ``step`` [s] required by the sound speed."""
        return max(1, math.ceil(step * self.sound_speed / (CARRIED * self.spacing)))
