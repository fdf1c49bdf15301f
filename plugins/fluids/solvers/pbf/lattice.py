"""Calibration of the smoothing kernels on the cubic lattice of water at rest.

Lengths are in spacings here. ``w`` is the share of the rest density that a neighbour adds, so that
the sum over the cubic lattice is one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solvers.device_settings import Kernel

Array = NDArray[np.float64]


def _wendland(q: Array) -> tuple[Array, Array]:
    """Wendland C2 of support two, not normalised: value, and radial derivative over distance."""
    u = np.maximum(1 - 0.5 * q, 0)
    return u**4 * (2 * q + 1), -5 * u**3


def _spline(q: Array) -> tuple[Array, Array]:
    """Cubic spline of support two, not normalised: value, and radial derivative over distance."""
    u, t = np.maximum(2 - q, 0), np.maximum(1 - q, 0)
    safe = np.maximum(q, 1e-9)
    return 0.25 * u**3 - t**3, (-0.75 * u**2 + 3 * t**2) / safe


# Water at rest is disordered: pressure over the lattice's estimate, from a hydrostatic column
SETTLED = {Kernel.spline: 0.974, Kernel.wendland: 1.0}
SHAPES: dict[Kernel, Callable[[Array], tuple[Array, Array]]] = {
    Kernel.wendland: _wendland,
    Kernel.spline: _spline,
}


class Calibration(NamedTuple):
    """Constants of a kernel on the cubic lattice.

    Args:
        support: reach of the kernel.
        factor: factor of the kernel's shape, so that the lattice sum is one.
        own: share of the density that a particle adds to itself.
        sheet: sum over a flat square sheet, seen from one of its points: a boundary sample in such
            a sheet has the weight one, and completes the lattice.
        spread: mean squared distance, in the sheet, of what a point of it sees.
        stiffness: sum of squared gradients, times the spacing squared: the diagonal of the
            density constraints.
        top: largest eigenvalue of the constraints over ``stiffness``.
        virial: pressure over (multiplier / volume) in settled water; near one.
        behind: density that a wall adds to the layer of water on it.
        press: gradient of the density that a wall adds to the layer of water on it [1/spacing].
        solid: factors of the boundary's kernel, see ``_solid_factors``.
        along: what a wall adds to the moments of the layer of water on it along the wall, over what
            it adds across.
    """

    support: float
    factor: float
    own: float
    sheet: float
    spread: float
    stiffness: float
    top: float
    virial: float
    behind: float
    press: float
    solid: tuple[float, float]
    along: float

    @classmethod
    def of(cls, kernel: Kernel, support: float = 2.0) -> Calibration:
        """Sum a kernel over the lattice.

        Args:
            kernel: which one.
            support: its reach [1 spacing].

        Example:
            >>> round(Calibration.of(Kernel.wendland).own, 3)
            0.404
        """
        shape, points = shape_of(kernel, support), lattice(support)
        r = np.linalg.norm(points, axis=1)
        own = float(shape(np.zeros(1))[0][0])
        value, slope = shape(r)
        # the lattice has the density one
        factor = 1 / (own + float(value.sum()))
        gradient = factor * slope[:, None] * points
        stiffness = float((gradient**2).sum())
        # eigenvalues of the constraints for plane waves along an axis, by wave number
        waves = np.linspace(0.0, np.pi, 200)
        response = np.abs((gradient[:, :1] * np.sin(points[:, :1] * waves)).sum(axis=0)) ** 2
        flat = points[:, 2] == 0
        layers = np.arange(1.0, support)
        solid = _solid_factors(shape, factor, support)
        a, b = solid
        turn = np.linspace(1.0, support, 4001)
        u = 1 - turn / support
        # rings: 2 pi r dr; slope over distance of u^7 (a + b u)
        weight = turn * (7 * a * u**6 + 8 * b * u**7) / turn
        return cls(
            support=support,
            factor=factor,
            own=own * factor,
            sheet=factor * (own + float(value[flat].sum())),
            spread=float((value * r**2)[flat].sum() / (own + value[flat].sum())),
            stiffness=stiffness,
            top=float(response.max()) / stiffness,
            virial=-SETTLED[kernel] * float((gradient * points).sum()) / 3,
            behind=factor * float(sum(sheet_mean(shape, float(k), support)[0] for k in layers)),
            press=-2 * factor * float(sum(sheet_mean(shape, float(k), support)[1] for k in layers)),
            solid=solid,
            along=float((weight * (turn**2 - 1) / 2).sum() / weight.sum()),
        )


def shape_of(kernel: Kernel, support: float) -> Callable[[Array], tuple[Array, Array]]:
    """Return a kernel stretched to a support: value, and radial derivative over distance.

    Example:
        >>> value, _ = shape_of(Kernel.wendland, 3.0)(np.array([0.0, 3.0]))
        >>> value.tolist()
        [1.0, 0.0]
    """
    shape, stretch = SHAPES[kernel], 2.0 / support

    def stretched(q: Array) -> tuple[Array, Array]:
        value, slope = shape(stretch * q)
        return value, stretch**2 * slope

    return stretched


def lattice(support: float) -> Array:
    """Offsets of the cubic lattice within a support, the origin left out, shape (n, 3)."""
    reach = int(np.ceil(support))
    axis = np.arange(-reach, reach + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    r = np.linalg.norm(points, axis=1)
    return np.asarray(points[(r > 0) & (r < support)], dtype=np.float64)


def sheet_mean(
    shape: Callable[[Array], tuple[Array, Array]], height: float, support: float
) -> Array:
    """Return value and derivative of a kernel above a sheet, averaged along the sheet.

    Args:
        shape: value, and slope over distance.
        height: above the sheet [1 spacing].
        support: of the kernel [1 spacing].
    """
    r = np.linspace(height, support, 4001)
    # rings around the foot of the perpendicular: 2 pi s ds = 2 pi r dr
    weight = 2 * np.pi * r * np.gradient(r)
    weight[[0, -1]] /= 2
    value, slope = shape(r)
    return np.array([(value * weight).sum(), height * (slope * weight).sum()])


def _solid_factors(
    shape: Callable[[Array], tuple[Array, Array]], factor: float, support: float
) -> tuple[float, float]:
    """Return (a, b) of the boundary's kernel u^7 (a + b u), u = 1 - q / support.

    One layer of samples stands for all that lies behind the surface. It must add as much density to
    the first layer of water, one spacing away, as the layers of water in reach there would; and
    press twice as hard, because in water the neighbour's own multiplier presses as well. Both
    follow from the density of the water alone, so that the force has a potential: a boundary that
    mirrors the multiplier instead pumps energy into water at rest.
    """
    layers = [sheet_mean(shape, float(k), support) for k in np.arange(1.0, support)]
    wanted = factor * np.sum(layers, axis=0) * np.array([1.0, 2.0])

    def power(n: int) -> Callable[[Array], tuple[Array, Array]]:
        return lambda r: (
            (1 - r / support) ** n,
            -n / support * (1 - r / support) ** (n - 1) / r,
        )

    columns = [sheet_mean(power(n), 1.0, support) for n in (7, 8)]
    a, b = np.linalg.solve(np.stack(columns, axis=1), wanted)
    return float(a), float(b)
