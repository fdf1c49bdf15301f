"""Smoothing kernel as device functions of the squared distance."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.choices import Kernel
from seals.plugins.fluids.solvers.pbf.language import ti
from seals.plugins.fluids.solvers.pbf.lattice import calibrate


@ti.data_oriented
class Smoothing:
    """Value and gradient of a kernel.

    Args:
        kernel: which one.
        spacing: distance of particles at rest [m].
        reach: support of the kernel [1 spacing].
    """

    def __init__(self, kernel: Kernel, spacing: float, reach: float) -> None:
        self.kind = {Kernel.wendland: 0, Kernel.spline: 1}[kernel]
        self.lattice = calibrate(kernel, reach)
        self.support = reach * spacing
        # distances are in halves of the support below
        self.per_half = 2 / self.support
        self.factor = self.lattice.factor
        self.slope = self.lattice.factor * self.per_half**2
        self.own = self.lattice.own
        self.solid_a, self.solid_b = self.lattice.solid

    @ti.func
    def both(self, r2) -> Any:
        """Density share [1] and slope over distance [1/m^2], zero beyond the support."""
        q = ti.sqrt(r2) * self.per_half
        w, g = 0.0, 0.0
        if ti.static(self.kind == 0):
            u = ti.max(1 - 0.5 * q, 0.0)
            u3 = u * u * u
            w = self.factor * u3 * u * (2 * q + 1)
            g = -5 * self.slope * u3
        else:
            u, t = ti.max(2 - q, 0.0), ti.max(1 - q, 0.0)
            w = self.factor * (0.25 * u * u * u - t * t * t)
            g = self.slope * (-0.75 * u * u + 3 * t * t) / ti.max(q, 1e-4)
        return w, g

    @ti.func
    def value(self, r2) -> Any:
        """Density share of a neighbour [1]."""
        w, _ = self.both(r2)
        return w

    @ti.func
    def gradient(self, r2) -> Any:
        """Radial derivative over distance [1/m^2], negative."""
        _, g = self.both(r2)
        return g

    @ti.func
    def solid(self, r2) -> Any:
        """Density share [1] and radial derivative over distance [1/m^2], sample of weight one."""
        q = ti.sqrt(r2) * self.per_half
        u = ti.max(1 - 0.5 * q, 0.0)
        u3 = u * u * u
        u6 = u3 * u3
        w = u6 * u * (self.solid_a + self.solid_b * u)
        g = -0.5 * u6 * (7 * self.solid_a + 8 * self.solid_b * u) / ti.max(q, 1e-3)
        return w, g * (self.per_half * self.per_half)
