"""Files of a run folder that are named by their time."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, LogError
from seals.logs.arrays import read_npy
from seals.run.particle_snapshots import FOLDER


class Instants:
    """Files named ``t_000.0500`` with a suffix, by time.

    Args:
        folder: that holds them, None for none.
        suffix: of the files.
    """

    def __init__(self, folder: Path | None, suffix: str) -> None:
        files = sorted(folder.glob(f"t_*{suffix}")) if folder is not None else []
        self.files = [(_instant(file), file) for file in files]
        self._times = np.array([time for time, _ in self.files])

    def nearest(self, time: float) -> Path | None:
        """Return the file nearest in time [s]."""
        return min(self.files, key=lambda each: abs(each[0] - time))[1] if self.files else None

    def last(self, time: float) -> Path | None:
        """Return the last file before a time [s], at least the first."""
        if not self.files:
            return None
        k = int(np.searchsorted(self._times, time + 1e-6, side="right")) - 1
        return self.files[max(k, 0)][1]


class ParticleSnapshots:
    """Stored particle snapshots of a run.

    Args:
        folder: of the run, None for none.
    """

    def __init__(self, folder: Path | None) -> None:
        self._instants = Instants(None if folder is None else folder / FOLDER, ".npy")

    def last(self, time: float) -> Floats | None:
        """Return the particle positions last stored before a time [s], shape (n, 3) [m], or None.

        Raises:
            ConfigError: the file is damaged.
        """
        file = self._instants.last(time)
        return None if file is None else _places(str(file))


def _instant(file: Path) -> float:
    """Time in a file name, ``t_000.0500.ply``."""
    try:
        return float(file.stem.removeprefix("t_"))
    except ValueError as cause:
        raise ConfigError(
            f"{file} has no time in its name.\nFiles there are called t_000.0500{file.suffix}; "
            "move other files away."
        ) from cause


@lru_cache(maxsize=32)
def _places(path: str) -> Floats:
    try:
        found = read_npy(path)
    except LogError as cause:
        raise ConfigError(f"{path} cannot be read: {cause}.\nRemove it, or run again.") from cause
    if found.ndim != 2 or found.shape[1] != 3 or not np.all(np.isfinite(found)):
        raise ConfigError(
            f"{path} contains no positions, but numbers of shape {found.shape}.\n"
            "Allowed: finite numbers of shape (n, 3); remove it, or run again."
        )
    return found
