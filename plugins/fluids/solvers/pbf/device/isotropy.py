"""Isotropic stress correction, which removes the shear stress of disordered particles."""

from typing import Any

from seals.plugins.fluids.solvers.pbf.device.grid import Grid, Near
from seals.plugins.fluids.solvers.pbf.device.kernels import Smoothing
from seals.plugins.fluids.solvers.pbf.fields import Globals, Particles, Samples
from seals.plugins.fluids.solvers.pbf.language import ti

# of the uneven part against the even one: at a surface half of the neighbours are missing
LIMIT = 0.5


@ti.data_oriented
class Isotropy:
    """Correction tensor that makes the stress of every particle isotropic.

    Equation:
        M_i = -sum_j e_ij (grad W_ij)^T - 1/2 sum_b e_ib (grad W_ib)^T,
        L_i = (1 + share D_i)^-1, D_i = 3 M_i / tr M_i - 1,
        displacement of i = -sum_j (lambda_i L_i + lambda_j L_j) grad W_ij.

    The multiplier of a particle presses on its neighbours with the stress lambda_i M_i. Among few
    neighbours M is not the same in all directions: settled particles hold shear like grains, up to
    about one per cent of the pressure, which stops waves and carries balls. With L_i the stress is
    lambda_i tr M_i / 3 times one, wherever the neighbours are. Its trace, the pressure, is kept.

    Args:
        particles: data in: places of buffer 1 and lists; data out: ``even``.
        samples: data in: sorted samples.
        grid: cells of the particles.
        bounds: cells of the samples.
        numbers: counts.
        smoothing: the kernel.
        share: of the uneven part that is undone [1].
        scale: weight of boundary volumes.

    Limitations:
        Evened forces have no potential: they stir water at rest a little, which the viscosity has
        to calm. With a share of one it needs more viscosity than waves should feel.

    References:
        Bonet and Lok 1999, doi 10.1016/S0045-7825(99)00051-1, for the corrected gradient.
    """

    def __init__(
        self,
        particles: Particles,
        samples: Samples,
        grid: Grid,
        bounds: Grid,
        numbers: Globals,
        smoothing: Smoothing,
        *,
        share: float,
        scale: float,
    ) -> None:
        self.p, self.s, self.g = particles, samples, numbers
        self.near = Near(particles, samples, grid, bounds)
        self.kernel, self.share, self.scale = smoothing, share, scale
        self.listed = particles.longest > 0
        self.support2 = grid.support**2
        along = smoothing.lattice.along
        self.across, self.along = 1 / (1 - along), along / (1 + 2 * along)

    @ti.func
    def find(self):
        """Compute the correction tensors minus I, and tr M / 3. Data in: positions of buffer 1."""
        for i in range(self.p.capacity):
            if i < self.g.count[None]:
                self.around(i, self.p.place[1].get(i).xyz)

    @ti.func
    def note(self, i, a, b, c, d):
        """Write the correction of a particle from the moments of water and of boundary samples."""
        # a single sheet of samples stands for half a space of water: its moments along and across
        # it are brought into the ratio of the water's
        a += self.across * (c - self.along * (c[0] + c[1] + c[2]))
        b += self.across * d
        third = (a[0] + a[1] + a[2]) / 3
        # M = third (I + uneven); K = (I + part uneven)^-1, with the part limited so that it stays
        # positive definite
        a, b = a / (third + 1e-9) - 1.0, b / (third + 1e-9)
        size = ti.sqrt(a.norm_sqr() + 2 * b.norm_sqr())
        part = self.share * ti.min(1.0, LIMIT / (size + 1e-9))
        self.p.third[i] = third
        self.p.correction.set(i, inverse(1.0 + part * a, part * b))

    @ti.func
    def around(self, i, q):
        """Sum the second moments around a particle: diagonal, and (yz, xz, xy)."""
        a, b = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        for column in range(self.near.columns):
            first, last = self.near.water(i, q, column)
            for k in range(first, last):
                j = self.near.member(i, k)
                e = q - self.p.place[1].get(j).xyz
                if ti.static(self.listed) or (j != i and e.norm_sqr() < self.support2):
                    a, b = moment(a, b, e, -self.kernel.gradient(e.norm_sqr()))
        c, d = self.beside(i, q)
        self.note(i, a, b, c, d)

    @ti.func
    def beside(self, i, q) -> Any:
        """Sum the moments of the boundary samples around a particle, with half weight."""
        c, d = ti.Vector([0.0, 0.0, 0.0]), ti.Vector([0.0, 0.0, 0.0])
        if self.p.beside[i] > 0:
            for column in range(self.near.columns):
                first, last = self.near.walls(i, q, column)
                for k in range(first, last):
                    o = self.s.place[self.near.member(i, k)]
                    _, g = self.kernel.solid((q - o.xyz).norm_sqr())
                    c, d = moment(c, d, q - o.xyz, -0.5 * self.scale * o[3] * g)
        return c, d


@ti.func
def moment(a, b, e, weight) -> Any:
    """Add a weighted e e^T to a symmetric matrix."""
    c = ti.Vector([e[1] * e[2], e[0] * e[2], e[0] * e[1]])
    return a + weight * e * e, b + weight * c


@ti.func
def inverse(a, b) -> Any:
    """Return A^-1 - I of a symmetric matrix A, six numbers: diagonal, and (yz, xz, xy)."""
    # cofactors of the symmetric matrix over its determinant
    xx, yy, zz = a[1] * a[2] - b[0] * b[0], a[0] * a[2] - b[1] * b[1], a[0] * a[1] - b[2] * b[2]
    yz, xz, xy = b[1] * b[2] - a[0] * b[0], b[0] * b[2] - a[1] * b[1], b[0] * b[1] - a[2] * b[2]
    det = a[0] * xx + b[2] * xy + b[1] * xz
    return ti.Vector([xx, yy, zz, yz, xz, xy]) / det - ti.Vector([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


@ti.func
def turned(m, v) -> Any:
    """Return (I + M) v of a symmetric matrix M, given as six numbers, and a vector."""
    return ti.Vector(
        [
            v[0] + m[0] * v[0] + m[5] * v[1] + m[4] * v[2],
            v[1] + m[5] * v[0] + m[1] * v[1] + m[3] * v[2],
            v[2] + m[4] * v[0] + m[3] * v[1] + m[2] * v[2],
        ]
    )
