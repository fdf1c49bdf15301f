"""Recorder of a subset of the fluid particles at intervals, for viewers."""

from __future__ import annotations

import math
import os
import re
import shutil
from abc import abstractmethod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seals.errors import ConfigError
from seals.fluid import Fluid
from seals.logs.atomic import atomic_path
from seals.run.recorder import Moment, Recorder
from seals.state_file import StateError, open_regular
from seals.world import World

FOLDER = "particles"
"""Folder of a run that holds them, one file an instant, named by its time."""
MOST_BYTES = 1 << 26
"""Largest file of an instant, or picture, that a run which is taken up takes over [byte]."""
_TIME = re.compile(r"t_\d{3,9}\.\d{4}")
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


def copy_own(file: Path, target: Path) -> None:
    """Copy a file of a run folder that may be a stranger's.

    Raises:
        ConfigError: it is a link, no ordinary file, or too large.
    """
    try:
        with open_regular(file) as source:
            if os.fstat(source.fileno()).st_size > MOST_BYTES:
                raise StateError(f"it has more than {MOST_BYTES:,} bytes")
            with target.open("wb") as copy:
                shutil.copyfileobj(source, copy)
    except StateError as cause:
        raise ConfigError(f"{file} is not copied: {cause}.\nRun it again: repeat=FOLDER") from cause


class InstantFiles(Recorder):
    """Recorder of the water that writes a file at every multiple of an interval.

    Args:
        key: setting that asks for it, also the folder of the run that holds the files.
        every: simulated time between two files [s].
        fluid: of the run, or None.

    Raises:
        ConfigError: there is no fluid.
    """

    def __init__(self, key: str, every: float, fluid: Fluid | None) -> None:
        if fluid is None:
            raise ConfigError(
                f"{key}={every:g}: the run has no particle water.\n"
                f"Choose it, or leave {key} out: water=particles"
            )
        self._key, self._every = key, every
        self._folder: Path | None = None
        self._before: Path | None = None

    def restore(self, kept: Any, rows: int, folder: Path) -> None:
        """Note the folder with the files that were written before the checkpoint."""
        self._before = folder / self._key

    def start(self, world: World, folder: Path | None) -> None:
        """Write to a folder, after a copy of the files from before the checkpoint."""
        if folder is None:
            return
        self._folder = folder / self._key
        if self._before is None or self._before == self._folder:
            return
        for file in sorted(self._before.glob("t_*")):
            if not _TIME.fullmatch(file.stem):
                continue
            if float(file.stem.removeprefix("t_")) < world.time + 0.5 * world.step_size:
                with atomic_path(self._folder / file.name) as beside:
                    copy_own(file, beside)

    def record(self, moment: Moment) -> None:
        """Write a file when one is due."""
        world = moment.world
        if self._folder is None or world.fluid is None:
            return
        if passed(world.time, world.step_size, self._every):
            self.write(self._folder / f"t_{world.time:08.4f}", world.fluid)

    @abstractmethod
    def write(self, path: Path, fluid: Fluid) -> None:
        """Write the water as it is, to a path without suffix."""


class Thinned(InstantFiles):
    """Writer of a subset of the particles to a run folder.

    Args:
        every: simulated time between two sets [s].
        fluid: of the run, or None.

    Raises:
        ConfigError: there is no fluid.
    """

    def __init__(self, every: float, fluid: Fluid | None) -> None:
        super().__init__(FOLDER, every, fluid)

    def write(self, path: Path, fluid: Fluid) -> None:
        """Write the particles."""
        with atomic_path(path.with_name(path.name + ".npy")) as beside:
            np.save(beside, subsampled(fluid.particles()[0]), allow_pickle=False)
