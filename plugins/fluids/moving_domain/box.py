"""Box of the moving domain in Lagrangian coordinates, moved by whole cells."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.plugins.fluids.sampling import Samples, box_walls, fewest_places
from seals.state_records import state_record

Marks = NDArray[np.bool_]
SOFT = 3.5
"""Exponent of the ring's weight, Jacobsen et al. 2012."""


@state_record
class Box(NamedTuple):
    """Box in coordinates of the water at rest.

    Args:
        spacing: of the particles [m].
        lower: corner on its floor [m], shape (3,).
        counts: spacings along each side.
        ring: width of the relaxation ring, in spacings.
        cell: by which it moves, in spacings.
        freeboard: height of its sides above the surface at rest [m].
    """

    spacing: float
    lower: Floats
    counts: tuple[int, int, int]
    ring: int
    cell: int
    freeboard: float

    @property
    def upper(self) -> Floats:
        """Corner of largest x, y and z, on the surface [m], shape (3,)."""
        return self.lower + self.spacing * np.array(self.counts)

    @property
    def middle(self) -> Floats:
        """Centre of the box [m], shape (3,)."""
        return 0.5 * (self.lower + self.upper)

    @property
    def depth(self) -> float:
        """Depth of the water at rest [m]."""
        return self.spacing * self.counts[2]

    def cells_to(self, place: Floats) -> tuple[int, int]:
        """Return the number of cells to move so that a point lies in the middle cell."""
        off = (place - self.middle)[:2] / (self.cell * self.spacing)
        east, north = (int(math.copysign(math.floor(abs(x)), x)) for x in off)
        return east, north

    def moved(self, cells: tuple[int, int]) -> Box:
        """Return the box moved by some cells."""
        way = self.cell * self.spacing * np.array([*cells, 0.0])
        return self._replace(lower=self.lower + way)

    def holds(self, rest: Floats, *, slack: float = 0.0) -> Marks:
        """Return a mask of the rest positions inside the box, shape (n,)."""
        low, high = self.lower - slack, self.upper + slack
        east, north = rest[:, 0], rest[:, 1]
        found: Marks = (east >= low[0]) & (east < high[0]) & (north >= low[1]) & (north < high[1])
        return found

    def lattice(self) -> Floats:
        """Particle positions of water at rest [m], shape (n, 3)."""
        axes = (
            low + self.spacing * (np.arange(n) + 0.5)
            for low, n in zip(self.lower, self.counts, strict=True)
        )
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)

    def weight(self, rest: Floats) -> Floats:
        """Return the weight of the outer sea at rest positions: 0 inside, 1 at the sides, (n,)."""
        inner = [np.minimum(rest[:, k] - self.lower[k], self.upper[k] - rest[:, k]) for k in (0, 1)]
        gap = np.minimum(*inner)
        s = np.clip(1.0 - gap / (self.ring * self.spacing), 0.0, 1.0)
        out: Floats = np.expm1(s**SOFT) / math.expm1(1.0)
        return out

    @property
    def boundary(self) -> int:
        """Least number of samples of floor and sides, without sampling them."""
        return fewest_places((*self.counts[:2], self.counts[2] + self._rows))

    @property
    def _rows(self) -> int:
        """Rows of the sides above the surface at rest."""
        return math.ceil(self.freeboard / self.spacing)

    def sides(self) -> Samples:
        """Samples of floor and sides."""
        high = self.upper + np.array([0.0, 0.0, self._rows * self.spacing])
        return box_walls(self.lower, high, self.spacing)
