"""Water surface given as heights on a grid, such as that of particles."""

from __future__ import annotations

import numpy as np
from array_api_compat import device

from seals.arrays import Array, Floats, namespace


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
