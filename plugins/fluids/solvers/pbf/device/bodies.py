"""Rigid bodies inside the solver: motion in a substep, and impulses received."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import Fields, Globals, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti

GROUP = 64
# Many particles push one light body at the same time. Its answer to the heave of the pressure
# around it is a third of the sum of all pushes (the mean squared cosine over a sphere).
SHARE = 1 / 3
# position, rotation, velocity, spin, inverse mass and inertia, accelerations
INBOX = 3 + 9 + 3 + 3 + 1 + 9 + 3 + 3
# position, rotation, velocity, spin, impulse, moment of the impulse
OUTBOX = 3 + 9 + 3 + 3 + 3 + 3


@ti.data_oriented
class Bodies:
    """Bodies 1..K with poses and twists in world axes, positions relative to the domain corner.

    Args:
        fields: where they live.
        bodies: number K.
        samples: boundary samples, those of bodies first, ordered by body.
        numbers: step and counts.
        mass: mass of a particle [kg].
        in_place: whether bodies stay where they are until the end of a substep, so that
            iterations change their velocities only.
    """

    def __init__(
        self,
        fields: Fields,
        bodies: int,
        samples: Samples,
        numbers: Globals,
        mass: float,
        *,
        in_place: bool = False,
    ) -> None:
        self.s, self.g, self.mass, self.in_place = samples, numbers, mass, in_place
        self.bodies = bodies
        self.centre = fields.vector(3, ti.f64, bodies + 1)
        self.rotation = fields.matrix(ti.f64, bodies + 1)
        self.velocity = fields.vector(3, ti.f64, bodies + 1)
        self.spin = fields.vector(3, ti.f64, bodies + 1)
        self.acceleration = fields.vector(3, ti.f64, bodies + 1)
        self.angular = fields.vector(3, ti.f64, bodies + 1)
        self.inverse_mass = fields.scalar(ti.f64, bodies + 1)
        self.inverse_inertia = fields.matrix(ti.f64, bodies + 1)
        self.impulse = fields.vector(3, ti.f64, bodies + 1)
        self.moment = fields.vector(3, ti.f64, bodies + 1)
        # one row per body, see ``receive`` and ``report``
        self.inbox = fields.scalar(ti.f64, bodies + 1, INBOX)
        self.outbox = fields.scalar(ti.f64, bodies + 1, OUTBOX)
        # piezometric head of the water around, as a multiplier, see ``device.gap``
        self.head = fields.scalar(ti.f32, bodies + 1)
        self.neighbour_count = fields.vector(2, ti.f32, bodies + 1)
        # what the sweeps read in single precision: centre (3), inverse mass and inertia
        self.compact = fields.vector(5, ti.f32, bodies + 1)
        self.twist = fields.vector(6, ti.f32, bodies + 1)
        # each body's samples are summed in groups: body of a group, first and last sample
        most = samples.capacity // GROUP + bodies + 1
        self.groups = fields.scalar(ti.i32)
        self.group = fields.vector(3, ti.i32, most)
        self.most = most
        self.force_sum = fields.vector(3, ti.f64, most)
        self.moment_sum = fields.vector(3, ti.f64, most)
        self.count_sum = fields.vector(2, ti.f32, most)
        self.first = fields.vector(2, ti.i32, bodies + 1)

    @ti.func
    def local_centre(self, body) -> Any:
        """Centre of mass in single precision."""
        c = self.compact[body]
        return ti.Vector([c[0], c[1], c[2]])

    @ti.func
    def velocity_at(self, body, x) -> Any:
        """Velocity of a body's material at a point; zero for what is static."""
        t, c = self.twist[body], self.local_centre(body)
        w = ti.Vector([t[3], t[4], t[5]])
        v = ti.Vector([t[0], t[1], t[2]]) + w.cross(x - c)
        return v if body > 0 else ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def body_response(self, body, slope, turn) -> Any:
        """Return the mobility of a body for a density gradient and its moment [1/m^2]."""
        # the sum over all particles that press it bounds the answer to each of them, see SHARE
        count, c = self.neighbour_count[body], self.compact[body]
        return self.mass * (
            c[3] * slope * ti.max(slope, SHARE * count[0])
            + c[4] * turn * ti.max(turn, SHARE * count[1])
        )

    @ti.kernel
    def receive(self):
        """Copy body states from the host. Data in: inbox. Data out: body states."""
        for b in range(1, self.bodies + 1):
            for k in ti.static(range(3)):
                self.centre[b][k] = self.inbox[b, k]
                self.velocity[b][k] = self.inbox[b, 12 + k]
                self.spin[b][k] = self.inbox[b, 15 + k]
                self.acceleration[b][k] = self.inbox[b, 28 + k]
                self.angular[b][k] = self.inbox[b, 31 + k]
                for j in ti.static(range(3)):
                    self.rotation[b][k, j] = self.inbox[b, 3 + 3 * k + j]
                    self.inverse_inertia[b][k, j] = self.inbox[b, 19 + 3 * k + j]
            self.inverse_mass[b] = self.inbox[b, 18]
            if ti.static(self.in_place):
                self.publish(b)

    @ti.kernel
    def report(self):
        """Copy body states and impulses to the host, and zero the impulses. Data out: outbox."""
        for b in range(1, self.bodies + 1):
            for k in ti.static(range(3)):
                self.outbox[b, k] = self.centre[b][k]
                self.outbox[b, 12 + k] = self.velocity[b][k]
                self.outbox[b, 15 + k] = self.spin[b][k]
                self.outbox[b, 18 + k] = self.impulse[b][k]
                self.outbox[b, 21 + k] = self.moment[b][k]
                self.impulse[b][k] = 0.0
                self.moment[b][k] = 0.0
                for j in ti.static(range(3)):
                    self.outbox[b, 3 + 3 * k + j] = self.rotation[b][k, j]

    @ti.func
    def predict(self):
        """Move bodies by their known loads over one substep."""
        h = ti.cast(self.g.step[None], ti.f64)
        for b in range(1, self.bodies + 1):
            self.velocity[b] += h * self.acceleration[b]
            self.spin[b] += h * self.angular[b]
            if ti.static(not self.in_place):
                self.centre[b] += h * self.velocity[b]
                self.turn(b, h * self.spin[b])
            self.publish(b)

    @ti.func
    def travel(self):
        """Move bodies that stayed in place by their velocities over one substep."""
        h = ti.cast(self.g.step[None], ti.f64)
        for b in range(1, self.bodies + 1):
            self.centre[b] += h * self.velocity[b]
            self.turn(b, h * self.spin[b])
            self.publish(b)

    @ti.func
    def carry(self):
        """Move the samples with their bodies. Data in: body poses. Data out: sample positions."""
        for s in range(self.s.capacity):
            if s < self.g.samples[None]:
                self.put(s)

    @ti.func
    def turn(self, b, angle):
        """Rotate a body by a small rotation vector, to second order."""
        r = self.rotation[b]
        # exp(w) = 1 + w + w^2 / 2 + O(w^3)
        w = ti.Matrix(
            [[0.0, -angle[2], angle[1]], [angle[2], 0.0, -angle[0]], [-angle[1], angle[0], 0.0]],
            dt=ti.f64,
        )
        self.rotation[b] = r + w @ r + 0.5 * (w @ (w @ r))

    @ti.func
    def publish(self, b):
        """Write the body quantities that the iterations read."""
        c, j = self.centre[b], self.inverse_inertia[b]
        self.compact[b] = ti.Vector(
            [
                ti.cast(c[0], ti.f32),
                ti.cast(c[1], ti.f32),
                ti.cast(c[2], ti.f32),
                ti.cast(self.inverse_mass[b], ti.f32),
                # the trace bounds the inverse inertia about every axis
                ti.cast(j[0, 0] + j[1, 1] + j[2, 2], ti.f32),
            ]
        )
        for k in ti.static(range(3)):
            self.twist[b][k] = ti.cast(self.velocity[b][k], ti.f32)
            self.twist[b][k + 3] = ti.cast(self.spin[b][k], ti.f32)

    @ti.func
    def put(self, s):
        """Set the position of one sample from the pose of its body."""
        b = self.s.body[s]
        x = self.s.point[s]
        if b > 0:
            x = ti.cast(self.centre[b] + self.rotation[b] @ ti.cast(x, ti.f64), ti.f32)
        self.s.world[s] = x

    @ti.func
    def gather(self):
        """Sum the forces on samples. Data out: impulses, poses and twists of bodies, samples."""
        for k in range(self.most):
            if k < self.groups[None]:
                body, first, last = self.group[k][0], self.group[k][1], self.group[k][2]
                centre = self.centre[body]
                force = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
                moment = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
                for s in range(first, last):
                    f = ti.cast(self.s.push[s], ti.f64)
                    force += f
                    moment += (ti.cast(self.s.world[s], ti.f64) - centre).cross(f)
                self.force_sum[k] = force
                self.moment_sum[k] = moment
        for b in range(1, self.bodies + 1):
            self.apply_impulse(b)
        if ti.static(not self.in_place):
            for s in range(self.s.capacity):
                if s < self.g.moving[None]:
                    self.put(s)
                    x = self.s.world[s]
                    t = self.s.rank[s]
                    self.s.place[t] = ti.Vector([x[0], x[1], x[2], self.s.place[t][3]])

    @ti.func
    def sum_counts(self):
        """Sum what samples count, two numbers each, in their groups. Data in: samples."""
        for k in range(self.most):
            if k < self.groups[None]:
                total = ti.Vector([0.0, 0.0])
                for s in range(self.group[k][1], self.group[k][2]):
                    total += self.s.count[s]
                self.count_sum[k] = total

    @ti.func
    def counted(self, b) -> Any:
        """Return the sum of what the samples of a body count, see `sum_counts`."""
        total = ti.Vector([0.0, 0.0])
        for k in range(self.first[b][0], self.first[b][1]):
            total += self.count_sum[k]
        return total

    @ti.func
    def apply_impulse(self, b):
        """Apply the impulses of one iteration to one body."""
        force = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
        moment = ti.Vector([0.0, 0.0, 0.0], dt=ti.f64)
        for k in range(self.first[b][0], self.first[b][1]):
            force += self.force_sum[k]
            moment += self.moment_sum[k]
        h = ti.cast(self.g.step[None], ti.f64)
        force *= self.mass
        moment *= self.mass
        self.impulse[b] += force / h
        self.moment[b] += moment / h
        # pushes are displacements of particles: times the mass they are impulse times step
        shift = self.inverse_mass[b] * force
        angle = self.inverse_inertia[b] @ moment
        self.velocity[b] += shift / h
        self.spin[b] += angle / h
        if ti.static(not self.in_place):
            self.centre[b] += shift
            self.turn(b, angle)
        self.publish(b)


@ti.data_oriented
class BodyNeighbourCount:
    """Body neighbour count: particles in contact with each body, as a sum of gradients.

    Args:
        bodies: data out: their neighbour counts.
        particles: data in: sorted places.
        smoothing: the kernel.
        grid: cells of the particles.
    """

    def __init__(self, bodies: Bodies, particles: Particles, smoothing: Smoothing, grid: Grid):
        self.b, self.s, self.p, self.g = bodies, bodies.s, particles, bodies.g
        self.kernel, self.near = smoothing, Near(particles, bodies.s, grid, None)

    @ti.func
    def count(self):
        """Count the particles near each body. Data in: positions in buffer 1, samples.

        Data out: counts; what presses on samples starts anew.
        """
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                self.s.pressed[s] = ti.Vector([0.0, 0.0, 0.0])
                o = self.s.place[self.s.rank[s]]
                x = ti.Vector([o[0], o[1], o[2]])
                force = ti.Vector([0.0, 0.0, 0.0])
                total = 0.0
                if self.near.grid.inside(x):
                    for c in range(self.near.columns):
                        first, last = self.near.around(s, x, c)
                        for k in range(first, last):
                            f = self.density_gradient(self.near.found(s, k), x) * o[3]
                            force += f
                            total += f.norm()
                arm = x - self.b.local_centre(self.s.body[s])
                self.s.count[s] = ti.Vector([total, arm.cross(force).norm()])
        self.b.sum_counts()
        for b in range(1, self.b.bodies + 1):
            self.b.neighbour_count[b] = self.b.counted(b)

    @ti.func
    def density_gradient(self, j, x) -> Any:
        """Gradient of one particle's density at a sample."""
        at = self.p.place[1].get(j)
        e = ti.Vector([at[0] - x[0], at[1] - x[1], at[2] - x[2]])
        _, g = self.kernel.solid(e.norm_sqr())
        return g * e
