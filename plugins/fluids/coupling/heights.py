"""Height field of the surface of the particles."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from seals.arrays import Floats

CELL = 2.0
"""Edge of a cell in spacings."""
LAYER = 4
"""Particles of a cell in one layer of resting water."""


class HeightField:
    """Heights of the water over a grid of cells, two spacings wide.

    A cell's height is the mean of its four highest particles and half a spacing: four fill one
    spacing of depth, whether they lie in a layer or in disorder. Drops high above the rest count
    as if they lay on it. Cells in which a body stands above the water get the mean of their
    neighbours: the body is not a hole.

    Args:
        lower: corner [m], shape (2 or more,).
        upper: opposite corner [m].
        spacing: of the particles [m].
        level: height where nothing is known [m].
    """

    def __init__(self, lower: Floats, upper: Floats, spacing: float, level: float) -> None:
        self.spacing, self.level = spacing, level
        self.lower = np.array(lower[:2], dtype=float)
        self.shape = np.maximum(
            np.round((np.array(upper[:2]) - self.lower) / (CELL * spacing)).astype(int), 1
        )
        self.edge = (np.array(upper[:2]) - self.lower) / self.shape
        self.heights = np.full(self.shape, level)

    def update(self, particles: Floats, bodies: Floats) -> None:
        """Update the heights.

        Args:
            particles: [m], shape (n, 3).
            bodies: samples of the bodies, world [m], shape (b, 3).
        """
        tops = self._ranked(particles)
        if len(bodies):
            upper = self._extreme(bodies, highest=True)
            lower = self._extreme(bodies, highest=False)
            # a body that rises out of the water below it, and does not hang in the air above it
            touches = lower < np.where(np.isfinite(tops), tops, -np.inf) + 1.5 * self.spacing
            tops[(upper > tops) & touches] = np.nan
        heights = _closed(tops, self.level)
        # outlying cells, air pockets and jets, are not the surface
        around = median_filter(heights, size=3, mode="nearest")
        self.heights = np.where(np.abs(heights - around) > self.spacing, around, heights)

    def _cells(self, points: Floats) -> tuple[Any, Floats]:
        """Cell index and height of every point inside the grid."""
        index = np.floor((points[:, :2] - self.lower) / self.edge).astype(int)
        inside = ((index >= 0) & (index < self.shape)).all(axis=1)
        return index[inside, 0] * self.shape[1] + index[inside, 1], points[inside, 2]

    def _ranked(self, particles: Floats) -> Floats:
        """Surface over every cell from its highest particles; NaN with too few of them."""
        cells, heights = self._cells(particles)
        # by cells, and from the top in each: one key sorts faster than two
        depth = heights.max(initial=-np.inf) - heights
        order = np.argsort(cells + depth / (1.001 * depth.max(initial=0.0) + 1e-12))
        cells, heights = cells[order], heights[order]
        first = np.searchsorted(cells, np.arange(self.shape.prod()))
        counts = np.diff(np.append(first, len(cells)))
        out = np.full(int(self.shape.prod()), np.nan)
        some = counts > LAYER
        ranks = heights[first[some][:, None] + np.arange(LAYER + 1)]
        # drops above the first that has company below count as if they lay on it
        calm = np.minimum(ranks[:, :LAYER], ranks[:, [LAYER]] + 1.5 * self.spacing)
        out[some] = calm.mean(axis=1) + 0.5 * self.spacing
        tops: Floats = out.reshape(self.shape)
        return tops

    def _extreme(self, points: Floats, *, highest: bool) -> Floats:
        """Highest or lowest point of every cell; where there is none, minus or plus infinity."""
        cells, heights = self._cells(points)
        out = np.full(int(self.shape.prod()), -np.inf if highest else np.inf)
        (np.maximum if highest else np.minimum).at(out, cells, heights)
        tops: Floats = out.reshape(self.shape)
        return tops

    def at(self, places: Floats) -> Floats:
        """Return the heights at points, interpolated linearly [m], shape (N,).

        Args:
            places: [m], shape (N, 2 or 3).
        """
        grid = (places[:, :2] - self.lower) / self.edge - 0.5
        grid = np.clip(grid, 0.0, self.shape - 1.0)
        low = np.minimum(grid.astype(int), np.maximum(self.shape - 2, 0))
        high = np.minimum(low + 1, self.shape - 1)
        u, v = (grid - low).T
        h = self.heights
        near = (1.0 - v) * h[low[:, 0], low[:, 1]] + v * h[low[:, 0], high[:, 1]]
        far = (1.0 - v) * h[high[:, 0], low[:, 1]] + v * h[high[:, 0], high[:, 1]]
        out: Floats = (1.0 - u) * near + u * far
        return out


def _closed(heights: Floats, level: float) -> Floats:
    """Heights with unknown cells filled from their neighbours, ring by ring."""
    out = heights
    while True:
        unknown = np.isnan(out)
        if not unknown.any():
            return out
        if unknown.all():
            return np.full(out.shape, level)
        padded = np.pad(out, 1, constant_values=np.nan)
        stack = np.stack(
            [
                padded[1 + i : 1 + i + out.shape[0], 1 + j : 1 + j + out.shape[1]]
                for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1))
            ]
        )
        known = np.isfinite(stack)
        count = known.sum(axis=0)
        mean = np.where(known, stack, 0.0).sum(axis=0) / np.maximum(count, 1)
        out = np.where(unknown & (count > 0), mean, out)
