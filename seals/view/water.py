"""Water surface of a run for display, from its waves or from stored meshes."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.hydrostatics.meshes import load_triangles
from seals.run.settings import RunSettings
from seals.run.surface import FOLDER
from seals.untrusted_io import MOST_BYTES
from seals.view.instants import Instants

FINE = 2.5
"""How much finer a patch is in the middle: its cells grow as the hyperbolic cosine up to this."""


class Patch(NamedTuple):
    """Triangle mesh of a piece of the surface.

    Args:
        vertices: world [m], shape (V, 3).
        faces: anticlockwise from above, shape (F, 3).
    """

    vertices: Floats
    faces: NDArray[np.int64]


class Water:
    """Water surface of a run at any time.

    Args:
        settings: of the run.
        folder: of the run; meshes in its ``surface/`` go before the waves. None for none.

    Attributes:
        level: height of the calm surface [m], None without water.
        meshes: files of surface meshes by time [s].
    """

    def __init__(self, settings: RunSettings, folder: Path | None = None) -> None:
        self.level = settings.environment.water_level
        self._waves = settings.wave
        self._instants = Instants(None if folder is None else folder / FOLDER, ".ply")
        self.meshes = self._instants.files

    @property
    def moves(self) -> bool:
        """Return whether the surface changes over time."""
        if self.meshes:
            return True
        return self.level is not None and self._sea(np.zeros((1, 3)), 0.0).normal is not None

    def heights(self, time: float, x: Floats, y: Floats) -> Floats:
        """Return the height of the waves over points of the ground.

        Args:
            time: [s].
            x: east [m], any shape.
            y: north [m], of the same shape.

        Raises:
            ConfigError: the run has no water.
        """
        if self.level is None:
            raise ConfigError("this run has no water.\nChoose it in the run: water=fossen")
        flat = np.column_stack([np.ravel(x), np.ravel(y), np.full(np.size(x), self.level)])
        found = np.broadcast_to(np.ravel(self._sea(flat, time).elevation), (len(flat),))
        return np.asarray(found, dtype=float).reshape(np.shape(x))

    def _sea(self, points: Floats, time: float) -> Any:
        return self._waves.at(points, np.array([[time]]), float(self.level or 0.0))

    def mesh(self, time: float) -> Patch | None:
        """Return the mesh last stored before a time; None where the folder has none."""
        file = self._instants.last(time)
        return None if file is None else _read(str(file))

    def patch(self, time: float, middle: Floats, half: float, cells: int) -> Patch | None:
        """Return a square of the surface as triangles, None without water.

        Args:
            time: [s].
            middle: of the square, x and y [m].
            half: of its edge [m].
            cells: along an edge.
        """
        if self.level is None:
            return None
        # finer in the middle, where the robot is
        across = half * np.sinh(np.linspace(-FINE, FINE, cells + 1)) / np.sinh(FINE)
        y, x = np.meshgrid(middle[1] + across, middle[0] + across, indexing="ij")
        z = self.heights(time, x, y)
        return Patch(np.stack([x, y, z], axis=-1).reshape(-1, 3), _grid_faces(cells))


@lru_cache(maxsize=8)
def _grid_faces(cells: int) -> NDArray[np.int64]:
    """Return the triangles of a square grid of points in rows towards +y, seen from above.

    Example:
        >>> _grid_faces(1).tolist()
        [[0, 1, 3], [0, 3, 2]]
    """
    row = cells + 1
    first = (np.arange(cells)[:, None] * row + np.arange(cells)).ravel()
    right, above, across = first + 1, first + row, first + row + 1
    lower = np.stack([first, right, across], axis=1)
    upper = np.stack([first, across, above], axis=1)
    return np.stack([lower, upper], axis=1).reshape(-1, 3)


@lru_cache(maxsize=32)
def _read(path: str) -> Patch:
    try:
        loaded = load_triangles(Path(path), where="surface", most=MOST_BYTES)
        return Patch(np.asarray(loaded.vertices, dtype=float), np.asarray(loaded.faces))
    except (OSError, ValueError, IndexError) as cause:
        raise ConfigError(f"{path} cannot be read: {cause}.\nRemove it, or run again.") from cause
