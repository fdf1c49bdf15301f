"""Device fields of the solver, without the kernels that act on them."""

from __future__ import annotations

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.vectors import Vectors
from seals.plugins.fluids.solvers.pbf.language import ti

# particles that one thread sums
CHUNK = 64
# threads that run side by side on a CUDA device: their lists lie beside each other
WARP = 32
# neighbours that a processor core sums side by side: lists are filled up to a multiple of it
LANES = 8
# entries of Globals.trouble
NOT_FINITE, ESCAPED, CROWDED, LONGEST = 0, 1, 2, 3


class Fields:
    """Group of device fields, allocated and freed together."""

    def __init__(self) -> None:
        self.builder = ti.FieldsBuilder()
        self.tree: Any = None

    def scalar(self, kind: Any, *shape: int, turned: bool = False) -> Any:
        """Return a scalar field; ``turned`` stores its second axis outermost."""
        field = ti.field(kind)
        self._place(field, shape, turned)
        return field

    def vector(self, width: int, kind: Any, *shape: int) -> Any:
        """Return a field of vectors."""
        field = ti.Vector.field(width, kind)
        self._place(field, shape, False)
        return field

    def matrix(self, kind: Any, *shape: int) -> Any:
        """Return a field of 3x3 matrices."""
        field = ti.Matrix.field(3, 3, kind)
        self._place(field, shape, False)
        return field

    def _place(self, field: Any, shape: tuple[int, ...], turned: bool) -> None:
        axes = (ti.i, ti.j)
        node = self.builder
        if turned and WARP:
            groups = (max(shape[0], 1) + WARP - 1) // WARP
            node.dense(ti.i, groups).dense(ti.j, max(shape[1], 1)).dense(ti.i, WARP).place(field)
            return
        for axis in range(len(shape))[:: -1 if turned else 1]:
            node = node.dense(axes[axis], max(shape[axis], 1))
        node.place(field)

    def allocate(self) -> None:
        """Reserve the memory."""
        self.tree = self.builder.finalize()

    def free(self) -> None:
        """Give the memory back."""
        if self.tree is not None:
            self.tree.destroy()
            self.tree = None


class Particles:
    """Fields of the particles, double-buffered: a kernel only reads what it gathers.

    Substeps begin and end in buffer 0; sorting writes buffer 1, multipliers go from there to 0 and
    displacements back. Positions are relative to the domain's lower corner; their fourth component
    is the last change of the multiplier between sweeps, and the multiplier between substeps.
    """

    def __init__(
        self,
        fields: Fields,
        count: int,
        neighbours: int,
        turned: bool,
        *,
        isotropic: bool = False,
        damped: bool = False,
        rubbed: bool = False,
    ) -> None:
        self.capacity = count
        self.isotropic = isotropic
        # isotropic stress correction, see ``device.isotropy``
        self.correction = Vectors(fields, 6, count if isotropic else 1)
        self.third = fields.scalar(ti.f32, count if isotropic else 1)
        self.place = [Vectors(fields, 4, count) for _ in range(2)]
        self.velocity = [Vectors(fields, 3, count) for _ in range(2)]
        self.number = [fields.scalar(ti.i32, count) for _ in range(2)]
        self.multiplier = fields.scalar(ti.f32, count)
        self.density = fields.scalar(ti.f32, count)
        self.wall = fields.vector(3, ti.f32, count)
        # discrete Laplacian of the velocity, see ``device.finish``
        self.laplacian = Vectors(fields, 3, count if damped else 1)
        # displacement by the friction of bodies over the weight of their samples
        self.rubbed = fields.vector(3, ti.f32, count if rubbed else 1)
        self.cell = fields.scalar(ti.i32, count)
        self.slot = fields.scalar(ti.i32, count)
        self.order = fields.scalar(ti.i32, count)
        self.near = fields.scalar(ti.i32, count)
        self.beside = fields.scalar(ti.i32, count)
        # length of a list up to its boundary samples: neighbours, and the particle itself as often
        # as fills them up to whole lanes
        self.filled = fields.scalar(ti.i32, count)
        self.lanes = 1 if turned else LANES
        listed = neighbours > 0
        self.longest = neighbours
        # whether sweeps load an entry of a list while they sum the one before
        self.ahead = turned
        width = neighbours + self.lanes + 1
        self.list = fields.scalar(ti.i32, count if listed else 1, width, turned=turned)


class Samples:
    """Boundary samples: as given, and sorted by cell."""

    def __init__(self, fields: Fields, count: int, neighbours: int, turned: bool) -> None:
        self.capacity = count
        self.point = fields.vector(3, ti.f32, count)
        self.weight = fields.scalar(ti.f32, count)
        # of the sheet of samples around it, in body axes; zero for what has none
        self.normal = fields.vector(3, ti.f32, count)
        # share of the weight that is by volume
        self.thin = fields.scalar(ti.f32, count)
        self.body = fields.scalar(ti.i32, count)
        self.world = fields.vector(3, ti.f32, count)
        self.cell = fields.scalar(ti.i32, count)
        self.slot = fields.scalar(ti.i32, count)
        self.order = fields.scalar(ti.i32, count)
        self.rank = fields.scalar(ti.i32, count)
        self.place = fields.vector(4, ti.f32, count)
        self.owner = fields.scalar(ti.i32, count)
        self.push = fields.vector(3, ti.f32, count)
        # sum of the pushes by pressure in a substep
        self.pressed = fields.vector(3, ti.f32, count)
        self.count = fields.vector(2, ti.f32, count)
        self.longest = neighbours
        self.near = fields.scalar(ti.i32, count)
        self.list = fields.scalar(
            ti.i32, count if neighbours else 1, max(neighbours, 1), turned=turned
        )


class Globals:
    """Global constants read by kernels, and their error counters and partial sums."""

    def __init__(self, fields: Fields, particles: int) -> None:
        self.count = fields.scalar(ti.i32)
        self.samples = fields.scalar(ti.i32)
        self.moving = fields.scalar(ti.i32)
        self.step = fields.scalar(ti.f32)
        self.compliance = fields.scalar(ti.f32)
        # compression at rest by depth that is made up for, and the level above the origin
        self.strain = fields.scalar(ti.f32)
        self.level = fields.scalar(ti.f32)
        self.warm = fields.scalar(ti.f32)
        self.blend = fields.scalar(ti.f32)
        self.damping = fields.scalar(ti.f32)
        self.gravity = fields.scalar(ti.f32)
        # least multiplier of water in tension, see ``device.pressure``
        self.tension = fields.scalar(ti.f32)
        # gain and memory of each iteration, where the solver has a fixed number
        self.weights: Any = None
        self.trouble = fields.scalar(ti.i32, 8)
        self.chunks = (particles + CHUNK - 1) // CHUNK
        # velocity (3), its square, compression, its largest, residual
        self.partial = fields.scalar(ti.f64, self.chunks, 7)
        self.walls = fields.vector(3, ti.f64, self.chunks)
