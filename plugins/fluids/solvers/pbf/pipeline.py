"""Sequence of one substep of the position-based fluid."""

from __future__ import annotations

from typing import TYPE_CHECKING

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_pipeline import DevicePipeline
from seals.plugins.fluids.solvers.pbf.chebyshev import weights

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.pbf.settings import PbfSettings


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
        self.schedule: list[tuple[float, float]] = []
        listed = self.particles.longest > 0
        self.opening = self.particles.isotropic and listed and settings.warm_start <= 0

    def _plan(self, step: float, softness: float) -> None:
        self.schedule = weights(
            self.settings.iterations, softness=softness, lattice=self.smoothing.lattice
        )

    def substep(self, *, static_changed: bool) -> int:
        """Advance by one substep; return the number of solver iterations."""
        if self.moving:
            self.bodies.predict()
        self._sort(static_changed)
        done = self._sweeps(self.moving)
        if self.moving:
            self._fill_gaps(1)
        self._change_velocities(1)
        return done

    def _sweeps(self, moving: bool) -> int:
        done = 0
        if self.settings.warm_start > 0:
            self.pressure.begin()
            self._displace(moving)
            done += 1
        for k, (gain, memory) in enumerate(self.schedule):
            # after a warm start the last change is not a step of the method
            if self.opening and k == 0:
                self.pressure.open(gain)
            else:
                self.pressure.multipliers(gain, memory if k else 0.0)
            self._displace(moving)
            done += 1
            if self.settings.tolerance > 0 and k and self._residual() < self.settings.tolerance:
                break
        return done

    def _displace(self, moving: bool) -> None:
        self.pressure.displace()
        if moving:
            self.pressure.react(0)
            self.bodies.gather()

    def _residual(self) -> float:
        return self.sums(velocity=1).residual / max(int(self.numbers.count[None]), 1)
