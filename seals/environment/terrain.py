"""Height maps: land and sea beds on a grid, read from pictures and tables."""

from __future__ import annotations

import csv
import functools
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.environment.settings import TerrainSettings
from seals.errors import ConfigError, LogError
from seals.picture_files import read_grey
from seals.untrusted_io import read_bytes

MOST_NODES = 1 << 20
"""Most nodes of a map: 1024 by 1024; sensors test a ray against two triangles of each cell."""
_MOST_BYTES = 1 << 25


class Terrain(NamedTuple):
    """A height map; between its nodes the ground is two triangles for each cell.

    Args:
        heights: world z of the nodes [m], shape (south to north, west to east).
        west: world x of the first column [m].
        south: world y of the first row [m].
        size: lengths along x and y [m].
    """

    heights: Floats
    west: float
    south: float
    size: tuple[float, float]

    def height(self, x: float, y: float) -> float | None:
        """Return the height of the ground at a point [m]; None beside the map.

        Example:
            >>> slope = Terrain(np.array([[0.0, 1.0], [0.0, 1.0]]), 0.0, 0.0, (2.0, 2.0))
            >>> slope.height(0.5, 1.7), slope.height(-1.0, 0.0)
            (0.25, None)
        """
        rows, columns = self.heights.shape
        u = (x - self.west) / self.size[0] * (columns - 1)
        v = (y - self.south) / self.size[1] * (rows - 1)
        if not (0.0 <= u <= columns - 1 and 0.0 <= v <= rows - 1):
            return None
        return float(self._at(np.array(u), np.array(v)))

    def _at(self, u: Floats, v: Floats) -> Floats:
        """Heights at places counted in cells from the south-western node."""
        rows, columns = self.heights.shape
        i = np.clip(u.astype(int), 0, columns - 2)
        j = np.clip(v.astype(int), 0, rows - 2)
        z, u, v = self.heights, u - i, v - j
        a, b, c, d = z[j, i], z[j, i + 1], z[j + 1, i], z[j + 1, i + 1]
        # cells are cut from the south-west to the north-east
        below, above = u * (b - a) + v * (d - b), u * (d - c) + v * (c - a)
        return np.asarray(a + np.where(u >= v, below, above))

    def refined(self, cell: float, most: int) -> Terrain:
        """Return the same surface on cells no larger than asked for, if so many nodes are allowed.

        Args:
            cell: largest edge [m].
            most: nodes along each side, unless the map has more itself.
        """
        lines = []
        for nodes, length in zip(self.heights.shape, self.size[::-1], strict=True):
            parts = min(math.ceil(length / (nodes - 1) / cell), max((most - 1) // (nodes - 1), 1))
            lines.append(np.linspace(0.0, nodes - 1.0, parts * (nodes - 1) + 1))
        u, v = np.meshgrid(lines[1], lines[0])
        return self._replace(heights=self._at(u, v))

    def mesh(self) -> tuple[Floats, NDArray[np.int64]]:
        """Return nodes about the middle of the map [m], (n, 3), and triangles, (f, 3)."""
        rows, columns = self.heights.shape
        x, y = (
            np.linspace(-0.5, 0.5, n) * s for n, s in zip((columns, rows), self.size, strict=True)
        )
        across, up = np.meshgrid(x, y)
        nodes = np.stack([across, up, self.heights], axis=-1).reshape(-1, 3)
        first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
        east, north, far = first + 1, first + columns, first + columns + 1
        faces = [np.stack([first, east, far], axis=1), np.stack([first, far, north], axis=1)]
        return nodes, np.concatenate(faces)


def terrain_of(settings: TerrainSettings) -> Terrain | None:
    """Return the height map that the settings name; None for none.

    Raises:
        ConfigError: the file is absent, damaged, too large or no grid of finite numbers.
    """
    if not settings.file:
        return None
    s = settings
    return _read(s.file or "", s.low, s.high, (s.size[0], s.size[1]), tuple(s.position))


@functools.lru_cache(maxsize=4)
def _read(
    file: str, low: float, high: float, size: tuple[float, float], place: tuple[float, ...]
) -> Terrain:
    where = f"environment.terrain.file={file}"
    if not low < high:
        raise ConfigError(
            f"environment.terrain.low={low:g} is not below high={high:g}.\nAllowed: low below high."
        )
    try:
        if Path(file).suffix.lower() == ".csv":
            text = read_bytes(file, most=_MOST_BYTES).decode("utf-8")
            rows = [[float(x) for x in row] for row in csv.reader(text.splitlines()) if row]
            grid = np.array(rows, dtype=float).reshape(len(rows), -1)
        else:
            grid = low + (high - low) * read_grey(file)
    except (LogError, ValueError, OSError) as cause:
        reason = str(cause).splitlines()[0][:160].rstrip(".")
        raise ConfigError(
            f"{where} cannot be used: {reason}\n"
            "Give a PNG of grey values, or a CSV with as many heights [m] in every row."
        ) from cause
    if min(grid.shape) < 2 or grid.size > MOST_NODES or not np.isfinite(grid).all():
        raise ConfigError(
            f"{where} has {grid.shape[0]} by {grid.shape[1]} nodes, or some that are not finite.\n"
            f"Allowed: finite heights, from 2 by 2 up to {MOST_NODES:,} nodes; scale the map down."
        )
    # pictures begin in the north
    heights = np.ascontiguousarray(grid[::-1]) + place[2]
    return Terrain(heights, place[0] - 0.5 * size[0], place[1] - 0.5 * size[1], size)
