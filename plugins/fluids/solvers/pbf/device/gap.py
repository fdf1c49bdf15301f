"""Pressure in gaps between bodies and static walls that are too narrow for a particle."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies
from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.device.pressure import Pressure
from seals.plugins.fluids.solvers.pbf.fields import Globals, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti

# a sample nearer than this to those of a wall has no room for water between: the two stand half a
# spacing behind their faces each [spacings]
REACH = 1.7
# the same for samples that are weighed by their volume: up to the first distance all of their force
# along the wall's normal is Archimedes', from the second on none [spacings]
NEAR, FAR = 1.6, 2.0
NONE = -1e9


@ti.data_oriented
class Gap:
    """Water in gaps narrower than a particle: it presses a body off the wall that it lies on.

    Equation:
        F = sum_s p(z) A_s (1 - wet_s) |n_s . n| n over the samples of a body near a wall of normal
        n, p = p_0 + rho g (z_0 - z) from the mean piezometric head of the water that touches the
        body; wet_s is the share that particles between the two press with. A sample that is
        weighed by its volume V_s and pressed by F_s gets (rho g V_s e_z - F_s) . n n instead,
        whatever particles are beside it: Archimedes for it alone. The wall feels -F.

    Without it particles above press a body on the floor down and none lifts it. Real gaps are
    never sealed: the water in them has the pressure of the water around.

    Args:
        bodies: data in and out: heads, impulses.
        particles: data in: multipliers.
        samples: data in: sorted samples, normals, what presses on them.
        grid: cells of the particles.
        bounds: cells of the samples.
        numbers: step, gravity, counts; data out: impulse of walls.
        smoothing: the kernel.
        pressure: whose weight of boundary volumes is used.
        spacing: distance at rest [m].

    Assumptions:
        The water in the gap is at rest: no suction when a body is lifted quickly off the floor.
    """

    def __init__(
        self,
        bodies: Bodies,
        particles: Particles,
        samples: Samples,
        grid: Grid,
        bounds: Grid,
        numbers: Globals,
        smoothing: Smoothing,
        pressure: Pressure,
        *,
        spacing: float,
    ) -> None:
        self.b, self.p, self.s, self.g = bodies, particles, samples, numbers
        self.around, self.bounds = Near(particles, samples, grid, bounds), bounds
        self.kernel = smoothing
        self.reach, self.half = REACH * spacing, 0.5 * spacing
        self.near, self.far = NEAR * spacing, min(FAR * spacing, smoothing.support)
        self.full = smoothing.lattice.press / spacing
        self.virial, self.scale = smoothing.lattice.virial, pressure.scale

    @ti.func
    def per_metre(self) -> Any:
        """Change of the multiplier of water at rest with depth [m]."""
        return self.g.gravity[None] * self.g.step[None] ** 2 / self.virial

    @ti.func
    def find_heads(self):
        """Average the piezometric head around every body. Data in: positions of buffer 1."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                o = self.s.place[self.s.rank[s]]
                x = ti.Vector([o[0], o[1], o[2]])
                total = ti.Vector([0.0, 0.0])
                if self.bounds.inside(x):
                    for c in range(self.around.columns):
                        first, last = self.around.around(s, x, c)
                        for k in range(first, last):
                            total += self.head_of(self.around.found(s, k), x)
                self.s.count[s] = total
        self.b.sum_counts()
        for b in range(1, self.b.bodies + 1):
            total = self.b.counted(b)
            self.b.head[b] = total[0] / total[1] if total[1] > 1e-6 else NONE

    @ti.func
    def head_of(self, j, x) -> Any:
        """Head of a particle, and its weight at a sample."""
        at = self.p.place[1].get(j)
        e = ti.Vector([at[0] - x[0], at[1] - x[1], at[2] - x[2]])
        w, _ = self.kernel.solid(e.norm_sqr())
        held = self.p.multiplier[j]
        if ti.static(self.p.isotropic):
            # next to walls the same pressure needs more of a multiplier, see ``device.isotropy``
            held *= self.p.third[j] / self.virial
        return w * ti.Vector([held + self.per_metre() * at[2], 1.0])

    @ti.func
    def fill(self):
        """Compute the forces on samples in gaps. Data in: heads, positions of buffer 1."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                o = self.s.place[self.s.rank[s]]
                x = ti.Vector([o[0], o[1], o[2]])
                b = self.s.body[s]
                force = ti.Vector([0.0, 0.0, 0.0])
                if self.b.head[b] > NONE and self.bounds.inside(x):
                    thin = self.s.thin[s]
                    away, close = self.wall_normal(x, self.far if thin > 0.0 else self.reach)
                    held = self.b.head[b] - self.per_metre() * (x[2] - self.half * away[2])
                    if away.norm_sqr() > 0.0 and held > 0.0:
                        wet = self.wetness(s, x, away)
                        area = self.full * self.scale * o[3] * self.facing(s, b, away)
                        lift = self.g.gravity[None] * self.g.step[None] ** 2 * away[2]
                        alone = close * (self.scale * o[3] * lift - self.s.pressed[s].dot(away))
                        dry = held * area * (1.0 - ti.min(wet, 1.0))
                        force = (thin * alone + (1.0 - thin) * dry) * away
                self.s.push[s] = force

    @ti.func
    def wall_normal(self, x, reach) -> Any:
        """Direction away from the static samples in reach, zero for none, and how close they are.

        Closeness is 1 up to ``near``, 0 from ``far`` on.
        """
        away, least = ti.Vector([0.0, 0.0, 0.0]), reach
        for ox in range(-1, 2):
            for oy in range(-1, 2):
                first, last = self.bounds.run(self.bounds.start, x, ox, oy, reach)
                for t in range(first, last):
                    if self.s.owner[t] == 0:
                        o = self.s.place[t]
                        e = ti.Vector([x[0] - o[0], x[1] - o[1], x[2] - o[2]])
                        r = e.norm() + 1e-9
                        # squared: samples that come into reach hardly turn it
                        w = ti.max(reach - r, 0.0)
                        away += (w * w * o[3] / r) * e
                        least = ti.min(least, r)
        size = away.norm()
        share = (self.far - least) / (self.far - self.near)
        unit = away / ti.max(size, 1e-12) if size > 1e-6 * reach * reach else 0.0 * away
        return unit, ti.min(ti.max(share, 0.0), 1.0)

    @ti.func
    def facing(self, s, b, away) -> Any:
        """Share of a sample's area that faces the wall; all of it at an edge."""
        n = self.s.normal[s]
        turned = ti.cast(self.b.rotation[b] @ ti.cast(n, ti.f64), ti.f32)
        return ti.abs(turned.dot(away)) if n.norm_sqr() > 0.0 else 1.0

    @ti.func
    def wetness(self, s, x, away) -> Any:
        """Share that particles towards the wall press with."""
        total = 0.0
        for c in range(self.around.columns):
            first, last = self.around.around(s, x, c)
            for k in range(first, last):
                total += self.handed_on(self.around.found(s, k), x, away)
        return total / self.full

    @ti.func
    def handed_on(self, j, x, away) -> Any:
        """Gradient of one particle along the normal, if it is towards the wall."""
        at = self.p.place[1].get(j)
        q = ti.Vector([at[0], at[1], at[2]])
        _, g = self.kernel.solid((q - x).norm_sqr())
        return ti.max(g * (q - x).dot(away), 0.0)

    @ti.func
    def book(self):
        """Let the walls feel the opposite. Data in: sums of `Bodies.gather`."""
        for _ in range(1):
            total = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
            for k in range(self.b.groups[None]):
                total += self.b.force_sum[k]
            self.g.walls[0] += total / ti.cast(self.g.step[None], ti.f64)
