"""Reader of the NanoBench flights of a Crazyflie under motion capture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from seals.errors import LogError, suggestion
from seals.logs.datasets import DataFile, Dataset, paths_of
from seals.logs.log import Log
from seals.logs.table import read_csv_columns, read_parquet
from seals.logs.units import STANDARD_GRAVITY

# checksums of the offline form; the public tables were not compared
_FLIGHTS = {
    "B10_lissajous_fast_rep1": "2ea8a21c191c8f243f9c7e04eea2e96496ce11ee50ef7ebb8f3a96e04c605760",
    "B2_circle_fast_rep2": "c4e94f17a50d48bf924d5c5115fd42896bab423bedb260b3a3dc21e22ed4ddc9",
    "B2_circle_slow_rep2": "ae8d0087a0c54228f7761d4dd56ffa5072a3882178ca69f77420221f87d3d9a3",
    "B3_figure8_fast_rep1": "d74198c12371057479d18722009fcac003a37f64cd17b2d202aeeb627d89dc4a",
    "B3_figure8_medium_rep3": "6d3534ebf9d307e2631ff0c3f88899b043b311889b6c60311b5966b141aeb128",
    "B5_helix_fast_mell_rep1": "09039325b7912a165c042a2200fef692a514b96c6500374094dd4deaef65fb63",
    "B5_helix_fast_rep1": "2e5b8fb90a2a3e86d3b7e8ba9883f0def8ce9242905e188c369f2c9bbf9cda23",
    "B6_linear_ramp_rep2": "ce08f748be78a8da4a0768810e435febafe3ae8a06afd65015d6334a153f36b2",
    "B7_oval_fast_rep2": "30c4ab1f5e3232a204ae30523bfdfe692f31b9f1494642b4a7909982ab54226e",
    "B8_star_fast_rep1": "3648dbe873c3740b1d9720b9412aecb886d0202f42dfef3c9dccce00dc601787",
    "B9_trefoil_fast_rep12": "3cb7e38188931a5b0fc44bb0d7107eccde4c0bda7f9e599717c148e8dc304875",
    "B9_trefoil_medium_rep13": "66559e2a653218e4c6b06e509facd5dfc606866b48d14054ea89237ad9ee368f",
    "B9_trefoil_medium_rep14": "38b57eab7008cd7517bf463f369203939ddfdff4e0735dc0e0ad19149864d3e4",
}
DATASET = Dataset(
    folder="nanobench/flights",
    repository="syediu/nanobench-iros2026",
    commit="0ae7d689749db174dc779ab2f7c416cc12e14e2b",
    licence="BSD-3-Clause",
    attribution="Cite Ullah and Baca, NanoBench, arXiv 2603.09908 (2026).",
    note="The offline tables have other names of columns, SI units, and start at the take-off.",
    files=tuple(
        DataFile(
            path=f"datasets/dataset/{name}.csv",
            sha256=None,
            offline=f"{name}.parquet",
            offline_sha256=checksum,
        )
        for name, checksum in _FLIGHTS.items()
    ),
)
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
class ReaderNanobench:
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

    path: str = ""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return one log for each flight.

        Raises:
            LogError: a table is absent, damaged or lacks a column.
        """
        return [_flight(path) for path in paths_of(DATASET, source or self.path or None)]


def _flight(path: Path) -> Log:
    table = read_parquet(path) if path.suffix == ".parquet" else read_csv_columns(path)
    known = _OFFLINE if "t_s" in table else _PUBLIC
    missing = [name for name in known if name not in table]
    if missing:
        raise LogError(
            f"'{path}' has no column '{missing[0]}': it is no NanoBench flight.\n"
            + suggestion(missing[0], table)
        )
    columns = {ours: scale * table[theirs] for theirs, (ours, scale) in known.items()}
    if columns["t"].size == 0:
        raise LogError(f"'{path}' has no rows.\nWas it copied completely?")
    columns["t"] = columns["t"] - columns["t"][0]
    name = path.name.split(".parquet")[0].split(".csv")[0]
    published = name in _FLIGHTS
    return Log(
        name=name,
        columns=columns,
        meta={
            "vehicle": {"name": "crazyflie", "mass": 0.027},
            "environment": {"gravity": [0.0, 0.0, -9.81], "water_level": None, "air_density": 1.2},
            "motor_command": "speed_share",
        },
        source=DATASET.source if published else str(path),
        licence=DATASET.licence if published else "",
    )
