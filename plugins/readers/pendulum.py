"""Reader of the single-pendulum free swings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.isolated_reading import read_isolated
from seals.logs.datasets import Dataset, paths_of, read_dataset
from seals.logs.log import Log
from seals.plugins.readers.published import ReaderPublished
from seals.untrusted_io import regular_file

DATASET = read_dataset("seals.plugins.readers", "single-pendulum")
_GROUPS = {"identification": ("Time_id", "Y_id"), "validation": ("Time_vad", "Y_vad")}


@dataclass(kw_only=True)
class ReaderPendulum(ReaderPublished):
    """Free swings of a real pendulum on a fixed cart, no input; a log to fit, one to test.

    Channels:
        ``joint_position_1`` (0 = hanging) and ``joint_velocity_1``; four segments in the log
        ``identification``, two in ``validation``. Time runs through from the first to the last.
    Units:
        rad and rad/s already. The file measures the angle from upright (pi = hanging); here
        0 = hanging, the sense of rotation is kept.
    Source:
        https://github.com/dynamicslab/MultiArm-Pendulum
    Licence:
        MIT.
    Limitations:
        The segments are consecutive parts of one swing that dies out: the test swings are smaller
        than the fitted ones. Rates are the publisher's, with about 0.05 rad/s of noise.

    Args:
        path: the ``.mat`` file, or a folder that holds it.
    """

    dataset: ClassVar[Dataset] = DATASET

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the logs ``identification`` and ``validation``.

        Raises:
            LogError: the file is absent, damaged or of another layout.
        """
        path = paths_of(DATASET, source or self.path or None)[0]
        file = regular_file(path, most=1 << 25)
        content: dict[str, list[Floats]] = read_isolated(f"{__name__}:segments_of", file)
        return [self._swing(path, content, name) for name in _GROUPS]

    def _swing(self, path: Path, content: dict[str, list[Floats]], name: str) -> Log:
        times, values = (content[key] for key in _GROUPS[name])
        if len(times) != len(values):
            raise LogError(f"'{path}': {len(times)} time and {len(values)} data segments.")
        for time, part in zip(times, values, strict=True):
            if part.ndim != 2 or part.shape[0] != 2 or part.shape[1] != time.size:
                raise LogError(
                    f"'{path}': a segment has {time.size} times and data of shape {part.shape}, "
                    "but (2, times) is required."
                )
        angle, rate = np.concatenate(values, axis=1)
        return self.described(
            name,
            {
                "t": np.concatenate([time.ravel() for time in times]),
                "joint_position_1": angle - math.pi,
                "joint_velocity_1": rate,
            },
            segment=np.repeat(np.arange(len(times)), [time.size for time in times]),
        )


def segments_of(file: Path) -> dict[str, list[Floats]]:
    """Return the segments of a MATLAB file by the names of its variables.

    Raises:
        LogError: SciPy does not read it, or a variable is no list of numbers.
    """
    from scipy.io import loadmat

    try:
        content = dict(loadmat(str(file)))
    except Exception as error:  # scipy lets errors of every kind through on damaged files
        raise LogError(f"'{file}' is not a valid MATLAB file ({error}).") from error
    return {key: _segments(file, content, key) for group in _GROUPS.values() for key in group}


def _segments(path: Path, content: dict[str, Any], key: str) -> list[Floats]:
    cells = content.get(key)
    if not isinstance(cells, np.ndarray) or cells.dtype != object or cells.size == 0:
        raise LogError(f"'{path}' has no list of segments '{key}'.")
    try:
        return [np.asarray(cell, dtype=np.float64) for cell in cells.ravel()]
    except (TypeError, ValueError) as error:
        raise LogError(f"'{path}': '{key}' does not contain numbers ({error}).") from error
