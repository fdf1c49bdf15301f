"""Pressure of the water as the mean normal stress of the forces between particles, in NumPy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.plugins.fluids.solvers.device_settings import Kernel
from seals.plugins.fluids.solvers.pbf.device.isotropy import LIMIT
from seals.plugins.fluids.solvers.pbf.lattice import Calibration, shape_of
from seals.plugins.fluids.solvers.pbf.points import close_pairs

Array = NDArray[np.float64]


class _Pairs(NamedTuple):
    """Pairs of a particle and a neighbour: rows, offset [1 spacing], value and slope, share."""

    i: NDArray[np.int64]
    j: NDArray[np.int64]
    offset: Array
    value: Array
    slope: Array

    @classmethod
    def of(cls, a: Array, b: Array, method: Method, weights: Array | None = None) -> _Pairs:
        """Pairs in reach; with weights those with boundary samples, by their kernel."""
        lattice, d = method.lattice, method.spacing
        found = list(close_pairs(a, b, lattice.support * d))
        if not found:
            none = np.zeros(0, dtype=np.int64)
            return cls(none, none, np.zeros((0, 3)), np.zeros(0), np.zeros(0))
        i, j, r = (np.concatenate(x) for x in zip(*found, strict=True))
        if weights is None:
            i, j, r = (x[i != j] for x in (i, j, r))
            value, slope = shape_of(method.kernel, lattice.support)(r / d)
            value, slope = lattice.factor * value, lattice.factor * slope
        else:
            # u^7 (p + q u) with u = 1 - r / support, see `lattice.solid_factors`
            (p, q), u = lattice.solid, 1 - r / d / lattice.support
            part = method.scale * weights[j]
            value = part * u**7 * (p + q * u)
            slope = -part * u**6 * (7 * p + 8 * q * u) / (lattice.support * np.maximum(r / d, 1e-3))
        return cls(i, j, (a[i] - b[j]) / d, value, slope)


class Method(NamedTuple):
    """What the forces between particles depend on.

    Args:
        spacing: distance at rest [m].
        kernel: smoothing kernel.
        lattice: its calibration.
        share: of the uneven stress that is undone, see `device.isotropy` [1].
        scale: weight of boundary samples [1].
    """

    spacing: float
    kernel: Kernel
    lattice: Calibration
    share: float
    scale: float


def mean_stress(
    places: Array, multipliers: Array, samples: Array, weights: Array, method: Method
) -> Array:
    """Return the mean normal stress over (density at rest / step^2) [m^2], shape (n,).

    Equation:
        s_i = rho_i / 3 sum_j 1/2 (lambda_i L_i + lambda_j L_j) (-grad W_ij) . x_ij, and of walls
        the part that is normal to them, half of which lies in the water; averaged with the
        kernel over the neighbours.

    A particle's own multiplier alone misses what its neighbours press with: next to a wall, where
    particles lie in layers, multipliers differ by a tenth of the pressure from layer to layer.

    Args:
        places: of the particles [m], shape (n, 3).
        multipliers: that press [m^2], shape (n,).
        samples: of all boundaries [m], shape (b, 3).
        weights: of the samples [1], shape (b,).
        method: kernel and corrections.

    References:
        Irving and Kirkwood 1950, doi 10.1063/1.1747782.
    """
    water, wall = _Pairs.of(places, places, method), _Pairs.of(places, samples, method, weights)
    n, lattice = len(places), method.lattice
    turn = _corrections(water, wall, n, method)
    force = -water.slope[:, None] * water.offset
    # either end of a pair has half of its stress: 1/2 (lambda_i L_i + lambda_j L_j) (-grad W) . x
    pull = np.einsum("nab,nb->na", turn[water.i], force) * multipliers[water.i, None]
    pull += np.einsum("nab,nb->na", turn[water.j], force) * multipliers[water.j, None]
    stress = _summed(water.i, 0.5 * (pull * water.offset).sum(axis=1), n)
    force = -wall.slope[:, None] * wall.offset
    push = np.einsum("nab,nb->na", turn[wall.i], force)
    # of a wall the part normal to it alone: `along` is the share that its samples add beside it
    normal = _summed(wall.i, 0.5 * (push * wall.offset).sum(axis=1), n)
    stress += normal / (1 + 2 * lattice.along) * multipliers
    near = lattice.own + _summed(water.i, water.value, n)
    stress *= (near + _summed(wall.i, wall.value, n)) / 3
    # averaged with the kernel: single particles in layers differ by a tenth
    whole = lattice.own * stress + _summed(water.i, water.value * stress[water.j], n)
    return np.asarray(whole / near)


def _corrections(water: _Pairs, wall: _Pairs, n: int, method: Method) -> Array:
    """Isotropy corrections, shape (n, 3, 3), see `device.isotropy`."""
    one, along = np.eye(3), method.lattice.along
    if method.share <= 0.0:
        return np.broadcast_to(one, (n, 3, 3))
    moment = _moments(water, n)
    solid = 0.5 * _moments(wall, n)
    trace = np.trace(solid, axis1=1, axis2=2)[:, None, None]
    moment += (solid - along / (1 + 2 * along) * trace * one) / (1 - along)
    third = np.trace(moment, axis1=1, axis2=2)[:, None, None] / 3
    uneven = moment / (third + 1e-9) - one
    size = np.sqrt((uneven**2).sum(axis=(1, 2), keepdims=True))
    part = method.share * np.minimum(1.0, LIMIT / (size + 1e-9))
    return np.asarray(np.linalg.inv(one + part * uneven))


def _moments(pairs: _Pairs, n: int) -> Array:
    """Sum -slope e e^T over the pairs of each particle, shape (n, 3, 3)."""
    e = pairs.offset
    out = np.zeros((n, 3, 3))
    for a in range(3):
        for b in range(a, 3):
            out[:, a, b] = out[:, b, a] = _summed(pairs.i, -pairs.slope * e[:, a] * e[:, b], n)
    return out


def _summed(i: NDArray[np.int64], values: Array, n: int) -> Array:
    return np.bincount(i, values, n).astype(np.float64)
