"""Reader of the IMpack water-entry drops."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, MissingExtra
from seals.logs.arrays import read_npz
from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.units import STANDARD_GRAVITY, to_si
from seals.plugins.readers.published import ReaderPublished
from seals.untrusted_io import regular_file

DATASET = read_dataset("seals.plugins.readers", "water-entry-impack")


class ImpackSensor(Enum):
    """The two accelerometers of the recorder."""

    DC = "dc"
    PIEZORESISTIVE = "pr"


_IDE_CHANNEL = {ImpackSensor.DC: 80, ImpackSensor.PIEZORESISTIVE: 8}
_RANGE_G = {ImpackSensor.DC: 42.0, ImpackSensor.PIEZORESISTIVE: 100.0}
_NAME = re.compile(r"^(?P<speed>\d+(?:\.\d+)?)mps_(?P<nose>[^_]+)_(?P<run>\d+)$")


@dataclass(kw_only=True)
class ReaderImpack(ReaderPublished):
    """Drops of a 44.45 mm impactor with a recorder on board into still water; one log each.

    Channels:
        ``specific_force_x/y/z``, with z along the fall axis (up before the drop).
    Units:
        g -> m/s^2 with 9.80665. Recorder axes 1, 2, 0 become x, y, z.
    Source:
        https://github.com/harrislab-brown/IMpack, 15 drops at about 2, 4, 6 m/s, hemisphere
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

    dataset: ClassVar[Dataset] = DATASET
    sensor: ImpackSensor = ImpackSensor.DC

    def log_of(self, path: Path) -> Log:
        """Return one drop."""
        read = _from_ide if path.suffix.casefold() == ".ide" else _from_npz
        time, force_g = read(path, self.sensor)
        if force_g.ndim != 2 or force_g.shape[0] != 3 or force_g.shape[1] != time.size:
            raise LogError(f"'{path}': three axes for {time.size} times are needed.")
        x, y, z = to_si(force_g[[1, 2, 0]], "g")
        columns = {"t": time, "specific_force_x": x, "specific_force_y": y, "specific_force_z": z}
        rate = 1.0 / float(np.median(np.diff(time))) if time.size > 1 else 0.0
        channel: dict[str, Any] = {"rate": rate, "unit": "m/s^2"}
        channel["saturation"] = _RANGE_G[self.sensor] * STANDARD_GRAVITY
        if self.sensor is ImpackSensor.DC:
            # standard deviation over one second at rest, equal within 10 % on all 15 drops
            channel["sigma"] = 0.0024 * STANDARD_GRAVITY
        match = _NAME.match(path.stem)
        drop = {"nominal_speed": float(match["speed"]), "nose": match["nose"]} if match else {}
        meta = {"sensors": {"channels": {"specific_force": channel}}, "drop": drop}
        return self.described(path.stem, columns, meta=meta)


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
