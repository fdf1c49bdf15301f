"""Surface tension after Akinci, Akinci and Teschner 2013, as a change of velocity."""

import math
from typing import Any

from seals.plugins.fluids.solvers.pbf.device.grid import Grid, PairSums
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import Fields, Globals, Particles
from seals.plugins.fluids.solvers.pbf.language import ti

MEASURED = 45.0
"""Surface tension over density, gamma and spacing squared [1]: from the periods of droplets of 6, 9
and 12 spacings of 0.5 mm (36, 47, 53), and of 9 of 0.7 mm (45)."""


@ti.data_oriented
class Cohesion(PairSums):
    """Cohesion between particles, and curvature of the surface.

    Equation:
        gamma = tension / (45 rho_0 spacing^2),
        a_ij = -gamma K_ij (m C(r) e_ij + (n_i - n_j)),  K_ij = 2 rho_0 / (rho_i + rho_j),
        n_i = h sum_j V_j grad W_ij, C the spline of eq. 2 of the paper.

    Args:
        fields: where normals live.
        particles: data in: places and velocities of buffer 1; data out: velocities of buffer 1.
        grid: cells.
        numbers: step and counts.
        smoothing: the kernel, whose gradient makes the normals.
        tension: of the surface [N/m].
        mass: mass of a particle [kg].
        spacing: distance at rest [m].

    Valid range:
        Droplets of six spacings or more in radius: their slowest oscillation has the period of
        Rayleigh within 12 %.

    Limitations:
        Forces act between particles only; boundaries are wetted by `Adhesion`. Attraction in pairs
        presses the water together by 1.2 tension / spacing wherever it is, and the pressure that
        particles state is that of their multipliers alone: less the attraction, droplets of 6, 9
        and 12 spacings hold 0.66, 0.78 and 0.76 of Laplace's 2 tension / radius.

    References:
        Akinci, Akinci, Teschner 2013, doi 10.1145/2508363.2508395.
    """

    def __init__(
        self,
        fields: Fields,
        particles: Particles,
        grid: Grid,
        numbers: Globals,
        smoothing: Smoothing,
        *,
        tension: float,
        mass: float,
        spacing: float,
    ) -> None:
        self.p, self.grid, self.g, self.kernel = particles, grid, numbers, smoothing
        self.strength, self.mass = tension * spacing / (MEASURED * mass), mass
        self.support = grid.support
        self.listed = particles.longest > 0
        self.factor = 32 / (math.pi * self.support**9)
        self.normal = fields.vector(3, ti.f32, particles.capacity)

    @ti.func
    def spline(self, r) -> Any:
        """Attraction beyond half the support, repulsion below it [1/m^3]."""
        # eq. 2: (h - r)^3 r^3, below h / 2 twice that less h^6 / 64, which repels
        h = self.support
        value = (h - r) ** 3 * r**3
        if 2 * r <= h:
            value = 2 * value - h**6 / 64
        if r >= h:
            value = 0.0
        return self.factor * value

    @ti.func
    def pull(self):
        """Apply surface tension. Data in: buffer 1, densities. Data out: its velocities."""
        # all normals first: a force needs those of the neighbours too
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.normal[i] = self.gather(i, False)
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                a = self.gather(i, True)
                self.p.velocity[1].add(i, -(self.g.step[None] * self.strength) * a)

    @ti.func
    def pair(self, i, j, q, force: ti.template()) -> Any:
        """Normal by one neighbour, or its force."""
        o = self.p.place[1].get(j)
        e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
        r2 = e.norm_sqr()
        s = self.support * self.kernel.gradient(r2) * e
        if ti.static(force):
            r = ti.sqrt(r2) + 1e-9
            # K_ij makes up for the neighbours that particles at the surface lack
            both = ti.max(self.p.density[i] + self.p.density[j], 0.2)
            s = (2 / both) * (
                (self.mass * self.spline(r) / r) * e + (self.normal[i] - self.normal[j])
            )
            if r2 >= self.support * self.support:
                s = ti.Vector([0.0, 0.0, 0.0])
        return s
