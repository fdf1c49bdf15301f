"""MATLAB files as SciPy and h5py write them, with a map; and hostile ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from seals.errors import LogError
from seals.plugins.readers.matlab import ReaderMatlab

TIME = 0.01 * np.arange(50)
GYRO = np.stack([10.0 * np.sin(TIME), 20.0 * np.cos(TIME), TIME], axis=1)
NAMES = {
    "log.t": "t",
    "log.imu.gyro[0]": "angular_velocity_x",
    "log.imu.gyro[1]": "angular_velocity_y",
    "gauge": "depth",
}
UNITS = {"log.imu.gyro[0]": "deg/s", "log.imu.gyro[1]": "deg/s", "gauge": "cm"}


def _classic(place: Path, **more: Any) -> Path:
    """MATLAB 7: a structure with a column and a matrix, an array beside it, and text."""
    file = place / "flight.mat"
    content = {"log": {"t": TIME[:, None], "imu": {"gyro": GYRO}}, "gauge": 100.0 * TIME + 50.0}
    savemat(file, {**content, "pilot": "nobody", **more}, do_compression=True)
    return file


def _modern(place: Path) -> Path:
    """MATLAB 7.3: HDF5 behind 512 bytes of text; MATLAB counts the columns of a matrix first."""
    h5py = pytest.importorskip("h5py", reason="h5py is not installed")
    file = place / "flight.mat"
    with h5py.File(file, "w", userblock_size=512) as out:
        out["log/t"] = TIME[None, :]
        out["log/imu/gyro"] = GYRO.T
        out["gauge"] = (100.0 * TIME + 50.0)[None, :]
        out["pilot"] = np.frombuffer(b"nobody", dtype=np.uint8).astype(np.uint16)[:, None]
        out["pilot"].attrs["MATLAB_class"] = np.bytes_("char")
        out["elsewhere"] = h5py.ExternalLink("/etc/passwd", "x")
        out["loop"] = h5py.SoftLink("/log")
        out.create_dataset("outside", (3,), "f8", external=[("/etc/hostname", 0, 24)])
    with file.open("r+b") as head:
        head.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    return file


@pytest.mark.parametrize("write", [_classic, _modern])
def test_arrays_become_channels(write: Any, tmp_path: Path) -> None:
    """Columns of matrices, fields of structures and units, as in a CSV table."""
    (log,) = ReaderMatlab(columns=NAMES, units=UNITS, negate=["log.imu.gyro[1]"]).read(
        write(tmp_path)
    )
    assert log.name == "flight"
    assert log.time == pytest.approx(TIME)
    assert log.columns["angular_velocity_x"] == pytest.approx(np.radians(10.0 * np.sin(TIME)))
    assert log.columns["angular_velocity_y"] == pytest.approx(np.radians(-20.0 * np.cos(TIME)))
    assert log.columns["depth"] == pytest.approx(TIME + 0.5)


@pytest.mark.parametrize("write", [_classic, _modern])
def test_text_is_no_column_and_is_named(write: Any, tmp_path: Path) -> None:
    """An unknown array is answered with those there, and with what could not be one."""
    with pytest.raises(LogError, match=r"Did you mean 'gauge'.*\nNot columns of numbers: .*pilot"):
        ReaderMatlab(columns={**NAMES, "gaug": "range"}).read(write(tmp_path))


def test_a_file_opens_no_other_file(tmp_path: Path) -> None:
    """Links and data in other files are left alone."""
    file = _modern(tmp_path)
    for name in ("elsewhere", "loop.t", "outside"):
        with pytest.raises(LogError, match=f"has no array '{name}'"):
            ReaderMatlab(columns={**NAMES, name: "range"}).read(file)


def test_arrays_of_another_clock_are_refused(tmp_path: Path) -> None:
    """Fewer rows than the time has: what to do is said."""
    file = _classic(tmp_path, slow=np.arange(9.0))
    with pytest.raises(LogError, match=r"'slow' has 9 rows, the time 'log.t' has 50\.\nMap arrays"):
        ReaderMatlab(columns={**NAMES, "slow": "range"}).read(file)
    with pytest.raises(LogError, match="no array is mapped to the time"):
        ReaderMatlab(columns={"gauge": "depth"}).read(file)


def test_without_a_map_arrays_have_their_own_names(tmp_path: Path) -> None:
    """Arrays called as columns of a log need no map; those of other lengths stay out."""
    file = tmp_path / "a.mat"
    savemat(file, {"t": TIME, "depth": TIME + 1.0, "mass": 2.0})
    (log,) = ReaderMatlab().read(file)
    assert log.columns["depth"] == pytest.approx(TIME + 1.0)
    assert "mass" not in log.columns


@pytest.mark.parametrize(
    "raw",
    [
        b"MATLAB 5.0 MAT-file" + bytes(200),
        b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n" + bytes(100),
        bytes(range(256)) * 4,
    ],
)
def test_broken_files_are_refused(raw: bytes, tmp_path: Path) -> None:
    """Damage ends in words."""
    file = tmp_path / "a.mat"
    file.write_bytes(raw)
    with pytest.raises(LogError, match=r"cannot be read|no array"):
        ReaderMatlab(columns=NAMES).read(file)
