"""Reader of the NanoBench flights of a Crazyflie under motion capture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from seals.errors import LogError
from seals.logs.datasets import Dataset, read_dataset
from seals.logs.log import Log
from seals.logs.table import read_csv_columns, read_parquet
from seals.logs.units import STANDARD_GRAVITY
from seals.plugins.readers.published import ReaderPublished, refuse_lacking

DATASET = read_dataset("seals.plugins.readers", "nanobench/flights")
_FULL_PWM = 65535.0
_BODY = ("x", "y", "z")
_PUBLIC = {
    "t": ("t", 1.0),
    **{f"p{a}": (f"position_{a}", 1.0) for a in _BODY},
    **{f"q{a}": (f"orientation_{a}", 1.0) for a in "wxyz"},
    **{f"imu_gyro_{a}": (f"angular_velocity_{a}", 1.0) for a in _BODY},
    **{f"imu_acc_{a}": (f"specific_force_{a}", STANDARD_GRAVITY) for a in _BODY},
    **{f"motor_motor_m{k}": (f"motor_pwm_{k}", 1.0 / _FULL_PWM) for k in (1, 2, 3, 4)},
    **{f"est_stateEstimate_{a}": (f"estimated_position_{a}", 1.0) for a in _BODY},
    "pwr_pm_vbat": ("battery_voltage", 1.0),
}
_OFFLINE = {
    "t_s": ("t", 1.0),
    **{f"{a}_m": (f"position_{a}", 1.0) for a in _BODY},
    **{f"q{a}": (f"orientation_{a}", 1.0) for a in "wxyz"},
    **{f"gyro_{a}_rad_s": (f"angular_velocity_{a}", 1.0) for a in _BODY},
    **{f"accel_{a}_m_s2": (f"specific_force_{a}", 1.0) for a in _BODY},
    **{f"pwm_{k}": (f"motor_pwm_{k}", 1.0) for k in (1, 2, 3, 4)},
    **{f"ekf_{a}_m": (f"estimated_position_{a}", 1.0) for a in _BODY},
    "battery_V": ("battery_voltage", 1.0),
}


@dataclass(kw_only=True)
class ReaderNanobench(ReaderPublished):
    """Flights of a 27 g quadrotor under motion capture; one log for each file.

    Channels:
        ``position``, ``orientation`` (motion capture), ``angular_velocity``, ``specific_force``,
        ``motor_pwm_1..4``, ``battery_voltage``, ``estimated_position`` (on board).
    Units:
        g -> m/s^2 with 9.80665, 16-bit pulse width -> share of full; the rest is SI already.
    Source:
        https://github.com/syediu/nanobench-iros2026, 13 flights of 23 to 41 s at 100 Hz.
    Licence:
        BSD 3-Clause.
    Limitations:
        Lost radio packets were filled by interpolation, lost links by straight lines, which the
        check of a log finds. On-board channels are early or late against the pose by up to some
        hundredths of a second. Mass is the publisher's figure.

    Args:
        path: a table, the folder of a published set, or the name of one of its flights.
    """

    dataset: ClassVar[Dataset] = DATASET

    def log_of(self, path: Path) -> Log:
        """Return one flight."""
        table = read_parquet(path) if path.suffix == ".parquet" else read_csv_columns(path)
        known = _OFFLINE if "t_s" in table else _PUBLIC
        refuse_lacking(path, known, table, "NanoBench flight")
        columns = {ours: scale * table[theirs] for theirs, (ours, scale) in known.items()}
        if columns["t"].size == 0:
            raise LogError(f"'{path}' has no rows.\nWas it copied completely?")
        columns["t"] = columns["t"] - columns["t"][0]
        name = path.name.split(".parquet")[0].split(".csv")[0]
        return self.described(name, columns, of=path)
