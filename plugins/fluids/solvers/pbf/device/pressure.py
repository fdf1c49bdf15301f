"""Density constraint: multipliers, displacements, and contributions of boundaries.

Multipliers are positive here and divided by the mass of a particle [m^2]: the pressure is
``virial * density * multiplier / step^2``. Boundary samples have no multiplier: they add to the
density of particles through a kernel of their own (``lattice.solid_factors``).
"""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies
from seals.plugins.fluids.solvers.pbf.device.grid import SLACK, Grid
from seals.plugins.fluids.solvers.pbf.device.isotropy import Isotropy, moment, turned
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import Globals, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti

# particles closer to a sample than this are pushed off it: a lone drop has too little density to
# be held by a single layer of samples [spacings]
CONTACT = 0.72
CONTACT_SHARE = 0.5
# densities between which water tears: a single layer on a wall has 0.85
TORN, WHOLE = 0.86, 0.92


@ti.data_oriented
class Pressure:
    """Jacobi sweeps of the constraint solver.

    Args:
        particles: model: capacity; data in and out: the two buffers.
        samples: data in: sorted samples.
        bodies: data in: inverse masses seen by a particle that touches a body.
        grid: cells of the particles.
        bounds: cells of the samples.
        numbers: step, compliance, counts.
        smoothing: the kernel.
        spacing: distance at rest [m].
        scale: weight of boundary volumes.
        isotropy: correction that `open` computes along with the first multipliers.
        touching: whether `push` keeps lone particles off the samples, too.
        suction: whether enclosed water may be in tension, see `tension`.
    """

    def __init__(
        self,
        *,
        particles: Particles,
        samples: Samples,
        bodies: Bodies,
        grid: Grid,
        bounds: Grid,
        numbers: Globals,
        smoothing: Smoothing,
        spacing: float,
        scale: float,
        isotropy: Isotropy,
        touching: bool = True,
        suction: bool = False,
    ) -> None:
        # buffer that the last changes of multipliers are in
        self.changes = 0 if touching else 1
        self.touching, self.suction, self.isotropy = touching, suction, isotropy
        # gradient of the density at a flat free surface
        self.free = 0.5 * smoothing.lattice.press / spacing
        self.p, self.s, self.b, self.g = particles, samples, bodies, numbers
        self.grid, self.bounds, self.kernel = grid, bounds, smoothing
        self.listed = particles.longest > 0
        self.support2 = grid.support**2
        self.reach = SLACK * grid.support
        self.contact = CONTACT * spacing
        self.floor = 0.25 * smoothing.lattice.stiffness / spacing**2
        self.scale = scale

    @ti.func
    def multipliers(self, k):
        """Compute change ``k`` of the multipliers. Data in: buffer 1. Data out: buffer 0."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.solve(i, self.g.weights[k])

    @ti.func
    def solve(self, i, weights):
        """Density, its gradients and the new multiplier of one particle."""
        at = self.p.place[1].get(i)
        q = ti.Vector([at[0], at[1], at[2]])
        rho, square = self.own(i), 0.0
        slope = ti.Vector([0.0, 0.0, 0.0])
        if ti.static(self.listed):
            if ti.static(self.p.ahead):
                j = self.p.list[i, 0]
                for k in range(self.p.filled[i]):
                    following = self.p.list[i, k + 1]
                    rho, slope, square = self.fluid_contribution(1, j, q, rho, slope, square)
                    j = following
            else:
                for k in range(self.p.filled[i]):
                    rho, slope, square = self.fluid_contribution(
                        1, self.p.list[i, k], q, rho, slope, square
                    )
        else:
            for ox in range(-1, 2):
                for oy in range(-1, 2):
                    first, last = self.grid.run(self.grid.start, q, ox, oy, self.reach)
                    for j in range(first, last):
                        if j != i:
                            rho, slope, square = self.fluid_contribution(
                                1, j, q, rho, slope, square
                            )
        self.update(i, at, rho, slope, square, weights)

    @ti.func
    def open(self):
        """Compute isotropy corrections and the first multipliers in one pass over stored lists.

        Data in: positions of buffer 1. Data out: corrections, buffer 0.
        """
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.open_one(i)

    @ti.func
    def open_one(self, i):
        """Correction and first multiplier of one particle."""
        at = self.p.place[1].get(i)
        q = ti.Vector([at[0], at[1], at[2]])
        rho, square = self.own(i), 0.0
        slope = ti.Vector([0.0, 0.0, 0.0])
        a, b = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for k in range(self.p.filled[i]):
            o = self.p.place[1].get(self.p.list[i, k])
            e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
            r2 = e.norm_sqr()
            w, g = self.kernel.both(r2)
            rho += w
            slope += g * e
            square += g * g * r2
            a, b = moment(a, b, e, -g)
        c, d = self.isotropy.beside(i, q)
        self.isotropy.note(i, a, b, c, d)
        self.update(i, at, rho, slope, square, self.g.weights[0])

    @ti.func
    def own(self, i) -> Any:
        """Density by a particle itself, less what it adds where it fills up its list."""
        more = 0.0
        if ti.static(self.listed and self.p.lanes > 1):
            more = ti.cast(self.p.filled[i] - self.p.near[i], ti.f32)
        return self.kernel.own * (1.0 - more)

    @ti.func
    def update(self, i, at, rho, slope, square, weights):
        """Write the density and the new multiplier of a particle from its sums over the water."""
        q = ti.Vector([at[0], at[1], at[2]])
        square += slope.norm_sqr()
        if self.p.beside[i] > 0:
            more, extra, wall = self.boundary_density(i, q, slope, square)
            rho += more
            square = extra
            slope -= along(slope, wall)
        self.p.density[i] = rho
        have, least = self.p.multiplier[i], self.tension(rho, slope)
        soft = self.g.compliance[None]
        wanted = (rho - 1.0 - soft * have) / (ti.max(square, self.floor) + soft)
        new = ti.max(have + weights[0] * wanted + weights[1] * at[3], least)
        self.p.multiplier[i] = new
        self.p.place[0].set(i, ti.Vector([q[0], q[1], q[2], new - have]))

    @ti.func
    def tension(self, rho, slope) -> Any:
        """Least multiplier of a particle: below zero inside of the water, zero at its surface.

        Args:
            rho: density of water and walls.
            slope: gradient of the density of water, but for what is along that of walls: a wall
                that draws away leaves the layer on it enclosed, until its density says otherwise.
        """
        least = 0.0
        if ti.static(self.suction):
            even = ti.min(ti.max(2.0 - 4.0 * slope.norm() / self.free, 0.0), 1.0)
            full = ti.min(ti.max((rho - TORN) / (WHOLE - TORN), 0.0), 1.0)
            least = -even * full * self.g.tension[None]
        return least

    @ti.func
    def fluid_contribution(self, src: ti.template(), j, q, rho, slope, square) -> Any:
        """Add the contribution of one fluid neighbour to density and gradients."""
        o = self.p.place[src].get(j)
        e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
        r2 = e.norm_sqr()
        if ti.static(self.listed) or r2 < self.support2:
            w, g = self.kernel.both(r2)
            rho += w
            slope += g * e
            square += g * g * r2
        return rho, slope, square

    @ti.func
    def boundary_density(self, i, q, slope, square) -> Any:
        """Boundary density, the diagonal with the motion of bodies in it, and the gradient."""
        rho = 0.0
        wall = ti.Vector([0.0, 0.0, 0.0])
        moved = ti.Vector([0.0, 0.0, 0.0])
        turned = ti.Vector([0.0, 0.0, 0.0])
        body = 0
        if ti.static(self.listed):
            for k in range(self.p.filled[i], self.p.filled[i] + self.p.beside[i]):
                w, f, arm, owner = self.boundary_contribution(self.p.list[i, k], q)
                rho += w
                wall += f
                if owner > 0:
                    body, moved, turned = owner, moved + f, turned + arm.cross(f)
        else:
            for ox in range(-1, 2):
                for oy in range(-1, 2):
                    first, last = self.bounds.run(self.bounds.start, q, ox, oy, self.reach)
                    for t in range(first, last):
                        w, f, arm, owner = self.boundary_contribution(t, q)
                        rho += w
                        wall += f
                        if owner > 0:
                            body, moved, turned = owner, moved + f, turned + arm.cross(f)
        whole = slope + wall
        total = square - slope.norm_sqr() + whole.norm_sqr()
        if body > 0:
            total += self.b.body_response(body, moved.norm(), turned.norm())
        return rho, total, wall

    @ti.func
    def boundary_contribution(self, t, q) -> Any:
        """Contribution of one boundary sample: density, gradient, arm about its body, body."""
        o = self.s.place[t]
        e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
        w, g = self.kernel.solid(e.norm_sqr())
        part = self.scale * o[3]
        owner = self.s.owner[t]
        arm = ti.Vector([0.0, 0.0, 0.0])
        if owner > 0:
            arm = ti.Vector([o[0], o[1], o[2]]) - self.b.local_centre(owner)
        return part * w, part * g * e, arm, owner

    @ti.func
    def begin(self):
        """Take what a warm start has written as the first change. Data out: buffer 0."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.p.place[0].set(i, self.p.place[1].get(i))

    @ti.func
    def displace(self):
        """Move all particles. Data in: buffer 0. Data out: positions in buffer 1."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.move(i)

    @ti.func
    def move(self, i):
        """Move one particle by the multipliers around it."""
        at = self.p.place[0].get(i)
        q = ti.Vector([at[0], at[1], at[2]])
        s = ti.Vector([0.0, 0.0, 0.0])
        own = ti.Vector([0.0, 0.0, 0.0])
        if ti.static(self.listed):
            if ti.static(self.p.ahead):
                j = self.p.list[i, 0]
                for k in range(self.p.filled[i]):
                    following = self.p.list[i, k + 1]
                    theirs, even = self.press(0, j, q)
                    s, own = s + theirs, own + even
                    j = following
            else:
                for k in range(self.p.filled[i]):
                    theirs, even = self.press(0, self.p.list[i, k], q)
                    s, own = s + theirs, own + even
        else:
            for ox in range(-1, 2):
                for oy in range(-1, 2):
                    first, last = self.grid.run(self.grid.start, q, ox, oy, self.reach)
                    for j in range(first, last):
                        # a particle presses on itself with a zero distance: nothing
                        theirs, even = self.press(0, j, q)
                        s, own = s + theirs, own + even
        s += self.corrected(i, at[3] * own)
        if self.p.beside[i] > 0:
            s += self.press_off(i, q, at[3])
        self.p.place[1].set(i, ti.Vector([q[0] + s[0], q[1] + s[1], q[2] + s[2], at[3]]))
        self.p.velocity[1].add(i, s / self.g.step[None])

    @ti.func
    def corrected(self, i, s) -> Any:
        """Displacement by a particle's multiplier, with the isotropy correction."""
        return turned(self.p.correction.get(i), s) if ti.static(self.p.isotropic) else s

    @ti.func
    def press(self, src: ti.template(), j, q) -> Any:
        """Displacement by one neighbour's multiplier, and by an own one of 1 without correction."""
        o = self.p.place[src].get(j)
        e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
        r2 = e.norm_sqr()
        theirs, own = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        if ti.static(self.listed) or r2 < self.support2:
            g = -self.kernel.gradient(r2)
            theirs, own = (g * o[3]) * self.corrected(j, e), g * e
        return theirs, own

    @ti.func
    def press_off(self, i, q, mine) -> Any:
        """Displacement by all boundary samples; static ones also add to the wall impulse."""
        s = ti.Vector([0.0, 0.0, 0.0])
        wall = ti.Vector([0.0, 0.0, 0.0])
        if ti.static(self.listed):
            for k in range(self.p.filled[i], self.p.filled[i] + self.p.beside[i]):
                t = self.p.list[i, k]
                part = self.push(i, t, q, mine)
                s += part
                if self.s.owner[t] == 0:
                    wall += part
        else:
            for ox in range(-1, 2):
                for oy in range(-1, 2):
                    first, last = self.bounds.run(self.bounds.start, q, ox, oy, self.reach)
                    for t in range(first, last):
                        part = self.push(i, t, q, mine)
                        s += part
                        if self.s.owner[t] == 0:
                            wall += part
        self.p.wall[i] += wall
        return s

    @ti.func
    def push(self, i, t, q, mine) -> Any:
        """Displacement of particle ``i`` at ``q`` by the sorted sample: pressure and contact."""
        o = self.s.place[t]
        e = ti.Vector([q[0] - o[0], q[1] - o[1], q[2] - o[2]])
        r2 = e.norm_sqr()
        _, g = self.kernel.solid(r2)
        s = self.corrected(i, (-mine * self.scale * o[3] * g) * e)
        if ti.static(self.touching):
            s += self.touch(e, o[3])
        return s

    @ti.func
    def touch(self, e, weight) -> Any:
        """Displacement that keeps a lone particle off a sample, ``e`` from it."""
        s = ti.Vector([0.0, 0.0, 0.0])
        r2 = e.norm_sqr()
        if r2 < self.contact * self.contact:
            r = ti.sqrt(r2) + 1e-9
            # several samples of a fine sheet share what one coarse sample does
            share = CONTACT_SHARE * ti.min(weight, 1.0)
            s = (share * (self.contact - r) / r) * e
        return s

    @ti.func
    def react(self):
        """Compute the forces of particles on moving samples. Data in: the buffer of changes."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                t = self.s.rank[s]
                o = self.s.place[t]
                x = ti.Vector([o[0], o[1], o[2]])
                total = ti.Vector([0.0, 0.0, 0.0])
                if self.bounds.inside(x):
                    if ti.static(self.listed):
                        for k in range(self.s.near[s]):
                            j = self.s.list[s, k]
                            at = self.p.place[self.changes].get(j)
                            q = ti.Vector([at[0], at[1], at[2]])
                            total -= self.push(j, t, q, at[3])
                    else:
                        for ox in range(-1, 2):
                            for oy in range(-1, 2):
                                first, last = self.grid.run(self.grid.start, x, ox, oy, self.reach)
                                for j in range(first, last):
                                    at = self.p.place[self.changes].get(j)
                                    q = ti.Vector([at[0], at[1], at[2]])
                                    total -= self.push(j, t, q, at[3])
                self.s.push[s] = total
                self.s.pressed[s] += total


@ti.func
def along(v, n) -> Any:
    """Return the part of a vector that is along another one."""
    return v.dot(n) / ti.max(n.norm_sqr(), 1e-12) * n
