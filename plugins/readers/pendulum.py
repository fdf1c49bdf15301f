"""Reader of the single-pendulum free swings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.field_roles import roles
from seals.isolated_reading import read_isolated
from seals.logs.datasets import paths_of, read_dataset
from seals.logs.log import Log
from seals.untrusted_io import regular_file

DATASET = read_dataset("seals.plugins.readers", "single-pendulum")
_GROUPS = {"identification": ("Time_id", "Y_id"), "validation": ("Time_vad", "Y_vad")}


@roles(read="path")
@dataclass(kw_only=True)
class ReaderPendulum:
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

    path: str = ""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the logs ``identification`` and ``validation``.

        Raises:
            LogError: the file is absent, damaged or of another layout.
        """
        path = paths_of(DATASET, source or self.path or None)[0]
        content = _load(path)
        return [_log(path, content, name) for name in _GROUPS]


def _load(path: Path) -> dict[str, list[Floats]]:
    file = regular_file(path, most=1 << 25)
    found: dict[str, list[Floats]] = read_isolated(f"{__name__}:segments_of", file)
    return found


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


def _log(path: Path, content: dict[str, list[Floats]], name: str) -> Log:
    parts = [content[key] for key in _GROUPS[name]]
    if len(parts[0]) != len(parts[1]):
        raise LogError(f"'{path}': {len(parts[0])} time and {len(parts[1])} data segments.")
    for time, values in zip(*parts, strict=True):
        if values.ndim != 2 or values.shape[0] != 2 or values.shape[1] != time.size:
            raise LogError(
                f"'{path}': a segment has {time.size} times and data of shape {values.shape}, "
                "needed is (2, times)."
            )
    angle, rate = np.concatenate(parts[1], axis=1)
    return Log(
        name=name,
        columns={
            "t": np.concatenate([time.ravel() for time in parts[0]]),
            "joint_position_1": angle - math.pi,
            "joint_velocity_1": rate,
        },
        segment=np.repeat(np.arange(len(parts[0])), [time.size for time in parts[0]]),
        meta=_meta(),
        source=DATASET.source,
        licence=DATASET.licence,
    )


def _segments(path: Path, content: dict[str, Any], key: str) -> list[Floats]:
    cells = content.get(key)
    if not isinstance(cells, np.ndarray) or cells.dtype != object or cells.size == 0:
        raise LogError(f"'{path}' has no list of segments '{key}'.")
    try:
        return [np.asarray(cell, dtype=np.float64) for cell in cells.ravel()]
    except (TypeError, ValueError) as error:
        raise LogError(f"'{path}': '{key}' does not hold numbers ({error}).") from error


def _meta() -> dict[str, Any]:
    return {
        "vehicle": {"name": "single_pendulum", "joints": 1},
        "environment": {"gravity": [0.0, 0.0, -9.81], "water_level": None},
        "baseline": [{"name": "gravity"}],
        "sensors": {
            "channels": {
                "joint_position": {"rate": 1000.0, "unit": "rad"},
                "joint_velocity": {"rate": 1000.0, "unit": "rad/s"},
            }
        },
        "notes": ["0 = hanging; the file's own zero is upright", "cart fixed, no input"],
    }
