"""Reader of the Slocum glider flight."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from seals.errors import LogError
from seals.logs.arrays import read_npy
from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.units import to_si
from seals.plugins.readers.published import ReaderPublished

DATASET = read_dataset("seals.plugins.readers", "slocum-glider")
_GRAVITY = 9.81


@dataclass(kw_only=True)
class ReaderGlider(ReaderPublished):
    """One flight of a Slocum glider in the Baltic, June 2016: 4.1 h of yos to about 40 m.

    Channels:
        ``pressure``, ``depth``, ``pitch`` (nose up positive), ``ballast_volume`` (positive is
        buoyant), ``water_density``, ``speed_through_water`` (from a Doppler log, NaN in 69 %).
    Units:
        bar -> Pa, cm^3 -> m^3; time starts at zero, its origin is ``meta.start_time_unix``.
        ``depth`` is pressure over gravity and the flight's mean density, within 0.15 % of
        integrating the density profile.
    Source:
        https://github.com/smerckel/gliderflight, data/gliderflight_data.npy
    Licence:
        MIT.
    Limitations:
        The publisher scaled the pitch by 0.86 and shifted it by -0.004 rad. Gaps of up to 218 s at
        the surface. No gyroscope, no accelerometer, no position.

    Args:
        path: the ``.npy`` file, or a folder that holds it.
    """

    dataset: ClassVar[Dataset] = DATASET

    def log_of(self, path: Path) -> Log:
        """Return the flight."""
        table = read_npy(path)
        if table.ndim != 2 or table.shape[0] != 6 or table.shape[1] < 2:
            raise LogError(f"'{path}' has shape {table.shape}, but (6, samples) is required.")
        time, pressure, pitch, ballast, density, speed = table
        pascal = to_si(pressure, "bar")
        columns = {
            "t": time - time[0],
            "pressure": pascal,
            "depth": pascal / (_GRAVITY * float(np.nanmean(density))),
            "pitch": pitch,
            "ballast_volume": to_si(ballast, "cm^3"),
            "water_density": density,
            "speed_through_water": speed,
        }
        return self.described("slocum_glider", columns, meta={"start_time_unix": float(time[0])})
