"""Density constraint: multipliers, displacements, and contributions of boundaries.

Multipliers are positive here and divided by the mass of a particle [m^2]: the pressure is
``virial * density * multiplier / step^2``. Boundary samples have no multiplier: they add to the
density of particles through a kernel of their own (``lattice.solid_factors``).
"""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.bodies import Bodies
from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near
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
        self.near, self.bounds, self.kernel = (
            Near(particles, samples, grid, bounds),
            bounds,
            smoothing,
        )
        self.listed = particles.longest > 0
        self.support2 = grid.support**2
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
        rho, slope, square = self.gather(i, at.xyz)
        self.update(i, at, rho, slope, square, weights)

    @ti.func
    def gather(self, i, q) -> Any:
        """Density of the water around a particle, its gradient, and the sum of their squares."""
        # rho_i = W(0) + sum_j W_ij, grad rho_i = sum_j g_ij e_ij; e_ij = x_i - x_j, grad W = g e
        rho, square = self.own(i), 0.0
        slope = ti.Vector([0.0, 0.0, 0.0])
        for c in range(self.near.columns):
            first, last = self.near.water(i, q, c)
            # the next member is read one turn ahead, so that its latency hides behind the sum
            ahead = self.near.member(i, first)
            for k in range(first, last):
                j = self.near.member(i, k)
                if ti.static(self.p.ahead):
                    j, ahead = ahead, self.near.member(i, k + 1)
                e = q - self.p.place[1].get(j).xyz
                r2 = e.norm_sqr()
                # cells also hold the particle itself and what cannot be commanded, lists do not
                if ti.static(self.listed) or (j != i and r2 < self.support2):
                    w, g = self.kernel.both(r2)
                    rho += w
                    slope += g * e
                    square += g * g * r2
        return rho, slope, square

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
        q = at.xyz
        rho, square = self.own(i), 0.0
        slope = ti.Vector([0.0, 0.0, 0.0])
        a, b = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for k in range(self.p.filled[i]):
            e = q - self.p.place[1].get(self.p.list[i, k]).xyz
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
        # a list is filled up to whole lanes with the particle itself, whose W(0) is taken out again
        more = 0.0
        if ti.static(self.listed and self.p.lanes > 1):
            more = ti.cast(self.p.filled[i] - self.p.near[i], ti.f32)
        return self.kernel.own * (1.0 - more)

    @ti.func
    def update(self, i, at, rho, slope, square, weights):
        """Write the density and the new multiplier of a particle from its sums over the water."""
        q = at.xyz
        rho, slope, square = self.with_walls(i, q, rho, slope, square)
        self.p.density[i] = rho
        have, least = self.p.multiplier[i], self.tension(rho, slope)
        # XPBD: d lambda = (C - alpha lambda) / (|grad C|^2 + alpha), C = rho - 1; the floor holds a
        # lone particle, whose gradients vanish. Chebyshev adds a share of the last change, at[3]
        soft = self.g.compliance[None]
        wanted = (rho - 1.0 - self.yielded(q[2], have)) / (ti.max(square, self.floor) + soft)
        new = ti.max(have + weights[0] * wanted + weights[1] * at[3], least)
        self.p.multiplier[i] = new
        self.p.place[0].set(i, ti.Vector([q[0], q[1], q[2], new - have]))

    @ti.func
    def yielded(self, z, multiplier) -> Any:
        """Compression by a multiplier at a height: by what it is over that of water at rest."""
        # alpha (lambda - lambda_0), with lambda_0 of the pressure rho g (level - z)
        head = ti.max(self.g.level[None] - z, 0.0)
        return self.g.compliance[None] * multiplier - self.g.strain[None] * head

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
    def with_walls(self, i, q, rho, slope, square) -> Any:
        """Density with that of walls, its gradient but along theirs, and the diagonal."""
        square += slope.norm_sqr()
        if self.p.beside[i] > 0:
            more, extra, wall = self.boundary_density(i, q, slope, square)
            rho += more
            square = extra
            # `tension` reads how open the water is: a wall beside it is not open
            slope -= along(slope, wall)
        return rho, slope, square

    @ti.func
    def boundary_density(self, i, q, slope, square) -> Any:
        """Boundary density, the diagonal with the motion of bodies in it, and the gradient."""
        rho = 0.0
        wall = ti.Vector([0.0, 0.0, 0.0])
        moved = ti.Vector([0.0, 0.0, 0.0])
        turned = ti.Vector([0.0, 0.0, 0.0])
        body = 0
        for c in range(self.near.columns):
            first, last = self.near.walls(i, q, c)
            for k in range(first, last):
                w, f, arm, owner = self.boundary_contribution(self.near.member(i, k), q)
                rho += w
                wall += f
                if owner > 0:
                    body, moved, turned = owner, moved + f, turned + arm.cross(f)
        whole = slope + wall
        total = square - slope.norm_sqr() + whole.norm_sqr()
        # a body that gives way makes the constraint softer: its mobility joins the diagonal
        if body > 0:
            total += self.b.body_response(body, moved.norm(), turned.norm())
        return rho, total, wall

    @ti.func
    def boundary_contribution(self, t, q) -> Any:
        """Contribution of one boundary sample: density, gradient, arm about its body, body."""
        o = self.s.place[t]
        e = q - o.xyz
        w, g = self.kernel.solid(e.norm_sqr())
        part = self.scale * o[3]
        owner = self.s.owner[t]
        arm = ti.Vector([0.0, 0.0, 0.0])
        if owner > 0:
            arm = o.xyz - self.b.local_centre(owner)
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
        s = self.displacement(0, i)
        self.p.place[1].set(i, ti.Vector([at[0] + s[0], at[1] + s[1], at[2] + s[2], at[3]]))
        self.p.velocity[1].add(i, s / self.g.step[None])

    @ti.func
    def displacement(self, src: ti.template(), i) -> Any:
        """Displacement of a particle by the multipliers around it, those of buffer ``src``."""
        at = self.p.place[src].get(i)
        q, mine = at.xyz, at[3]
        # dx_i = -sum_j g_ij (K_j d lambda_j + K_i d lambda_i) e_ij, K the isotropy correction:
        # equal and opposite in each pair, so that momentum is kept
        s, own = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for c in range(self.near.columns):
            first, last = self.near.water(i, q, c)
            ahead = self.near.member(i, first)
            for k in range(first, last):
                j = self.near.member(i, k)
                if ti.static(self.p.ahead):
                    j, ahead = ahead, self.near.member(i, k + 1)
                o = self.p.place[src].get(j)
                e = q - o.xyz
                r2 = e.norm_sqr()
                # a particle presses on itself with a zero distance: nothing
                if ti.static(self.listed) or r2 < self.support2:
                    g = -self.kernel.gradient(r2)
                    s += (g * o[3]) * self.corrected(j, e)
                    own += g * e
        s += self.corrected(i, mine * own)
        if self.p.beside[i] > 0:
            s += self.press_off(i, q, mine)
        return s

    @ti.func
    def corrected(self, i, s) -> Any:
        """Displacement by a particle's multiplier, with the isotropy correction."""
        return turned(self.p.correction.get(i), s) if ti.static(self.p.isotropic) else s

    @ti.func
    def press_off(self, i, q, mine) -> Any:
        """Displacement by all boundary samples; static ones also add to the wall impulse."""
        s = ti.Vector([0.0, 0.0, 0.0])
        wall = ti.Vector([0.0, 0.0, 0.0])
        for c in range(self.near.columns):
            first, last = self.near.walls(i, q, c)
            for k in range(first, last):
                t = self.near.member(i, k)
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
        e = q - o.xyz
        _, g = self.kernel.solid(e.norm_sqr())
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
                x = self.s.place[t].xyz
                total = ti.Vector([0.0, 0.0, 0.0])
                if self.bounds.inside(x):
                    for c in range(self.near.columns):
                        first, last = self.near.around(s, x, c)
                        for k in range(first, last):
                            j = self.near.found(s, k)
                            at = self.p.place[self.changes].get(j)
                            # action and reaction: what the sample does to the particle, reversed
                            total -= self.push(j, t, at.xyz, at[3])
                self.s.push[s] = total
                self.s.pressed[s] += total


@ti.func
def along(v, n) -> Any:
    """Return the part of a vector that is along another one."""
    return v.dot(n) / ti.max(n.norm_sqr(), 1e-12) * n
