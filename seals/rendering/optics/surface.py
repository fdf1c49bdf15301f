"""Water surfaces for optics: height and slope at any point and time, by a law or on a grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from array_api_compat import device

from seals.arrays import Array, Floats, namespace
from seals.environment.waves import Waves


@runtime_checkable
class Surface(Protocol):
    """Interface of a water surface; x, y and results are arrays of one shape and library.

    Times are a number, or an array that broadcasts against x.
    """

    @property
    def level(self) -> float:
        """Mean height, world z [m]."""

    @property
    def reach(self) -> float:
        """Largest deviation of the surface from its mean level [m]."""

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the height of the surface, world z [m]."""

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return the slopes along x and y [1]."""


@runtime_checkable
class SurfaceSmooth(Protocol):
    """Interface of a surface whose slope can be averaged over the footprint of a pixel."""

    def slope_over(self, x: Array, y: Array, time: Array, width: Array) -> tuple[Array, Array]:
        """Return the slope, smoothed by a Gaussian of a width [m] that has the shape of x [1]."""


@dataclass(frozen=True, kw_only=True)
class SurfaceStill:
    """Still water.

    Args:
        level: height, world z [m].
    """

    level: float = 0.0
    reach: float = 0.0

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the level everywhere [m]."""
        return x * 0.0 + self.level

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return zero everywhere [1]."""
        flat = x * 0.0
        return flat, flat


class SurfaceAiry:
    """A sum of linear waves.

    Equation:
        z = level + sum a_i cos(theta_i), theta_i = kx_i x + ky_i y - w_i t + phi_i.

    Args:
        amplitude: a_i [m], shape (K,).
        wave: kx_i and ky_i [rad/m], shape (K, 2).
        omega: w_i [rad/s], shape (K,).
        phase: phi_i [rad], shape (K,).
        level: mean height, world z [m].

    Example:
        >>> import numpy as np
        >>> surface = SurfaceAiry([0.1], [[2.0, 0.0]], [4.4], [0.0])
        >>> surface.height(np.zeros(1), np.zeros(1), 0.0).tolist()
        [0.1]
    """

    def __init__(
        self,
        amplitude: Sequence[float] | Floats,
        wave: Sequence[Sequence[float]] | Floats,
        omega: Sequence[float] | Floats,
        phase: Sequence[float] | Floats,
        *,
        level: float = 0.0,
    ) -> None:
        waves = np.column_stack([amplitude, np.reshape(wave, (-1, 2)), omega, phase])
        self.waves: list[list[float]] = waves.tolist()
        self.level = level
        self.reach = float(np.abs(amplitude).sum())

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the height of the surface [m]."""
        xp, total = namespace(x), self.level
        for a, kx, ky, w, phi in self.waves:
            total = total + a * xp.cos(kx * x + (ky * y + _turn(w, time, phi, x)))
        return total if self.waves else x * 0.0 + total

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return the slopes along x and y [1]."""
        xp = namespace(x)
        along, across = x * 0.0, y * 0.0
        for a, kx, ky, w, phi in self.waves:
            rise = xp.sin(kx * x + (ky * y + _turn(w, time, phi, x)))
            along, across = along - (a * kx) * rise, across - (a * ky) * rise
        return along, across

    def slope_over(self, x: Array, y: Array, time: Array, width: Array) -> tuple[Array, Array]:
        """Return the slope, smoothed by a Gaussian of a width [m] [1]."""
        xp, square = namespace(x), -0.5 * width * width
        along, across = x * 0.0, y * 0.0
        for a, kx, ky, w, phi in self.waves:
            rise = xp.sin(kx * x + (ky * y + _turn(w, time, phi, x)))
            rise = rise * xp.exp((kx * kx + ky * ky) * square)
            along, across = along - (a * kx) * rise, across - (a * ky) * rise
        return along, across


def _turn(omega: float, time: Array, phase: float, like: Array) -> Array:
    """Phase - omega time without whole turns, computed before conversion to single precision."""
    if isinstance(time, int | float):
        return math.fmod(phase - omega * time, 2.0 * math.pi)
    xp = namespace(like)
    late = xp.astype(xp.asarray(time, device=device(like)), xp.float64)
    return xp.astype((phase - omega * late) % (2.0 * math.pi), like.dtype)


class SurfaceSum:
    """Sum of surfaces, such as swell and ripples.

    Args:
        parts: surfaces; the level is that of the first, the others ride on it.
    """

    def __init__(self, *parts: Surface) -> None:
        self.parts = parts
        self.level = parts[0].level
        self.reach = sum(part.reach for part in parts)

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the height of the surface [m]."""
        first, *rest = self.parts
        total = first.height(x, y, time)
        for part in rest:
            total = total + (part.height(x, y, time) - part.level)
        return total

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return the slopes along x and y [1]."""
        return _added([part.slope(x, y, time) for part in self.parts])

    def slope_over(self, x: Array, y: Array, time: Array, width: Array) -> tuple[Array, Array]:
        """Return the slope, smoothed by a Gaussian of a width [m] [1]."""
        return _added(
            [
                part.slope_over(x, y, time, width)
                if isinstance(part, SurfaceSmooth)
                else part.slope(x, y, time)
                for part in self.parts
            ]
        )


def _added(slopes: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Sum of slopes along x and along y."""
    along, across = slopes[0]
    for more_along, more_across in slopes[1:]:
        along, across = along + more_along, across + more_across
    return along, across


class SurfaceWaves:
    """The surface of a wave plug-in.

    Args:
        waves: plug-in.
        level: mean height, world z [m].
        reach: largest distance of the surface from its level [m].
    """

    def __init__(self, waves: Waves, *, level: float, reach: float) -> None:
        self.waves, self.level, self.reach = waves, level, reach

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the height of the surface [m]."""
        sea = self.waves.at(*_rows(x, y, time, self.level), self.level)
        xp = namespace(x)
        if isinstance(sea.elevation, int | float):
            return x * 0.0 + sea.elevation
        return xp.reshape(xp.astype(sea.elevation, x.dtype), x.shape)

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return the slopes along x and y [1]."""
        normal = self.waves.at(*_rows(x, y, time, self.level), self.level).normal
        if normal is None:
            return x * 0.0, y * 0.0
        xp = namespace(x)
        lean = xp.astype(normal, x.dtype)
        return (
            xp.reshape(-lean[:, 0] / lean[:, 2], x.shape),
            xp.reshape(-lean[:, 1] / lean[:, 2], x.shape),
        )


def _rows(x: Array, y: Array, time: Array, level: float) -> tuple[Array, Array]:
    """Points as positions (N, 3) and times (N or 1, 1), in double precision as waves want them."""
    xp = namespace(x)
    east, north = (xp.astype(xp.reshape(v, (-1,)), xp.float64) for v in (x, y))
    position = xp.stack([east, north, east * 0.0 + level], axis=-1)
    if isinstance(time, int | float):
        return position, xp.asarray([[time]], dtype=xp.float64, device=device(x))
    late = xp.astype(xp.asarray(time, device=device(x)), xp.float64)
    late = xp.broadcast_to(late, x.shape) if late.ndim == x.ndim else late
    return position, xp.reshape(late, (-1, 1))


def ripples(*, wind: float, seed: int, components: int = 12, level: float = 0.0) -> SurfaceAiry:
    """Return short wind waves, which focus sunlight.

    Wave lengths from 0.1 to 1.5 m, evenly on a logarithmic scale with equal shares of the mean
    square slope, directions spread about the x-axis by cos^2; slope by Cox and Munk,
    s^2 = 0.003 + 0.00512 U. Frequencies by gravity and surface tension.

    Args:
        wind: speed U at 10 m [m/s].
        seed: of directions and phases.
        components: number of waves.
        level: mean height, world z [m].

    References:
        Cox and Munk 1954, J. Opt. Soc. Am. 44, 838, doi:10.1364/JOSA.44.000838.

    Example:
        >>> surface = ripples(wind=3.0, seed=1)
        >>> round(sum(0.5 * (a * a) * (kx * kx + ky * ky) for a, kx, ky, *_ in surface.waves), 5)
        0.01836
    """
    rng = np.random.default_rng(seed)
    length = np.exp(np.linspace(math.log(0.1), math.log(1.5), components))
    k = 2.0 * math.pi / length * rng.uniform(0.93, 1.07, components)
    # inverse of the cumulative share of cos^2 by a table
    turn = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 1001)
    whole = (turn + 0.5 * np.sin(2.0 * turn)) / math.pi + 0.5
    heading = np.interp((rng.permutation(components) + 0.5) / components, whole, turn)
    amplitude = np.sqrt(2.0 * (0.003 + 0.00512 * wind) / components) / k
    # omega^2 = g k + (sigma / rho) k^3; the ratio of water in m^3/s^2
    omega = np.sqrt(9.81 * k + 7.4e-5 * k**3)
    wave = np.column_stack([k * np.cos(heading), k * np.sin(heading)])
    phase = rng.uniform(0.0, 2.0 * math.pi, components)
    return SurfaceAiry(amplitude, wave, omega, phase, level=level)


class SurfaceGrid:
    """Static surface on a regular grid: interpolated linearly, constant beyond the edge.

    Args:
        heights: at the middles of the cells, world z [m], shape (X, Y), both at least two.
        lower: corner of the grid, world x and y [m].
        edge: of a cell along x and along y [m].

    Example:
        >>> import numpy as np
        >>> tilted = SurfaceGrid(np.array([[0.0, 0.0], [1.0, 1.0]]), (0.0, 0.0), (1.0, 1.0))
        >>> tilted.height(np.array([1.0]), np.array([0.7]), 0.0).tolist()
        [0.5]
    """

    def __init__(
        self, heights: Floats, lower: tuple[float, float], edge: tuple[float, float]
    ) -> None:
        self.heights, self.lower, self.edge = np.asarray(heights, dtype=float), lower, edge
        self.level = float(self.heights.mean())
        self.reach = float(np.abs(self.heights - self.level).max())

    def height(self, x: Array, y: Array, time: Array) -> Array:
        """Return the height of the surface [m]."""
        (a, b, c, d), u, v = self._corners(x, y)
        return (1.0 - u) * ((1.0 - v) * a + v * b) + u * ((1.0 - v) * c + v * d)

    def slope(self, x: Array, y: Array, time: Array) -> tuple[Array, Array]:
        """Return the slopes along x and y [1]."""
        (a, b, c, d), u, v = self._corners(x, y)
        along = ((1.0 - v) * (c - a) + v * (d - b)) / self.edge[0]
        return along, ((1.0 - u) * (b - a) + u * (d - c)) / self.edge[1]

    def _corners(
        self, x: Array, y: Array
    ) -> tuple[tuple[Array, Array, Array, Array], Array, Array]:
        """Heights of the four cells around each point, and the point's position between them."""
        xp = namespace(x)
        rows, columns = self.heights.shape
        u = xp.clip((x - self.lower[0]) / self.edge[0] - 0.5, 0.0, rows - 1.0)
        v = xp.clip((y - self.lower[1]) / self.edge[1] - 0.5, 0.0, columns - 1.0)
        i = xp.clip(xp.astype(u, xp.int64), 0, rows - 2)
        j = xp.clip(xp.astype(v, xp.int64), 0, columns - 2)
        flat = xp.asarray(self.heights.ravel(), dtype=x.dtype, device=device(x))
        start = i * columns + j
        around = tuple(
            xp.reshape(xp.take(flat, xp.reshape(start + more, (-1,)), axis=0), x.shape)
            for more in (0, 1, columns, columns + 1)
        )
        return around, u - xp.astype(i, x.dtype), v - xp.astype(j, x.dtype)
