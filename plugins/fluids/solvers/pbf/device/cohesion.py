"""Surface tension and wetting after Akinci, Akinci and Teschner 2013, as changes of velocity.

Tension pulls water to water (cohesion), wetting to boundaries (adhesion).
"""

import math
from typing import Any

from scipy.integrate import quad

from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies
from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near, PairSums
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import Fields, Globals, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti

TENSION = 45.0
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
        self.p, self.g, self.kernel = particles, numbers, smoothing
        self.near = Near(particles, None, grid, None)
        self.strength, self.mass = tension * spacing / (TENSION * mass), mass
        self.support = grid.support
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


WETTING = 0.5
"""Strength over that of a lattice on a sheet [1]: drops of 6 and 9 spacings then have the angles
of Young and Dupre from 75 to 120 degrees, within 5."""


def _bell(share: float) -> float:
    """Attraction of eq. 7 of the paper at a share of the support, less its factor [1]."""
    inside = -4.0 * share**2 + 6.0 * share - 2.0
    return max(inside, 0.0) ** 0.25 if 0.5 < share < 1.0 else 0.0


def _work_of_sheet(reach: float) -> float:
    """Energy between a square of a lattice of particles and a sheet of samples one spacing below.

    Args:
        reach: support of the attraction [1 spacing].

    Returns:
        Of an attraction `_bell` [1 spacing].
    """
    total = 0.0
    steps = range(-math.ceil(reach), math.ceil(reach) + 1)
    for x in steps:
        for y in steps:
            for z in range(1, math.ceil(reach) + 1):
                share = math.sqrt(x * x + y * y + z * z) / reach
                total += quad(_bell, min(share, 1.0), 1.0)[0] * reach
    return total


@ti.data_oriented
class Adhesion:
    """Adhesion of particles to boundary samples, as a change of velocity.

    Equation:
        a_i = -sum_b strength w_b A(r_ib) e_ib, A the function of eq. 7 of the paper; the strength
        follows from the work of adhesion W, see `_work_of_sheet` and ``WETTING``. A drop with the
        surface tension gamma has the contact angle of Young and Dupre, W = gamma (1 + cos theta).

    Args:
        particles: data in: places and lists; data out: velocities of buffer 1, wall impulses.
        samples: data in: sorted samples; data out: pushes of moving ones.
        bodies: numbering of the samples' owners.
        numbers: step and counts.
        work: of adhesion [N/m].
        mass: of a particle [kg].
        spacing: distance at rest [m].
        support: reach of the attraction [m].

    Limitations:
        With stored lists only. From 1.3 times the surface tension on a drop spreads to a film of
        one layer, below 0.3 times it hops off the wall.

    References:
        Akinci, Akinci, Teschner 2013, doi 10.1145/2508363.2508395.
    """

    def __init__(
        self,
        particles: Particles,
        samples: Samples,
        bodies: Bodies,
        numbers: Globals,
        *,
        work: float,
        mass: float,
        spacing: float,
        support: float,
    ) -> None:
        self.p, self.s, self.b, self.g, self.support = particles, samples, bodies, numbers, support
        self.strength = WETTING * work * spacing / (mass * _work_of_sheet(support / spacing))

    @ti.func
    def attraction(self, e, weight) -> Any:
        """Acceleration of a particle towards a sample, ``e`` from it [m/s^2]."""
        r = e.norm() + 1e-9
        share = r / self.support
        # eq. 7: A = (-4 s^2 + 6 s - 2)^(1/4) for s = r / h from 1/2 to 1, zero elsewhere
        inside = -4.0 * share * share + 6.0 * share - 2.0
        size = 0.0
        if inside > 0.0 and share < 1.0:
            size = ti.sqrt(ti.sqrt(inside))
        return (-self.strength * weight * size / r) * e

    @ti.func
    def stick(self):
        """Attract particles to samples. Data in: buffer 1. Data out: its velocities."""
        for i in range(self.p.capacity):
            if i < self.g.count[None] and self.p.beside[i] > 0:
                at = self.p.place[1].get(i)
                total, still = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
                for k in range(self.p.filled[i], self.p.filled[i] + self.p.beside[i]):
                    t = self.p.list[i, k]
                    o = self.s.place[t]
                    e = ti.Vector([at[0] - o[0], at[1] - o[1], at[2] - o[2]])
                    part = self.attraction(e, o[3])
                    total += part
                    if self.s.owner[t] == 0:
                        still += part
                # impulse on walls times the step: `Finish.sum_walls` divides by it
                h = self.g.step[None]
                self.p.velocity[1].add(i, h * total)
                self.p.wall[i] += (h * h) * still

    @ti.func
    def react(self):
        """Compute the reactions on moving samples. Data in: buffer 1."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                o = self.s.place[self.s.rank[s]]
                total = ti.Vector([0.0, 0.0, 0.0])
                for k in range(self.s.near[s]):
                    at = self.p.place[1].get(self.s.list[s, k])
                    e = ti.Vector([at[0] - o[0], at[1] - o[1], at[2] - o[2]])
                    total -= self.attraction(e, o[3])
                self.s.push[s] = (self.g.step[None] * self.g.step[None]) * total
