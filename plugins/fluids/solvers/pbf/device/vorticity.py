"""Vorticity confinement, as a change of velocity."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near, PairSums
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import Fields, Globals, Particles
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class Vorticity(PairSums):
    """Vorticity confinement: restores part of the vorticity that the solver damps.

    Equation:
        w_i = sum_j V_j (v_j - v_i) x grad W_ij,  N = grad |w| / |grad |w||,
        dv_i/dt = strength * spacing * (N x w_i).

    Args:
        fields: where vorticities live.
        particles: data in: places and velocities of buffer 1; data out: velocities of buffer 1.
        grid: cells.
        numbers: step and counts.
        smoothing: the kernel.
        strength: of the confinement [1].
        spacing: distance at rest [m].

    Limitations:
        Adds energy and does not conserve momentum: ``Exchange.external`` shows how much.

    References:
        Macklin, Mueller 2013, doi 10.1145/2461912.2461984, eq. 15 and 16.
    """

    def __init__(
        self,
        fields: Fields,
        particles: Particles,
        grid: Grid,
        numbers: Globals,
        smoothing: Smoothing,
        *,
        strength: float,
        spacing: float,
    ) -> None:
        self.p, self.g, self.kernel = particles, numbers, smoothing
        self.near = Near(particles, None, grid, None)
        self.strength = strength * spacing
        self.curl = fields.vector(4, ti.f32, particles.capacity)

    @ti.func
    def confine(self):
        """Apply vorticity confinement. Data in: positions of buffer 1. Data out: velocities."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                w = self.gather(i, False)
                self.curl[i] = ti.Vector([w[0], w[1], w[2], w.norm()])
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                n = self.gather(i, True)
                c = self.curl[i]
                w = ti.Vector([c[0], c[1], c[2]])
                # eq. 16: strength (N x w), N = n / |n|; none where the vorticity is even
                size = n.norm()
                if size > 1e-6:
                    self.p.velocity[1].add(
                        i, (self.g.step[None] * self.strength / size) * n.cross(w)
                    )

    @ti.func
    def pair(self, i, j, q, slope: ti.template()) -> Any:
        """Curl by one neighbour, or the gradient of its magnitude."""
        o = self.p.place[1].get(j)
        e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
        g = self.kernel.gradient(e.norm_sqr()) * e
        s = ti.Vector([0.0, 0.0, 0.0])
        if ti.static(slope):
            s = (self.curl[j][3] - self.curl[i][3]) * g
        else:
            # the gradient at i with respect to its own place: curl v = sum (v_j - v_i) x (-grad)
            s = g.cross(self.p.velocity[1].get(j) - self.p.velocity[1].get(i))
        return s
