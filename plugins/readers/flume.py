"""Reader of the ship section in regular waves."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.errors import LogError, suggestion
from seals.logs.datasets import DataFile, Dataset, paths_of
from seals.logs.log import Log
from seals.logs.table import read_csv_columns

# stem, checksum of the public file (the offline one unpacked), checksum of the offline .csv.gz
_FILES = (
    (
        "1012",
        "1991c2142cd763936ef8fa0cbddd472875e6ba3e0c335701d4eab78d78a4a405",
        "20f3eea8e5a76ca57e7a5ae2bd574e9a59062cf98763407acadeeddc02542cc9",
    ),
    (
        "1031",
        "d0049dd97a2a55c3e03370b0051033692c4cbcfb2b72e24913f85e37d74667ed",
        "f9e7f9012c1cbb9bf0af887e3ee52f0859705982811e027c4b02eb7796a416eb",
    ),
    (
        "1041",
        "d3f005f39849730599427d53c2255e1d5bb9c01f5d479bfdb8ac6861b4e0786d",
        "87335841079cc268aa836c276a98238653a0a930ade46e02d873786b6809d3fb",
    ),
    (
        "1061",
        "0d16c7376b9b6dcd796e3d303d7e930af60529fb00bcb5d5e1b4146ed78e8e16",
        "e07f5344a56596cf17bbd639bbd3b61d1b1e0f50df314cdae6dfe5b0f458adc4",
    ),
    (
        "1101_1",
        "a9dcd0817db195e1c0fe2edaa6449ad0815478f4992949451fa3eb74edb8999b",
        "9cf0180a6e17c562037921337bc9b4d445f52a7dc86869d5913caa3d1b0777a2",
    ),
    (
        "1102",
        "03e62ca39f3a720b6634018a0ad11fe914fc3e90aeabdc81ee5f1ea890893bcc",
        "e3eb8cee391de2a941bb9773026508adeb99e11475a07b383cca459583a92192",
    ),
    (
        "1111",
        "80fc31150f1da41e5e78551f537186d27b3884c18888a856484068dd4def54be",
        "e468d5597e8111237c04361e288ed96595217ecafd2ad761856ac68ad86da436",
    ),
    (
        "3012_1",
        "eb536916b1290cdc29085ca5dd4828126efdcaf73e21aa3dfada12f6b475add2",
        "76e05aa6047f24bb710be6a07fbb6175ece600e516cf35e0604f5431cd0642f0",
    ),
    (
        "3031_2",
        "47a3dc0a2d67261e898f51575823e99309958f8892c324d141aaf891430686f2",
        "e2d78fd8ada99879ca8d757f96d250a8d6be033d08fa6c766cee91fd6a3b074b",
    ),
    (
        "3041_2",
        "16f32b878bcae41ee52436867ad75a6790ba5dd1c49bcfc973310158e4c8bd3f",
        "0482fe116a3acc2fb9f4ff87f9e7de301fca559d2fe9764cb22bd88e31467b6b",
    ),
    (
        "3061_1",
        "ab8f9b4f05bd9adfea69ed13ec8ac8465519a798d94e7ed67efc1b27e2194cfe",
        "2f479a67a379b94fe3454d15a4b79dbd8f4712eaa52a69468d2d5aa3a7e5bd20",
    ),
    (
        "3061_2",
        "cfee11dc59a9436fd2bc8a9c9175ab5fcadffba5000b40181d851e1128d390fb",
        "86775b5defe07b6f4b7c9e346050218ecd3865eb764cfd2dffbab7eabbb89b39",
    ),
    (
        "3101_3",
        "fb9b164cdf968bc7a7fe55b505b9be402d98154b3d80298fdf6e3fe2b7572bd8",
        "58c016512ff39ba1e28eaa27a951842ea45b1ed0e7d6cf8c809866cf29d9e0bb",
    ),
    (
        "3101_4",
        "f9a9a8a761447079611bf6966f6cac3bce8a0643eddb32fe0ed264ed84e427c7",
        "f61de86f772510ab996abcbe25dbb17352b6563ce95620ce39bc8c29357b7c97",
    ),
    (
        "3102_1",
        "d95eb8fb64256a649cd325b13c6bb58445b7884bd63f68325a5594f3615e1b6b",
        "4b1d672f93d4f16d7c6a7c070dc80c2cef05ed39af2df22c2345f72cf545788d",
    ),
    (
        "3102_2",
        "b710884be6f4592582168bb8749dbc3d7bc333665b446d15e08746e7dfb57fe8",
        "286607b4ebd6ed5ccfbd5e70bf1ba3e2cbb8b67785c5a5b3151e4b9a5ad99f55",
    ),
    (
        "3111_2",
        "3b03f61ef992f1454ec23e3d00f84b87e4eba3fcf9a255823cfb1edb3f2b506a",
        "f1ed6cb238413810a3c7ea096ad7aa03511512bb9835a23f095c4cfe50543183",
    ),
)

DATASET = Dataset(
    folder="wave-flume-ship-section",
    repository="KRSundsdal1/2D-ship-cross-section-in-regular-waves",
    commit="2465ceee234b7ad6973cb7d00d918546c57d8111",
    licence="CC0 1.0",
    attribution="Please cite Sundsdal, Greco, Hanssen, Lugni (2025).",
    note="The offline files are the public ones, gzip-compressed.",
    files=tuple(
        DataFile(
            path=f"data/{stem[0]}PPH/{stem}.csv",
            sha256=public,
            offline=f"{stem}.csv.gz",
            offline_sha256=packed,
        )
        for stem, public, packed in _FILES
    ),
)

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
class ReaderFlume:
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

    path: str = ""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return one log for each run.

        Raises:
            LogError: a file is absent, damaged or lacks a column.
        """
        return [_run(path) for path in paths_of(DATASET, source or self.path or None)]


def _run(path: Path) -> Log:
    raw = read_csv_columns(path)
    # headers write "WM_Position" or "WM_Position [m]", "ACC_HEAVE_PS" or "ACC_Heave_SB"
    plain = {name.split("[")[0].strip().casefold(): values for name, values in raw.items()}
    columns = {ours: plain[theirs] for theirs, ours in _COLUMNS.items() if theirs in plain}
    missing = [ours for ours in _NEEDED if ours not in columns]
    if missing:
        theirs = next(key for key, ours in _COLUMNS.items() if ours == missing[0])
        raise LogError(
            f"'{path}' has no column '{theirs}'.\n" + suggestion(theirs, raw, label="Columns there")
        )
    stem = path.name.split(".")[0]
    return Log(
        name=stem,
        columns=columns,
        meta=_meta(stem, columns),
        source=DATASET.source,
        licence=DATASET.licence,
    )


def _meta(stem: str, columns: dict[str, Floats]) -> dict[str, Any]:
    match = _NAME.match(stem)
    wave: dict[str, Any] = {}
    if match:
        height = _HEIGHT.get(match["height"])
        wave = {"index": match["wave"], "nominal_height": height}
        wave["angular_frequency"] = _FREQUENCY.get(match["wave"])
    step = float(np.median(np.diff(columns["t"]))) if columns["t"].size > 1 else 0.0
    rate = 1.0 / step if step > 0.0 else 0.0
    vehicle = {"name": "ship_section", "mass": 46.8, "length": 0.586, "beam": 0.40, "draft": 0.20}
    # standard deviations over the first two seconds, before the waves arrive
    sigma = {"wave_elevation": 6.5e-5, "spring_tension": 5e-3, "heave_acceleration": 1e-3}
    sigma["sway_acceleration"] = 3e-4
    channels: dict[str, Any] = {key: {"sigma": s, "rate": rate} for key, s in sigma.items()}
    channels["position"] = {"rate": 20.0, "unit": "m"}
    return {
        "vehicle": vehicle if "position_z" in columns else None,
        "environment": {
            "gravity": [0.0, 0.0, -9.81],
            "water_level": 0.0,
            "tank_bottom": -1.0,
            "tank_width": 0.6,
            "water_density": 1000.0,
        },
        "baseline": [{"name": "gravity"}, {"name": "buoyancy", "medium": "water"}],
        "sensors": {"channels": channels},
        "wave": wave,
        "notes": [
            "mass is the displaced mass, heave rig included",
            "the pose is resampled from 20 Hz",
        ],
    }
