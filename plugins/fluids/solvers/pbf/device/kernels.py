"""Smoothing kernel as device functions of the squared distance."""

from typing import Any

from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.pbf.language import ti
from seals.plugins.fluids.solvers.pbf.lattice import Calibration

# least distance that is divided by [halves of the support]
NEAREST = 1e-4


@ti.data_oriented
class Smoothing:
    """Value and gradient of a kernel.

    Args:
        kernel: which one.
        spacing: distance of particles at rest [m].
        reach: support of the kernel [1 spacing].
        inverse: whether distances come from inverse roots, the quick ones of a CUDA device.
    """

    def __init__(
        self, kernel: Kernel, spacing: float, reach: float, *, inverse: bool = False
    ) -> None:
        self.inverse = inverse
        self.kind = {Kernel.wendland: 0, Kernel.spline: 1}[kernel]
        self.lattice = Calibration.of(kernel, reach)
        self.support = reach * spacing
        # distances are in halves of the support below
        self.per_half = 2 / self.support
        self.factor = self.lattice.factor
        self.slope = self.lattice.factor * self.per_half**2
        self.own = self.lattice.own
        self.solid_a, self.solid_b = self.lattice.solid

    @ti.func
    def halves(self, r2) -> Any:
        """Distance in halves of the support, and its inverse [1]."""
        q, over = 0.0, 0.0
        x = r2 * (self.per_half * self.per_half)
        if ti.static(self.inverse):
            over = ti.rsqrt(ti.max(x, NEAREST * NEAREST))
            q = x * over
        else:
            q = ti.sqrt(x)
            over = 1 / ti.max(q, NEAREST)
        return q, over

    @ti.func
    def both(self, r2) -> Any:
        """Density share [1] and slope over distance [1/m^2], zero beyond the support."""
        q, over = self.halves(r2)
        w, g = 0.0, 0.0
        if ti.static(self.kind == 0):
            # Wendland C2: W = u^4 (2 q + 1), W'/q = -5 u^3, u = 1 - q / 2
            u = ti.max(1 - 0.5 * q, 0.0)
            u3 = u * u * u
            w = self.factor * u3 * u * (2 * q + 1)
            g = -5 * self.slope * u3
        else:
            # cubic spline: W = (2 - q)^3 / 4 - (1 - q)^3; W'/q is 0/0 at zero distance
            u, t = ti.max(2 - q, 0.0), ti.max(1 - q, 0.0)
            u2, t2 = u * u, t * t
            w = self.factor * (0.25 * u2 * u - t2 * t)
            g = (self.slope * over) * (3 * t2 - 0.75 * u2)
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
        q, _ = self.halves(r2)
        u = ti.max(1 - 0.5 * q, 0.0)
        u3 = u * u * u
        u6 = u3 * u3
        # u^7 (a + b u) and its derivative over distance, see `lattice.solid_factors`
        w = u6 * u * (self.solid_a + self.solid_b * u)
        g = -0.5 * u6 * (7 * self.solid_a + 8 * self.solid_b * u) / ti.max(q, 1e-3)
        return w, g * (self.per_half * self.per_half)
