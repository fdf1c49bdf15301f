"""End of a substep: artificial viscosity, wall friction, copy to buffer 0, sums."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies
from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import CHUNK, Globals, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class Finish:
    """Kernels that close a substep.

    Args:
        particles: data in: buffer 1 velocities; data out: buffer 0.
        grid: cells of the particles.
        numbers: counts, blend; data out: partial sums.
        smoothing: the kernel.
        blended: whether neighbouring velocities are blended at all.
        damped: whether the biharmonic artificial viscosity is on, see `close`.
        samples: data in: sorted samples.
        bodies: data in: their twists.
        friction: of static walls and of bodies, see `skin_friction` [1].
        spacing: distance at rest [m].
        last: whether the pressure has acted before `close`, so that walls are complete.
    """

    def __init__(
        self,
        particles: Particles,
        grid: Grid,
        numbers: Globals,
        smoothing: Smoothing,
        samples: Samples,
        bodies: Bodies,
        *,
        blended: bool,
        damped: bool,
        friction: tuple[float, float],
        spacing: float,
        last: bool = True,
    ) -> None:
        self.last = last
        self.s, self.b, self.spacing = samples, bodies, spacing
        self.walls, self.skin = friction
        # what a wall adds to the density of the layer on it
        self.full = smoothing.lattice.behind
        self.p, self.g, self.kernel = particles, numbers, smoothing
        self.near = Near(particles, samples, grid, None)
        self.blended, self.damped = blended, damped
        self.listed = particles.longest > 0
        self.support2 = grid.support**2

    @ti.func
    def find_laplacian(self):
        """Compute the velocity Laplacian. Data in: positions and velocities of buffer 1."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.p.laplacian.set(i, self.laplacian(i, self.p.velocity[1]))

    @ti.func
    def close(self):
        """Apply viscosity and wall friction. Data out: buffer 0, wall impulse.

        Equation:
            (L v)_i = sum_j W_ij (v_j - v_i); v <- v + blend L v - calm L (L v). The second term
            takes out what differs from one particle to the next and leaves what is smooth over
            some spacings: it falls with the fourth power of the wave number.
        """
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                v = self.p.velocity[1].get(i)
                if ti.static(self.damped):
                    v += self.g.blend[None] * self.p.laplacian.get(i)
                    # biharmonic: the Laplacian of the Laplacian that `find_laplacian` left
                    v -= self.g.damping[None] * self.laplacian(i, self.p.laplacian)
                elif ti.static(self.blended):
                    v += self.g.blend[None] * self.laplacian(i, self.p.velocity[1])
                if ti.static(self.walls > 0 and self.listed):
                    change, _ = self.skin_friction(i, v, False, self.walls)
                    self.p.wall[i] += self.g.step[None] * change
                    v += change
                if ti.static(self.skin > 0 and self.listed):
                    change, near = self.skin_friction(i, v, True, self.skin)
                    self.p.rubbed[i] = self.g.step[None] / ti.max(near, 1e-9) * change
                    v += change
                self.p.velocity[0].set(i, v)
                self.p.number[0][i] = self.p.number[1][i]
                at = self.p.place[1].get(i)
                self.p.place[0].set(i, ti.Vector([at[0], at[1], at[2], self.p.multiplier[i]]))
        if ti.static(self.last):
            self.sum_walls()

    @ti.func
    def sum_walls(self):
        """Add the impulses on static walls of this substep to those of the step."""
        for c in range(self.g.chunks):
            total = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
            for i in range(c * CHUNK, ti.min((c + 1) * CHUNK, self.g.count[None])):
                total += ti.cast(self.p.wall[i], ti.f64)
            self.g.walls[c] += total / ti.cast(self.g.step[None], ti.f64)

    @ti.func
    def skin_friction(self, i, v, moving: ti.template(), friction) -> Any:
        """Velocity change by skin friction, stress friction / 2 density speed^2, and weight.

        It acts on the layer at a wall or body, a spacing deep, against the flow along it, and is
        taken implicitly: it stops no particle within one substep. The weight is that of the samples
        that the reaction falls on.
        """
        q = self.p.place[1].get(i).xyz
        near, normal, v0 = 0.0, ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for k in range(self.p.filled[i], self.p.filled[i] + self.p.beside[i]):
            t = self.p.list[i, k]
            body = self.s.owner[t]
            if (body > 0) == moving:
                o = self.s.place[t]
                x = o.xyz
                w, g = self.kernel.solid((q - x).norm_sqr())
                near += o[3] * w
                normal -= o[3] * g * (q - x)
                if ti.static(moving):
                    v0 += o[3] * w * self.b.velocity_at(body, x)
        # slip along the wall: the flow past the body without its part normal to the surface
        size = normal.norm() + 1e-9
        past = v - v0 / ti.max(near, 1e-9)
        along = past - past.dot(normal) / (size * size) * normal
        share = ti.min(near / self.full, 1.0)
        # dv/dt = -c_f / 2 |v| v / d over a layer one spacing deep; implicit Euler: v / (1 + h rate)
        rate = 0.5 * friction * share * along.norm() / self.spacing
        return -(1.0 - 1.0 / (1.0 + rate * self.g.step[None])) * along, near

    @ti.func
    def rub(self):
        """Compute the reactions of friction on moving samples. Data in: ``src``."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                o = self.s.place[self.s.rank[s]]
                total = ti.Vector([0.0, 0.0, 0.0])
                for k in range(self.s.near[s]):
                    j = self.s.list[s, k]
                    w, _ = self.kernel.solid((self.p.place[1].get(j).xyz - o.xyz).norm_sqr())
                    total -= o[3] * w * self.p.rubbed[j]
                self.s.push[s] = total

    @ti.func
    def laplacian(self, i, values: ti.template()) -> Any:
        """Difference to the neighbours' values, weighted by the kernel."""
        v, q = values.get(i), self.p.place[1].get(i).xyz
        s = ti.Vector([0.0, 0.0, 0.0])
        for c in range(self.near.columns):
            first, last = self.near.water(i, q, c)
            for k in range(first, last):
                j = self.near.member(i, k)
                r2 = (q - self.p.place[1].get(j).xyz).norm_sqr()
                if ti.static(self.listed) or r2 < self.support2:
                    s += self.kernel.value(r2) * (values.get(j) - v)
        return s

    @ti.kernel
    def sums(self, velocity: ti.template(), src: ti.template()):
        """Sum velocity, its square and compression by chunk, with the largest values."""
        for c in range(self.g.chunks):
            # one thread sums a chunk in order: the result is the same for any number of them
            flow = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
            energy, squeezed, residual = ti.f64(0.0), ti.f64(0.0), ti.f64(0.0)
            most = 0.0
            for i in range(c * CHUNK, ti.min((c + 1) * CHUNK, self.g.count[None])):
                v = ti.cast(self.p.velocity[velocity].get(i), ti.f64)
                flow += v
                energy += v.norm_sqr()
                over = ti.max(self.p.density[i] - 1.0, 0.0)
                squeezed += over
                most = ti.max(most, over)
                # what is left of C - alpha lambda = 0 where it presses
                held = ti.max(self.p.multiplier[i], 0.0)
                head = ti.max(self.g.level[None] - self.p.place[0].get(i)[2], 0.0)
                left = over - self.g.compliance[None] * held + self.g.strain[None] * head
                residual += ti.max(left, 0.0)
            for k in ti.static(range(3)):
                self.g.partial[c, k] = flow[k]
            self.g.partial[c, 3] = energy
            self.g.partial[c, 4] = squeezed
            self.g.partial[c, 5] = most
            self.g.partial[c, 6] = residual
