"""Sequence of one substep of divergence-free SPH."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_pipeline import DevicePipeline
from seals.plugins.fluids.solvers.dfsph.device.incompressible import (
    QUANTUM,
    Incompressible,
    SolverFields,
)
from seals.plugins.fluids.solvers.dfsph.device.shared import SharedParts
from seals.plugins.fluids.solvers.pbf.chebyshev import weights

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.dfsph.settings import DfsphSettings

LOOK = 2
"""Iterations between two looks at the residual."""
MARGINS = (1.4, 2.1, 4.0)
"""Safety on the top of the spectrum, the next one where iterations diverge with one [1]."""
GROWTH = 1.5
"""Growth of the least residual between two looks that is taken for divergence [1]."""
STIFF = 1 / 100
"""Smallest share of the spectrum that is damped at the full rate [1]."""


class DfsphPipeline(DevicePipeline):
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
                # the water is in more disorder than the margin covers: begin anew with a wider one
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
