"""Reader of the ship section in regular waves."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.table import read_csv_columns
from seals.plugins.readers.published import ReaderPublished, refuse_lacking

DATASET = read_dataset("seals.plugins.readers", "wave-flume-ship-section")

_COLUMNS = {
    "time": "t",
    "wm_position": "wave_maker_position",
    "wp_1": "wave_elevation_1",
    "wp_2": "wave_elevation_2",
    "wp_3": "wave_elevation_3",
    "wp_4": "wave_elevation_4",
    "wp_6": "wave_elevation_6",
    "sway": "position_y",
    "heave": "position_z",
    "roll": "roll",
    "tension_sb": "spring_tension_1",
    "tension_ps": "spring_tension_2",
    "force_sway": "spring_force",
    "acc_heave_sb": "heave_acceleration_1",
    "acc_heave_ps": "heave_acceleration_2",
    "acc_sway": "sway_acceleration",
}
_NEEDED = ("t", "wave_elevation_4", "wave_elevation_6")
_NAME = re.compile(r"^(?P<kind>\d)(?P<wave>\d\d)(?P<height>\d)(?:_\d+)?$")
_HEIGHT = {"1": 0.024, "2": 0.040}
# angular frequency [rad/s] by wave index; the spectra of the wave-only runs peak there within 0.1 %
_FREQUENCY = {
    "01": 4.143,
    "03": 5.075,
    "04": 5.194,
    "06": 5.425,
    "10": 7.004,
    "11": 7.830,
}


@dataclass(kw_only=True)
class ReaderFlume(ReaderPublished):
    """Flume tests of a floating ship section in regular waves, and of the waves alone.

    Channels:
        ``wave_elevation_1, 2, 3, 4, 6`` (there is no probe 5) and ``wave_maker_position``; runs
        with the model also ``position_y`` (sway), ``position_z`` (heave), ``roll``,
        ``spring_tension_1/2`` (starboard, port), ``spring_force``, ``heave_acceleration_1/2``
        (starboard, port), ``sway_acceleration``.
    Units:
        SI already. Position is relative to rest, signs are those of the file.
    Source:
        https://github.com/KRSundsdal1/2D-ship-cross-section-in-regular-waves, 10 runs with the
        model free in sway, heave and roll, 7 runs of waves alone.
    Licence:
        CC0 1.0.
    Limitations:
        The pose comes from a camera at 20 frames per second, resampled to 200 Hz: its samples are
        not independent. Heave from the accelerometers is 3 to 17 % larger than the camera's. The
        wave maker's start is not aligned between runs well enough to compare phases.

    Args:
        path: a ``.csv`` or ``.csv.gz`` file, a folder of them, or the stem of a published run.
    """

    dataset: ClassVar[Dataset] = DATASET

    def log_of(self, path: Path) -> Log:
        """Return one run."""
        raw = read_csv_columns(path)
        # headers write "WM_Position" or "WM_Position [m]", "ACC_HEAVE_PS" or "ACC_Heave_SB"
        plain = {name.split("[")[0].strip().casefold(): values for name, values in raw.items()}
        columns = {ours: plain[theirs] for theirs, ours in _COLUMNS.items() if theirs in plain}
        for theirs, ours in _COLUMNS.items():
            if ours in _NEEDED and ours not in columns:
                refuse_lacking(path, [theirs], raw, label="Columns there")
        stem = path.name.split(".")[0]
        time = columns["t"]
        step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
        rate = 1.0 / step if step > 0.0 else 0.0
        # standard deviations over the first two seconds, before the waves arrive
        sigma = {"wave_elevation": 6.5e-5, "spring_tension": 5e-3, "heave_acceleration": 1e-3}
        sigma["sway_acceleration"] = 3e-4
        channels: dict[str, Any] = {key: {"sigma": s, "rate": rate} for key, s in sigma.items()}
        channels["position"] = {"rate": 20.0, "unit": "m"}
        meta: dict[str, Any] = {"sensors": {"channels": channels}, "wave": {}}
        if match := _NAME.match(stem):
            meta["wave"] = {
                "index": match["wave"],
                "nominal_height": _HEIGHT.get(match["height"]),
                "angular_frequency": _FREQUENCY.get(match["wave"]),
            }
        if "position_z" not in columns:
            meta["vehicle"] = None
        return self.described(stem, columns, meta=meta)
