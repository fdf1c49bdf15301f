"""Recorded outputs of an autopilot over time, and their file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.logs.atomic import write_table
from seals.logs.table import read_parquet

OUTPUTS = "outputs.parquet"
"""File of the outputs in the run folder: ``t`` and one column for each channel."""


class Track:
    """Outputs of an autopilot, each held until the next.

    Args:
        times: [s], rising.
        outputs: NaN for none, shape (times, channels).
    """

    def __init__(self, times: Floats, outputs: Floats) -> None:
        self.times, self.outputs = times, outputs

    def at(self, time: float) -> Floats | None:
        """Return the outputs in force at a time [s]; None before the first."""
        k = int(np.searchsorted(self.times, time + 1e-9, side="right")) - 1
        return None if k < 0 else self.outputs[k]

    def write(self, path: Path) -> None:
        """Write the file."""
        columns = {f"channel_{k + 1}": values for k, values in enumerate(self.outputs.T)}
        write_table(path, {"t": self.times, **columns})


def read_track(path: Path) -> Track:
    """Read a file of outputs.

    Raises:
        LogError: it cannot be read.
        ConfigError: it holds no times that rise, or no channels.
    """
    found = read_parquet(path)
    times = found.pop("t", np.zeros(0))
    names = [f"channel_{k + 1}" for k in range(len(found))]
    if not len(times) or not np.all(np.diff(times) > 0.0) or set(names) != set(found) or not found:
        raise ConfigError(
            f"script {path} is no table of outputs.\n"
            f"Allowed: {OUTPUTS} of a flight by seals autopilot: t rising, channel_1, channel_2 ..."
        )
    return Track(times, np.stack([found[name] for name in names], axis=1))
