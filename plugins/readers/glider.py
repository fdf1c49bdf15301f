"""Reader of the Slocum glider flight."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError
from seals.field_roles import roles
from seals.logs.arrays import read_npy
from seals.logs.datasets import paths_of, read_dataset
from seals.logs.log import Log
from seals.logs.units import to_si

DATASET = read_dataset("seals.plugins.readers", "slocum-glider")
_GRAVITY = 9.81


@roles(read="path")
@dataclass(kw_only=True)
class ReaderGlider:
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

    path: str = ""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the one log of the flight.

        Raises:
            LogError: the file is absent, damaged or of another shape.
        """
        path = paths_of(DATASET, source or self.path or None)[0]
        table = read_npy(path)
        if table.ndim != 2 or table.shape[0] != 6 or table.shape[1] < 2:
            raise LogError(f"'{path}' has shape {table.shape}, needed is (6, samples).")
        log = Log(
            name="slocum_glider",
            columns=_columns(table),
            meta=_meta(float(table[0, 0])),
            source=DATASET.source,
            licence=DATASET.licence,
        )
        return [log]


def _columns(table: Floats) -> dict[str, Floats]:
    time, pressure, pitch, ballast, density, speed = table
    pascal = to_si(pressure, "bar")
    return {
        "t": time - time[0],
        "pressure": pascal,
        "depth": pascal / (_GRAVITY * float(np.nanmean(density))),
        "pitch": pitch,
        "ballast_volume": to_si(ballast, "cm^3"),
        "water_density": density,
        "speed_through_water": speed,
    }


def _meta(start: float) -> dict[str, Any]:
    rates = ("pressure", "depth", "pitch", "ballast_volume", "water_density")
    return {
        "vehicle": {"name": "slocum_glider", "mass": None},
        "environment": {"gravity": [0.0, 0.0, -_GRAVITY], "water_level": 0.0},
        "baseline": [{"name": "gravity"}, {"name": "buoyancy", "medium": "water"}],
        "sensors": {"channels": {name: {"rate": 1.0} for name in rates}},
        "start_time_unix": start,
        "notes": ["pitch was scaled by 0.86 and shifted by -0.004 rad by the publisher"],
    }
