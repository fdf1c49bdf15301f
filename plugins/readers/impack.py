"""Reader of the IMpack water-entry drops."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, MissingExtra
from seals.logs.arrays import read_npz
from seals.logs.datasets import DataFile, Dataset, paths_of
from seals.logs.log import Log
from seals.logs.units import STANDARD_GRAVITY, to_si
from seals.untrusted_io import regular_file

# checksums of the offline .npz form; the public .ide recordings were not at hand to be summed
_OFFLINE = {
    "2mps_sphere_1": "f4942f33b2a2b1e69e9289ca180e40b39896801db18f1a315aa5993c87e90e55",
    "2mps_sphere_2": "4f6abdb4093dc355042b9ecf9e3de6566e4d9a7c6bb9c009ee075f767bcedaf1",
    "2mps_sphere_3": "4967a20478f4d2714bd79140588ae27419d328fb1b089e0a0408024da5544189",
    "4mps_150degcone_1": "765302a03be4447e79b5d38267623706042d69e5704880c4607b77d55c8e2671",
    "4mps_150degcone_2": "9bb7b98078fe4a4a98258a0d34aa45d05abc8ed652cfc20294051bcd55cde4ff",
    "4mps_150degcone_3": "6d4c79c799a4c932aeae37e1334d341693aec827121ed573baf18e8e9e2bb8eb",
    "4mps_sphere_1": "f3edc45b18d834c42ba049449e6a39fc76314262825eec1fba72d797ffd78171",
    "4mps_sphere_2": "b725662be3c6dbc8ef6920b5dfc5863f3aaa9e318e05dc2f8d6f3a93935ab8c9",
    "4mps_sphere_3": "25df43f143c665bbf3d7180526bd0f07e6622af3651c45930639a2708ddbf152",
    "6mps_150degcone_1": "d91fe7389ca331e966a46b884dee400c1611cce3819cc56c2885f2f933be2962",
    "6mps_150degcone_2": "5135898eb51effbc6565ac20f8d4a1fc6998a08a09e888ce6d4e44dcdcac08d5",
    "6mps_150degcone_3": "10c376c0eee68dead2b323bb6941ef005ba93a943cbb901f2860832ecd7ef7c9",
    "6mps_sphere_1": "92eff2cc9cdc6f408061258907c84a2695d0f228ddc6960c126f41a3531e9ffd",
    "6mps_sphere_2": "47a4035e065d82c620a7d679733fa08f8f287faa5a08053a8b0e4dab75ba6c55",
    "6mps_sphere_3": "e48fa7b0e7093bde7bed777058bc29d89f2425a243d277b7c1e5d0444fccedf2",
}

DATASET = Dataset(
    folder="water-entry-impack",
    repository="harrislab-brown/IMpack",
    commit="c5426acc9e67aef9ad1b4c96de5577d02b3d7a51",
    licence="CC BY-SA 4.0 (attribution, share alike for adapted data)",
    attribution="IMpack, Harris Lab, Brown University: https://github.com/harrislab-brown/IMpack.",
    note="The offline .npz files are an adaptation of the .ide recordings: the 40 g channel whole, "
    "the 100 g channel cut around the largest peak.",
    files=tuple(
        DataFile(
            path=f"data/water entry/{stem}.ide",
            sha256=None,
            offline=f"{stem}.npz",
            offline_sha256=checksum,
        )
        for stem, checksum in _OFFLINE.items()
    ),
)


class ImpackSensor(Enum):
    """The two accelerometers of the recorder."""

    DC = "dc"
    PIEZORESISTIVE = "pr"


_IDE_CHANNEL = {ImpackSensor.DC: 80, ImpackSensor.PIEZORESISTIVE: 8}
_RANGE_G = {ImpackSensor.DC: 42.0, ImpackSensor.PIEZORESISTIVE: 100.0}
_NAME = re.compile(r"^(?P<speed>\d+(?:\.\d+)?)mps_(?P<nose>[^_]+)_(?P<run>\d+)$")


@dataclass(kw_only=True)
class ReaderImpack:
    """Drops of a 44.45 mm impactor with a recorder on board into still water; one log each.

    Channels:
        ``specific_force_x/y/z``, with z along the fall axis (up before the drop).
    Units:
        g -> m/s^2 with 9.80665. Recorder axes 1, 2, 0 become x, y, z.
    Source:
        https://github.com/harrislab-brown/IMpack, 15 drops at 2, 4, 6 m/s nominal, hemisphere
        ("sphere") and 150 degree cone noses.
    Licence:
        CC BY-SA 4.0; adapted data stay under it.
    Limitations:
        The largest spike is the catch at the bottom, 0.1 to 0.2 s after the entry, not the water.
        The 40 g channel clips at 42 g, and its first 0.05 s are a filter transient. Where x and y
        point around the fall axis is not known; their handedness is assumed. The impactor's mass is
        not in the repository. The 100 g channel has a drifting offset. ``.ide`` recordings need the
        extra ``logs``.

    Args:
        path: a ``.npz`` or ``.ide`` file, a folder of them, or the stem of a published drop.
        sensor: the 40 g channel (DC, 2 kHz) or the 100 g one (20 kHz, around the peak only).
    """

    path: str = ""
    sensor: ImpackSensor = ImpackSensor.DC

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return one log for each drop.

        Raises:
            LogError: a file is absent or damaged.
            MissingExtra: a ``.ide`` file is given and ``idelib`` is not installed.
        """
        return [self._drop(path) for path in paths_of(DATASET, source or self.path or None)]

    def _drop(self, path: Path) -> Log:
        read = _from_ide if path.suffix.casefold() == ".ide" else _from_npz
        time, force_g = read(path, self.sensor)
        if force_g.ndim != 2 or force_g.shape[0] != 3 or force_g.shape[1] != time.size:
            raise LogError(f"'{path}': three axes for {time.size} times are needed.")
        x, y, z = to_si(force_g[[1, 2, 0]], "g")
        columns = {"t": time, "specific_force_x": x, "specific_force_y": y, "specific_force_z": z}
        return Log(
            name=path.stem,
            columns=columns,
            meta=_meta(path.stem, time, self.sensor),
            source=DATASET.source,
            licence=DATASET.licence,
        )


def _from_npz(path: Path, sensor: ImpackSensor) -> tuple[Floats, Floats]:
    names = (f"t_{sensor.value}", f"acc_{sensor.value}_g")
    arrays = read_npz(path, names)
    return arrays[names[0]].ravel(), arrays[names[1]]


def _from_ide(path: Path, sensor: ImpackSensor) -> tuple[Floats, Floats]:
    try:
        import idelib
    except ImportError as error:
        raise MissingExtra(
            f"'{path}' is an enDAQ recording, which needs idelib.\n"
            "Install it with: pip install 'aam-seals[logs]'"
        ) from error
    file = regular_file(path)
    try:
        with idelib.importFile(str(file)) as recording:
            session = recording.channels[_IDE_CHANNEL[sensor]].getSession()
            rows = np.asarray(session.arraySlice(), dtype=np.float64)
    except Exception as error:  # idelib lets errors of every kind through on damaged files
        raise LogError(f"'{path}' is not a valid enDAQ recording: {error}") from error
    # times come in microseconds
    return rows[0] * 1e-6, rows[1:4]


def _meta(stem: str, time: Floats, sensor: ImpackSensor) -> dict[str, Any]:
    match = _NAME.match(stem)
    rate = 1.0 / float(np.median(np.diff(time))) if time.size > 1 else 0.0
    channel: dict[str, Any] = {"rate": rate, "unit": "m/s^2"}
    channel["saturation"] = _RANGE_G[sensor] * STANDARD_GRAVITY
    if sensor is ImpackSensor.DC:
        # standard deviation over one second at rest, equal within 10 % on all 15 drops
        channel["sigma"] = 0.0024 * STANDARD_GRAVITY
    drop = {"nominal_speed": float(match["speed"]), "nose": match["nose"]} if match else {}
    return {
        "vehicle": {"name": "impactor", "diameter": 0.04445, "mass": None},
        "environment": {"gravity": [0.0, 0.0, -9.81], "water_level": 0.0},
        "sensors": {"channels": {"specific_force": channel}},
        "drop": drop,
        "notes": [
            "the largest spike is the catch at the bottom, not the water entry",
            "the impactor's mass is not published with the data",
        ],
    }
