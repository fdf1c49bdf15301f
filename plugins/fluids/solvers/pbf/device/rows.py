"""Copies between host and device: particles keep their rows on one, and are sorted on the other."""

from seals.plugins.fluids.solvers.pbf.fields import Globals, Particles
from seals.plugins.fluids.solvers.pbf.language import ti


@ti.data_oriented
class Rows:
    """Reads and writes particles of buffer 0 by row, each in one pass.

    Args:
        particles: data in and out: places, velocities and numbers of buffer 0.
        numbers: counts.
    """

    def __init__(self, particles: Particles, numbers: Globals) -> None:
        self.p, self.g = particles, numbers

    @ti.kernel
    def write(self, values: ti.template(), out: ti.types.ndarray(dtype=ti.f32, ndim=2)):
        """Write the first three numbers of each particle in a field, by its row."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                row, value = self.p.number[0][i], values[i]
                for k in ti.static(range(3)):
                    out[row, k] = value[k]

    @ti.kernel
    def move(self, given: ti.types.ndarray(dtype=ti.f32, ndim=2)):
        """Overwrite the places; multipliers stay."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                row, held = self.p.number[0][i], self.p.place[0].get(i)[3]
                self.p.place[0].set(
                    i, ti.Vector([given[row, 0], given[row, 1], given[row, 2], held])
                )

    @ti.kernel
    def drive(self, given: ti.types.ndarray(dtype=ti.f32, ndim=2)):
        """Overwrite the velocities."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                row = self.p.number[0][i]
                self.p.velocity[0].set(i, ti.Vector([given[row, 0], given[row, 1], given[row, 2]]))

    @ti.kernel
    def append(self, given: ti.types.ndarray(dtype=ti.f32, ndim=2)):
        """Add particles behind the others: place and velocity, six numbers each."""
        for k in range(given.shape[0]):
            i = self.g.count[None] + k
            self.p.place[0].set(i, ti.Vector([given[k, 0], given[k, 1], given[k, 2], 0.0]))
            self.p.velocity[0].set(i, ti.Vector([given[k, 3], given[k, 4], given[k, 5]]))
            self.p.number[0][i] = i
