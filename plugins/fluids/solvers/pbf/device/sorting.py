"""Start of a substep: prediction of positions, sort by cell, neighbour lists."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.grid import Grid
from seals.plugins.fluids.solvers.pbf.fields import (
    CROWDED,
    ESCAPED,
    LONGEST,
    NOT_FINITE,
    Globals,
    Particles,
    Samples,
)
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class Sorting:
    """Kernels of prediction, sort and neighbour search.

    Args:
        particles: model: capacity; data in: buffer 0; data out: buffer 1 and the lists.
        samples: data in: places of boundary samples; data out: the same sorted.
        grid: cells of the particles.
        bounds: cells of the samples.
        numbers: step, gravity, counts.
        deterministic: whether cells keep the order of numbers.
        accelerated: whether kernels run on a CUDA device.
        predicting: whether gravity and motion over the substep come before the sort.
    """

    def __init__(
        self,
        particles: Particles,
        samples: Samples,
        grid: Grid,
        bounds: Grid,
        numbers: Globals,
        deterministic: bool,
        accelerated: bool,
        *,
        predicting: bool = True,
    ) -> None:
        self.p, self.s, self.grid, self.bounds, self.g = particles, samples, grid, bounds, numbers
        self.deterministic, self.accelerated = deterministic, accelerated
        self.predicting = predicting
        self.listed = particles.longest > 0
        self.support2 = grid.support**2

    @ti.func
    def begin(self):
        """Predict positions if so, and sort them by cell. Data in: buffer 0. Data out: buffer 1."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                old = self.p.place[0].get(i)
                q = ti.Vector([old[0], old[1], old[2]])
                if ti.static(self.predicting):
                    h = self.g.step[None]
                    v = self.p.velocity[0].get(i)
                    # symplectic Euler: the velocity first, then the place with it
                    v[2] -= h * self.g.gravity[None]
                    self.p.velocity[0].set(i, v)
                    q = ti.Vector([old[0] + h * v[0], old[1] + h * v[1], old[2] + h * v[2]])
                    if not self.grid.inside(q):
                        self.report(q)
                    self.p.place[0].set(i, ti.Vector([q[0], q[1], q[2], old[3]]))
                c = self.grid.cell_of(q)
                self.p.cell[i] = c
                self.p.slot[i] = ti.atomic_add(self.grid.count[c], 1)
        self.grid.scan()
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.p.order[self.grid.start[self.p.cell[i]] + self.p.slot[i]] = i
        if ti.static(self.deterministic):
            self.grid.settle(self.p.order, self.p.number[0])
        for j in range(self.p.capacity):
            if j < self.g.count[None]:
                i = self.p.order[j]
                q = self.p.place[0].get(i)
                # multipliers of the last substep travel with their particles, in q[3]
                warm = self.g.warm[None] * q[3]
                self.p.multiplier[j] = warm
                self.p.place[1].set(j, ti.Vector([q[0], q[1], q[2], warm]))
                self.p.velocity[1].set(j, self.p.velocity[0].get(i))
                self.p.number[1][j] = self.p.number[0][i]
                self.p.wall[j] = ti.Vector([0.0, 0.0, 0.0])

    @ti.func
    def report(self, q):
        """Count a particle whose position is not finite or outside the domain."""
        bad = 0
        for k in ti.static(range(3)):
            # fast arithmetic may assume that numbers are finite: a range is tested instead
            if not (ti.abs(q[k]) < 1e6):
                bad = 1
        ti.atomic_add(self.g.trouble[NOT_FINITE], bad)
        ti.atomic_add(self.g.trouble[ESCAPED], 1 - bad)

    @ti.func
    def bin_samples(self):
        """Sort the boundary samples by cell. Data in: samples in the world."""
        for s in range(self.s.capacity):
            if s < self.g.samples[None]:
                q = self.s.world[s]
                c = self.bounds.nowhere
                if self.bounds.inside(q):
                    c = self.bounds.cell_of(q)
                self.s.cell[s] = c
                self.s.slot[s] = ti.atomic_add(self.bounds.count[c], 1)
        self.bounds.scan()
        for c in range(self.bounds.cells):
            self.bounds.mark[c] = 0
        for s in range(self.s.capacity):
            if s < self.g.samples[None] and self.s.cell[s] != self.bounds.nowhere:
                self.bounds.mark_around(self.s.world[s])
        for s in range(self.s.capacity):
            if s < self.g.samples[None]:
                self.s.order[self.bounds.start[self.s.cell[s]] + self.s.slot[s]] = s
                self.s.rank[s] = s
        if ti.static(self.deterministic):
            self.bounds.settle(self.s.order, self.s.rank)
        for t in range(self.s.capacity):
            if t < self.g.samples[None]:
                s = self.s.order[t]
                q = self.s.world[s]
                self.s.place[t] = ti.Vector([q[0], q[1], q[2], self.s.weight[s]])
                self.s.owner[t] = self.s.body[s]
        for t in range(self.s.capacity):
            if t < self.g.samples[None]:
                self.s.rank[self.s.order[t]] = t

    @ti.func
    def survey(self):
        """Find neighbours, or whether a boundary is near. Data in: sorted positions."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                if ti.static(self.listed):
                    self.write_list(i)
                else:
                    self.look_around(i)

    @ti.func
    def write_list(self, i):
        """Store the neighbours of one particle, boundary samples behind particles."""
        q = self.p.place[1].get(i).xyz
        n = 0
        for ox in range(-1, 2):
            for oy in range(-1, 2):
                first, last = self.grid.run(self.grid.start, q, ox, oy, self.grid.support)
                for j in range(first, last):
                    e = q - self.p.place[1].get(j).xyz
                    n = self.note(i, n, j, e.norm_sqr() < self.support2 and j != i)
        # the list is filled up to whole lanes with the particle itself, see `Pressure.own`
        near = ti.min(n, self.p.longest)
        filled = (near + self.p.lanes - 1) // self.p.lanes * self.p.lanes
        for k in ti.static(range(self.p.lanes - 1)):
            self.p.list[i, near + k] = i
        m = filled
        if self.bounds.mark[self.bounds.cell_of(q)] > 0:
            for ox in range(-1, 2):
                for oy in range(-1, 2):
                    first, last = self.bounds.run(self.bounds.start, q, ox, oy, self.grid.support)
                    for t in range(first, last):
                        e = q - self.s.place[t].xyz
                        m = self.note(i, m, t, e.norm_sqr() < self.support2)
        n += m - filled
        self.p.near[i] = near
        self.p.filled[i] = filled
        self.p.beside[i] = ti.min(n, self.p.longest) - near
        if n > self.p.longest:
            ti.atomic_add(self.g.trouble[CROWDED], 1)
            ti.atomic_max(self.g.trouble[LONGEST], n)

    @ti.func
    def note(self, i, n, j, close) -> Any:
        """Write a candidate into the list; return the length after it."""
        if ti.static(self.accelerated):
            if close:
                if n < self.p.longest:
                    self.p.list[i, n] = j
                n += 1
        else:
            # always written, counted only if close: no branch to mispredict
            self.p.list[i, ti.min(n, self.p.longest + self.p.lanes)] = j
            n += ti.cast(close, ti.i32)
        return n

    @ti.func
    def look_around(self, i):
        """Mark whether boundary samples are in reach of one particle."""
        self.p.beside[i] = self.bounds.mark[self.bounds.cell_of(self.p.place[1].get(i).xyz)]

    @ti.func
    def survey_samples(self):
        """Find the particles around each moving sample. Data in: sorted positions."""
        for s in range(self.s.capacity):
            if s < self.g.moving[None]:
                x = self.s.place[self.s.rank[s]].xyz
                n = 0
                if self.bounds.inside(x):
                    for ox in range(-1, 2):
                        for oy in range(-1, 2):
                            first, last = self.grid.run(
                                self.grid.start, x, ox, oy, self.grid.support
                            )
                            for j in range(first, last):
                                e = self.p.place[1].get(j).xyz - x
                                if e.norm_sqr() < self.support2:
                                    if n < self.s.longest:
                                        self.s.list[s, n] = j
                                    n += 1
                self.s.near[s] = ti.min(n, self.s.longest)
                if n > self.s.longest:
                    ti.atomic_add(self.g.trouble[CROWDED], 1)
                    ti.atomic_max(self.g.trouble[LONGEST], n)
