"""Sequence of one substep of the position-based fluid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_pipeline import DevicePipeline
from seals.plugins.fluids.solvers.pbf.chebyshev import weights
from seals.plugins.fluids.solvers.pbf.device.substep import Substep
from seals.plugins.fluids.solvers.pbf.language import ti

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.pbf.settings import PbfSettings

UNROLLED = 12
"""Most iterations that one kernel holds: each is compiled."""


class SubstepPipeline(DevicePipeline):
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
            if self.settings.tolerance > 0 and k and self._residual() < self.settings.tolerance:
                break
        self.kernels.finish(moving)
        return done + warm

    def _residual(self) -> float:
        return self.sums(velocity=1).residual / max(int(self.numbers.count[None]), 1)
