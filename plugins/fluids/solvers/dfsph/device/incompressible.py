"""Constant density and zero divergence by multipliers, with particles and bodies in place.

Multipliers, densities and gradients have the units of ``pbf.device.pressure``: a multiplier is
divided by the mass of a particle [m^2], the pressure is ``virial * density * multiplier / step^2``.
The parts of a substep that all solvers share are kernels of their own here (`SharedParts`).
"""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.finish import Finish
from seals.plugins.fluids.solvers.pbf.device.pressure import Pressure
from seals.plugins.fluids.solvers.pbf.device.sorting import Sorting
from seals.plugins.fluids.solvers.pbf.device.substep import Stages
from seals.plugins.fluids.solvers.pbf.fields import Fields
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class SharedParts:
    """Parts of a substep between which the host looks at residuals.

    Args:
        stages: what all solvers share.
        pressure: forces on bodies.
    """

    def __init__(self, stages: Stages, pressure: Pressure) -> None:
        self.stages, self.pressure, self.bodies = stages, pressure, stages.bodies

    @ti.kernel
    def sort(self, moving: ti.template()):
        """Sort and search, see `Stages.sort`."""
        self.stages.sort(moving)

    @ti.kernel
    def change_velocities(self, moving: ti.template()):
        """Viscosity, friction and surface tension, see `Stages.change_velocities`."""
        self.stages.change_velocities(moving)

    @ti.kernel
    def predict(self):
        """Move bodies by their known loads."""
        self.bodies.predict()

    @ti.kernel
    def react(self):
        """Let bodies answer to the last changes of the multipliers."""
        self.pressure.react()
        self.bodies.gather()

    @ti.kernel
    def fill_gaps(self):
        """Press bodies off the walls that they lie on."""
        self.stages.fill_gaps()

    @ti.kernel
    def travel(self):
        """Let bodies answer to what has touched them, and move them."""
        self.bodies.gather()
        self.bodies.travel()


# particles whose residuals are summed together, as integers: their order does not matter
BUCKET = 4096
QUANTUM = 2.0**-18
# density from which on the divergence counts: that of a flat free surface and more
ENOUGH = 0.75


class SolverFields:
    """Fields that only this solver has.

    Args:
        fields: where they live.
        capacity: number of particles.
    """

    def __init__(self, fields: Fields, capacity: int) -> None:
        self.diagonal = fields.scalar(ti.f32, capacity)
        self.divergence = fields.scalar(ti.f32, capacity)
        # least multiplier, below zero where water may be in tension
        self.least = fields.scalar(ti.f32, capacity)
        self.pressed = fields.scalar(ti.f32, capacity)
        self.buckets = (capacity + BUCKET - 1) // BUCKET
        self.residual = fields.scalar(ti.i32, self.buckets)
        self.fastest = fields.scalar(ti.f32, self.buckets)


@ti.data_oriented
class Incompressible:
    """Jacobi iterations of both constraints on velocities.

    Args:
        own: fields of this solver.
        pressure: sums over neighbours and boundary samples, shared with PBF.
        finish: closes a substep.
        sorting: reports particles outside of the domain.
    """

    def __init__(
        self, own: SolverFields, pressure: Pressure, finish: Finish, sorting: Sorting
    ) -> None:
        self.own, self.q, self.finish, self.sorting = own, pressure, finish, sorting
        self.p, self.s, self.b, self.g = pressure.p, pressure.s, pressure.b, pressure.g
        self.near, self.bounds, self.kernel = pressure.near, pressure.bounds, pressure.kernel

    @ti.kernel
    def factors(self):
        """Compute densities and diagonals. Data in: positions of buffer 1."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                q = self.p.place[1].get(i).xyz
                rho, slope, square = self.q.gather(i, q)
                rho, slope, square = self.q.with_walls(i, q, rho, slope, square)
                self.own.least[i] = self.q.tension(rho, slope)
                self.p.density[i] = rho
                self.own.diagonal[i] = ti.max(square, self.q.floor)
                self.own.divergence[i] = 0.0

    @ti.kernel
    def correct_divergence(self, gain: ti.f32, memory: ti.f32):
        """Compute the change of the divergence's multipliers. Data in: velocities of buffer 1."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                rate = 0.0
                if self.p.density[i] > ENOUGH:
                    rate = self.g.step[None] * self.divergence_of(i, self.p.velocity[1])
                # Jacobi step on d rho/dt = 0: gain times residual, and a share of the last change
                have, size = self.own.divergence[i], self.own.diagonal[i]
                old = self.p.place[1].get(i)[3] if memory != 0.0 else 0.0
                least = self.own.least[i]
                new = ti.max(have + gain * rate / size + memory * old, least)
                self.own.divergence[i] = new
                self.p.place[1].set_last(i, new - have)
                # complementarity: what draws apart is solved once its multiplier is least
                self.count_residual(i, ti.max(rate, (least - have) * size))

    @ti.kernel
    def correct_density(self, gain: ti.f32, memory: ti.f32):
        """Compute the change of the multipliers. Data in: velocities of buffer 0."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                have, soft = self.p.multiplier[i], self.g.compliance[None]
                rate = self.g.step[None] * self.divergence_of(i, self.p.velocity[0])
                # density at the end of the substep, rho + h d rho/dt, against 1 + alpha lambda
                z = self.p.place[1].get(i)[2]
                over = self.p.density[i] + rate - 1.0 - self.q.yielded(z, have)
                old = self.p.place[1].get(i)[3] if memory != 0.0 else 0.0
                size = self.own.diagonal[i] + soft
                least = self.own.least[i]
                new = ti.max(have + gain * over / size + memory * old, least)
                self.p.multiplier[i] = new
                self.p.place[1].set_last(i, new - have)
                self.count_residual(i, ti.max(over, (least - have) * size))

    @ti.func
    def count_residual(self, i, left):
        """Add the residual of a constraint to its bucket, by its absolute value."""
        # integers add up to the same sum in every order; rounded to the next quantum
        part = ti.cast(ti.min(ti.abs(left), 1.0) / QUANTUM + 0.5, ti.i32)
        if part > 0:
            # at most 2^30 in a bucket
            ti.atomic_add(self.own.residual[i // BUCKET], ti.min(part, 1 << 18))

    @ti.func
    def divergence_of(self, i, values: ti.template()) -> Any:
        """Rate of the density by the velocities around a particle [1/s].

        With the gradients of `displacement`, the correction included: the equations are symmetric.
        """
        q, v = self.p.place[1].get(i).xyz, values.get(i)
        # d rho_i/dt = sum_j g_ij (K_i e_ij) . (v_i - v_j)
        rate = 0.0
        for c in range(self.near.columns):
            first, last = self.near.water(i, q, c)
            for k in range(first, last):
                j = self.near.member(i, k)
                e = q - self.p.place[1].get(j).xyz
                g = self.kernel.gradient(e.norm_sqr())
                rate += g * self.q.corrected(i, e).dot(v - values.get(j))
            if self.p.beside[i] > 0:
                first, last = self.near.walls(i, q, c)
                for k in range(first, last):
                    rate += self.wall_rate(i, self.near.member(i, k), q, v)
        return rate

    @ti.func
    def wall_rate(self, i, t, q, v) -> Any:
        """Rate of the density of particle ``i`` by one boundary sample [1/s]."""
        o = self.s.place[t]
        x = ti.Vector([o[0], o[1], o[2]])
        e = q - x
        _, g = self.kernel.solid(e.norm_sqr())
        other = self.b.velocity_at(self.s.owner[t], x)
        return self.q.scale * o[3] * g * self.q.corrected(i, e).dot(v - other)

    @ti.kernel
    def accelerate(self, buffer: ti.template()):
        """Change velocities by the multipliers' changes, and clear the residual."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.p.velocity[buffer].add(i, self.q.displacement(1, i) / self.g.step[None])
        for k in range(self.own.buckets):
            self.own.residual[k] = 0

    @ti.kernel
    def fall(self):
        """Apply gravity to buffer 0, and take the multipliers of the last substep as a change."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.p.velocity[0].add(
                    i, ti.Vector([0.0, 0.0, -self.g.step[None] * self.g.gravity[None]])
                )
                self.p.place[1].set_last(i, self.p.multiplier[i])

    @ti.kernel
    def keep_off(self):
        """Keep lone particles off the samples at the end of the substep. Data in: buffer 0."""
        for i in range(self.p.capacity):
            if i < self.g.count[None] and self.p.beside[i] > 0:
                q = self.p.place[1].get(i).xyz
                s, wall = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
                for c in range(self.near.columns):
                    first, last = self.near.walls(i, q, c)
                    for k in range(first, last):
                        t = self.near.member(i, k)
                        part = self.touch(i, t)
                        s += part
                        wall += part if self.s.owner[t] == 0 else 0.0 * part
                self.p.wall[i] += wall
                self.p.velocity[1].set(i, s / self.g.step[None])
            elif i < self.g.count[None]:
                self.p.velocity[1].set(i, ti.Vector([0.0, 0.0, 0.0]))

    @ti.func
    def touch(self, i, t) -> Any:
        """Displacement of a particle by one sample, both where they go in this substep."""
        o, h = self.s.place[t], self.g.step[None]
        v = self.p.velocity[0].get(i) - self.b.velocity_at(self.s.owner[t], o.xyz)
        return self.q.touch(self.p.place[1].get(i).xyz - o.xyz + h * v, o[3])

    @ti.kernel
    def react_to_touch(self):
        """Compute the forces of `keep_off` on moving samples."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                t = self.s.rank[s]
                x = self.s.place[t].xyz
                total = ti.Vector([0.0, 0.0, 0.0])
                if self.bounds.inside(x):
                    for c in range(self.near.columns):
                        first, last = self.near.around(s, x, c)
                        for k in range(first, last):
                            total -= self.touch(self.near.found(s, k), t)
                self.s.push[s] = total

    @ti.kernel
    def travel(self):
        """Move all particles to where they are at the end. Data out: buffer 0, wall impulse."""
        for k in range(self.own.buckets):
            self.own.fastest[k] = 0.0
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                h, at = self.g.step[None], self.p.place[1].get(i)
                # buffer 1 holds what `keep_off` adds: contact acts on the way of this substep
                v = self.p.velocity[0].get(i) + self.p.velocity[1].get(i)
                self.p.velocity[0].set(i, v)
                q = ti.Vector([at[0] + h * v[0], at[1] + h * v[1], at[2] + h * v[2]])
                if not self.near.grid.inside(q):
                    self.sorting.report(q)
                held = self.p.multiplier[i]
                self.p.place[0].set(i, ti.Vector([q[0], q[1], q[2], held]))
                self.own.pressed[i] = held + self.own.divergence[i]
                ti.atomic_max(self.own.fastest[i // BUCKET], v.norm_sqr())
        self.finish.sum_walls()
