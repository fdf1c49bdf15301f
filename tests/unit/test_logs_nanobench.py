"""The public tables of NanoBench: names, units and time of a table written by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.errors import LogError
from seals.plugins.readers.nanobench import ReaderNanobench

NAMES = [
    "t", "px", "py", "pz", "qx", "qy", "qz", "qw", "imu_acc_x", "imu_acc_y", "imu_acc_z",
    "imu_gyro_x", "imu_gyro_y", "imu_gyro_z", "motor_motor_m1", "motor_motor_m2",
    "motor_motor_m3", "motor_motor_m4", "est_stateEstimate_x", "est_stateEstimate_y",
    "est_stateEstimate_z", "pwr_pm_vbat", "roll",
]  # fmt: skip
ROW = [1, 2, 3, 0, 0, 0, 1, 0, 0, 1, 0.1, 0.2, 0.3, 65535, 32767.5, 0, 0, 1, 2, 3, 4.1, 9]


def _table(place: Path, names: list[str]) -> Path:
    rows = [",".join(map(str, [1772681267.7 + 0.01 * k, *ROW[: len(names) - 1]])) for k in range(9)]
    file = place / "flight.csv"
    file.write_text(",".join(names) + "\n" + "\n".join(rows) + "\n")
    return file


def test_a_public_table_becomes_si_from_time_zero(tmp_path: Path) -> None:
    """Acceleration of g, pulse widths of 16 bits and calendar time are converted."""
    (log,) = ReaderNanobench().read(_table(tmp_path, NAMES))
    assert log.time[:2] == pytest.approx([0.0, 0.01], abs=1e-6)
    assert log.channel("specific_force")[0] == pytest.approx([0.0, 0.0, 9.80665])
    assert log.channel("motor_pwm")[0] == pytest.approx([1.0, 0.5, 0.0, 0.0])
    assert log.channel("orientation")[0].tolist() == [1.0, 0.0, 0.0, 0.0]
    assert log.channel("position")[0].tolist() == [1.0, 2.0, 3.0]
    assert not log.has("roll")


def test_another_table_is_refused(tmp_path: Path) -> None:
    """A table without its columns is no flight of the set."""
    with pytest.raises(LogError, match="is no NanoBench flight"):
        ReaderNanobench().read(_table(tmp_path, [*NAMES[:-2], "volts"]))
