"""Cell grid: counting sort of points by cell, and neighbour candidates of a point.

Cells are a fraction of the kernel's support, along z smaller than along x and y; neighbouring cells
along z are neighbours in memory. Around a point columns are searched, each only over the heights
that a sphere of the support reaches there: of nine columns 115 candidates at a fraction of 1/4, not
the 216 of 27 cubes.
"""

from typing import Any

from seals.plugins.fluids.solvers.pbf.fields import Fields, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti

RUN = 64
COLUMNS = 9
# a walk during the sweeps meets points that moved since they were sorted
SLACK = 1.05


@ti.data_oriented
class Grid:
    """Cells over a domain that starts at the origin.

    Args:
        fields: where the counters live.
        size: extent of the domain [m], shape (3,).
        support: reach of the kernel [m].
        fine: cells per support along z.
        marked: whether cells in reach of a point can be marked.
    """

    def __init__(
        self,
        fields: Fields,
        size: Any,
        support: float,
        *,
        fine: int,
        marked: bool = False,
    ) -> None:
        self.support, self.fine, self.pad = support, fine, fine + 1
        self.size = [float(s) for s in size]
        self.nx, self.ny = (int(s / support) + 3 for s in self.size[:2])
        self.nz = int(self.size[2] * fine / support) + 1 + 2 * self.pad
        self.nowhere = self.nx * self.ny * self.nz
        cells = self.nowhere + 1
        self.cells = cells
        self.runs = (cells + RUN - 1) // RUN
        self.wide = int(self.runs**0.5) + 1
        self.groups = (self.runs + self.wide - 1) // self.wide
        self.count = fields.scalar(ti.i32, cells)
        self.start = fields.scalar(ti.i32, cells + 1)
        self.mark = fields.scalar(ti.i32, cells if marked else 1)
        self.run_sum = fields.scalar(ti.i32, self.runs)
        self.group_sum = fields.scalar(ti.i32, self.groups)

    @ti.func
    def column(self, p) -> Any:
        """Column of a point; points outside fall into the columns at the edge."""
        # one column of padding on either side: a walk around the edge needs no test
        cx = ti.cast(ti.floor(p[0] / self.support), ti.i32) + 1
        cy = ti.cast(ti.floor(p[1] / self.support), ti.i32) + 1
        return ti.min(ti.max(cx, 1), self.nx - 2), ti.min(ti.max(cy, 1), self.ny - 2)

    @ti.func
    def level(self, z) -> Any:
        """Cell along z of a height."""
        c = ti.cast(ti.floor(z * (self.fine / self.support)), ti.i32) + self.pad
        return ti.min(ti.max(c, 0), self.nz - 1)

    @ti.func
    def inside(self, p) -> Any:
        """1 if a point lies in the domain, else 0; also 0 if it is not a number."""
        yes = 1
        for k in ti.static(range(3)):
            if not (p[k] >= 0.0 and p[k] <= self.size[k]):
                yes = 0
        return yes

    @ti.func
    def cell_of(self, p) -> Any:
        """Index of the cell of a point."""
        cx, cy = self.column(p)
        return (cx * self.ny + cy) * self.nz + self.level(p[2])

    @ti.func
    def run(self, start: ti.template(), p, ox, oy, reach) -> Any:
        """Index range of the candidates in one of the columns around a point."""
        cx, cy = self.column(p)
        # half height of the sphere of reach above the nearest point of the column
        dx, dy = self.aside(cx, ox, p[0]), self.aside(cy, oy, p[1])
        rest = reach * reach - dx * dx - dy * dy
        first, last = 0, 0
        if rest > 0.0:
            dz = ti.sqrt(rest)
            base = ((cx + ox) * self.ny + cy + oy) * self.nz
            first = start[base + self.level(p[2] - dz)]
            last = start[base + self.level(p[2] + dz) + 1]
        return first, last

    @ti.func
    def aside(self, c, o, x) -> Any:
        """Distance along an axis to the nearest side of a column, zero for the point's own."""
        low = (c - 1 + o) * self.support - x
        return ti.max(low, -low - self.support, 0.0) if o != 0 else 0.0

    @ti.func
    def mark_around(self, p) -> None:
        """Mark all cells that a point within reach may lie in."""
        cx, cy = self.column(p)
        for ox in range(-1, 2):
            for oy in range(-1, 2):
                base = ((cx + ox) * self.ny + cy + oy) * self.nz
                # with slack: points move between the sort and the last sweep
                low = self.level(p[2] - SLACK * self.support)
                for z in range(low, self.level(p[2] + SLACK * self.support) + 1):
                    self.mark[base + z] = 1

    @ti.func
    def scan(self) -> None:
        """Prefix sum of the cell counts; clears the counts."""
        for r in range(self.runs):
            total = 0
            for c in range(r * RUN, ti.min((r + 1) * RUN, self.cells)):
                total += self.count[c]
            self.run_sum[r] = total
        for g in range(self.groups):
            total = 0
            for r in range(g * self.wide, ti.min((g + 1) * self.wide, self.runs)):
                total += self.run_sum[r]
            self.group_sum[g] = total
        for g in range(self.groups):
            total = 0
            for k in range(g):
                total += self.group_sum[k]
            for r in range(g * self.wide, ti.min((g + 1) * self.wide, self.runs)):
                part = self.run_sum[r]
                self.run_sum[r] = total
                total += part
        for r in range(self.runs):
            total = self.run_sum[r]
            for c in range(r * RUN, ti.min((r + 1) * RUN, self.cells)):
                part = self.count[c]
                self.count[c] = 0
                self.start[c] = total
                total += part
            if r == self.runs - 1:
                self.start[self.cells] = total

    @ti.func
    def settle(self, order: ti.template(), number: ti.template()) -> None:
        """Sort the members of each cell by number, which makes sums deterministic."""
        for c in range(self.cells):
            first, last = self.start[c], self.start[c + 1]
            for a in range(first + 1, last):
                # insertion sort: a cell has few members
                held = order[a]
                b = a - 1
                while b >= first and number[order[b]] > number[held]:
                    order[b + 1] = order[b]
                    b -= 1
                order[b + 1] = held


@ti.data_oriented
class PairSums:
    """Base of laws that sum over the neighbours of a particle.

    A law has ``p`` (particles), ``near`` (its neighbours), and ``pair(i, j, q, second)``: the
    contribution of neighbour j to the first or the second sum of particle i at q, three numbers.
    """

    p: Particles
    near: Any
    pair: Any

    @ti.func
    def gather(self, i, second: ti.template()) -> Any:
        """Sum over the neighbours of one particle."""
        q = self.p.place[1].get(i).xyz
        s = ti.Vector([0.0, 0.0, 0.0])
        for c in range(self.near.columns):
            first, last = self.near.water(i, q, c)
            for k in range(first, last):
                j = self.near.member(i, k)
                # the particle itself is in its cell, and fills up its list
                if j != i:
                    s += self.pair(i, j, q, second)
        return s


@ti.data_oriented
class Near:
    """Particles and boundary samples around a point, from stored lists or from the cells.

    One loop serves both: ``for c in range(near.columns)`` runs once over a list, or over the nine
    columns of cells around the point; inside of it ``for k in range(first, last)`` with the range
    of `water`, `walls` or `around`, and ``near.member(i, k)`` or ``near.found(s, k)`` is who it is.
    Cells also give the point's own particle and what cannot be commanded.

    Args:
        particles: their lists.
        samples: lists of moving samples; None for water alone.
        grid: cells of the particles.
        bounds: cells of the samples; None where no walls are looked for.
    """

    def __init__(
        self, particles: Particles, samples: Samples | None, grid: Grid, bounds: Grid | None
    ) -> None:
        self.p, self.grid = particles, grid
        self.s: Any = samples
        self.bounds: Any = bounds
        self.listed = particles.longest > 0
        self.columns = 1 if self.listed else COLUMNS
        self.reach = SLACK * grid.support

    @ti.func
    def water(self, i, q, c) -> Any:
        """Range of the particles around particle ``i`` at ``q``."""
        first, last = 0, 0
        if ti.static(self.listed):
            last = self.p.filled[i]
        else:
            first, last = self.grid.run(self.grid.start, q, c // 3 - 1, c % 3 - 1, self.reach)
        return first, last

    @ti.func
    def walls(self, i, q, c) -> Any:
        """Range of the boundary samples around particle ``i`` at ``q``."""
        first, last = 0, 0
        if ti.static(self.listed):
            first = self.p.filled[i]
            last = first + self.p.beside[i]
        else:
            first, last = self.bounds.run(self.bounds.start, q, c // 3 - 1, c % 3 - 1, self.reach)
        return first, last

    @ti.func
    def member(self, i, k) -> Any:
        """Number of a particle or a sample at a place of such a range."""
        return self.p.list[i, k] if ti.static(self.listed) else k

    @ti.func
    def around(self, s, x, c) -> Any:
        """Range of the particles around the moving sample ``s`` at ``x``."""
        first, last = 0, 0
        if ti.static(self.listed):
            last = self.s.near[s]
        else:
            first, last = self.grid.run(self.grid.start, x, c // 3 - 1, c % 3 - 1, self.reach)
        return first, last

    @ti.func
    def found(self, s, k) -> Any:
        """Number of a particle at a place of the range around a sample."""
        return self.s.list[s, k] if ti.static(self.listed) else k
