"""Reader of the CrazyPAD flights of a Crazyflie with cut propellers and added weights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from seals.errors import LogError
from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.table import read_parquet
from seals.plugins.readers.published import ReaderPublished, refuse_lacking

DATASET = read_dataset("seals.plugins.readers", "crazypad/flights")
_BODY = ("x", "y", "z")
_NEEDED = {
    "t_s": "t",
    **{f"command_{k}": f"motor_pwm_{k}" for k in (1, 2, 3, 4)},
    **{f"{a}_m": f"estimated_position_{a}" for a in _BODY},
}
_PRESENT_IN_SOME = {
    "battery_V": "battery_voltage",
    **{f"gyro_{a}_rad_s": f"angular_velocity_{a}" for a in _BODY},
    "accel_z_m_s2": "specific_force_z",
}


@dataclass(kw_only=True)
class ReaderCrazypad(ReaderPublished):
    """Flights of a 27 g quadrotor, unmodified and modified on purpose; one log for each file.

    Channels:
        ``motor_pwm_1..4`` (share of full thrust before the battery's compensation),
        ``estimated_position`` (on board); motor logs: ``battery_voltage``; controller logs:
        ``angular_velocity``, ``specific_force_z``.
    Units:
        SI already; commands are shares, nominally 0.1471 N each at full.
    Source:
        https://github.com/AerialRoboticsUUST/CrazyPAD, 173 flights of 26 s at 100 Hz.
    Licence:
        MIT.
    Limitations:
        The public files are binary logs of another layout and are not read: offline tables only.
        No reference camera, no attitude. The mass that flew is not known. Controller logs hold no
        motor commands; those here follow from the mixer.

    Args:
        path: a table, the folder of the published set, or the name of one of its flights.
    """

    dataset: ClassVar[Dataset] = DATASET

    def log_of(self, path: Path) -> Log:
        """Return one flight."""
        if path.suffix != ".parquet":
            raise LogError(
                f"'{path}' is not a table of a CrazyPAD flight.\n"
                "The offline form is required, a .parquet file with t_s and command_1..4."
            )
        table = read_parquet(path)
        refuse_lacking(path, _NEEDED, table, "CrazyPAD flight")
        known = {**_NEEDED, **_PRESENT_IN_SOME}
        columns = {ours: table[theirs] for theirs, ours in known.items() if theirs in table}
        return self.described(path.stem, columns, of=path)
