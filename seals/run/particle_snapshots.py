"""Recorder of a subset of the fluid particles at intervals, for viewers."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seals.errors import ConfigError
from seals.fluid import Fluid
from seals.logs.atomic import atomic_path
from seals.world import World

FOLDER = "particles"
"""Folder of a run that holds them, one file an instant, named by its time."""
MOST = 20_000
"""Particles kept of one instant; of more, every second, third ... is."""


def subsampled(places: ArrayLike) -> NDArray[np.float32]:
    """Return at most `MOST` evenly chosen positions, in single precision.

    Args:
        places: of particles [m], shape (n, 3).

    Example:
        >>> len(subsampled(np.zeros((30_000, 3))))
        15000
    """
    found = np.asarray(places, dtype=np.float32)
    return found[:: max(1, math.ceil(len(found) / MOST))]


def passed(now: float, step: float, every: float) -> bool:
    """Return whether a step has reached or crossed a multiple of an interval.

    Args:
        now: time at the end of the step [s].
        step: its length [s].
        every: the interval [s].

    Example:
        >>> [passed(t, 0.04, 0.1) for t in (0.04, 0.08, 0.12)]
        [False, False, True]
    """
    return math.floor((now + 1e-9) / every) != math.floor((now - step + 1e-9) / every)


def file_of(folder: Path, time: float, suffix: str) -> Path:
    """Return the file name of a time in a folder, such as ``t_000.0500.npy``."""
    return folder / f"t_{time:08.4f}{suffix}"


def carry_over(before: Path | None, folder: Path, world: World) -> None:
    """Copy the snapshots that an interrupted run wrote before its checkpoint.

    Args:
        before: folder of instants of that life, or None.
        folder: of those of this one.
        world: after its first step beyond the checkpoint.
    """
    if before is None or before == folder:
        return
    for file in sorted(before.glob("t_*")):
        if float(file.stem.removeprefix("t_")) < world.time - 0.5 * world.step_size:
            with atomic_path(folder / file.name) as beside:
                shutil.copyfile(file, beside)


class Thinned:
    """Writer of a subset of the particles to a run folder.

    Args:
        folder: of the run.
        every: simulated time between two sets [s].
        fluid: of the run, or None.
        cut: folder of the run that this one goes on from, or None.

    Raises:
        ConfigError: there is no fluid.
    """

    def __init__(
        self, folder: Path, every: float, fluid: Fluid | None, cut: Path | None = None
    ) -> None:
        """Refuse an impossible request before the run starts."""
        if fluid is None:
            raise ConfigError(
                f"particles={every:g}: the run has no water of particles.\n"
                "Choose it, or leave particles out: water=particles"
            )
        self.folder, self.every = folder / FOLDER, every
        self._before = None if cut is None else cut / FOLDER

    def tick(self, world: World, books: Any) -> None:
        """Write a snapshot when due; one file for each multiple of ``every``."""
        carry_over(self._before, self.folder, world)
        self._before = None
        if world.fluid is None or not passed(world.time, world.step_size, self.every):
            return
        with atomic_path(file_of(self.folder, world.time, ".npy")) as beside:
            np.save(beside, subsampled(world.fluid.particles()[0]), allow_pickle=False)
