"""Text files as the programs of WitMotion write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.errors import LogError
from seals.plugins.readers.witmotion import ReaderWitmotion

# the desktop program: a line of start, tabs, blanks around values
OLD = (
    "StartTime: 2023-03-27 14:10:28.500\n"
    "Time(s)\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tT(°)\n"
    " 0.010\t 0.5\t 0.25\t 1.0\t 90\t 0\t -180\t 3\t 20\n"
    " 0.020\t 0.5\t 0.25\t 1.0\t 90\t 0\t -180\t 3\t 20\n"
)
# its successor: a device in each row, time of day, quaternions
NEW = (
    "time\tDeviceName\tAcceleration X(g)\tAcceleration Y(g)\tAcceleration Z(g)\t"
    "Angular velocity X(°/s)\tAngular velocity Y(°/s)\tAngular velocity Z(°/s)\t"
    "Angle X(°)\tQuaternions 0()\tQuaternions 1()\tQuaternions 2()\tQuaternions 3()\n"
    "2023-3-27 14:10:28.528\tWT901\t0.5\t0.25\t1.0\t90\t0\t-180\t3\t0.8\t0\t0\t0.6\n"
    "2023-3-27 14:10:28.538\tWT901\t0.5\t0.25\t1.0\t90\t0\t-180\t3\t0.8\t0\t0\t0.6\n"
)
PHONE = (
    "Time,DeviceName,AccX(g),AccY(g),AccZ(g),AsX(°/s),AsY(°/s),AsZ(°/s),AngleX(°)\n"
    " 23:59:59.995,WT,0.5,0.25,1.0,90,0,-180,3\n 00:00:00.005,WT,0.5,0.25,1.0,90,0,-180,3\n"
)
G = 9.80665


def _read(
    place: Path, text: str, coding: str = "utf-8", **values: object
) -> dict[str, list[float]]:
    file = place / "imu.txt"
    file.write_bytes(text.encode(coding))
    (log,) = ReaderWitmotion(**values).read(file)  # type: ignore[arg-type]
    found = {key: column.tolist() for key, column in log.columns.items()}
    return {**found, "segment": log.segment.tolist()}


@pytest.mark.parametrize(
    ("text", "coding"), [(OLD, "utf-8"), (NEW, "gb18030"), (PHONE, "utf-8-sig")]
)
def test_each_layout_becomes_the_same_columns(text: str, coding: str, tmp_path: Path) -> None:
    """Names, separators, code pages and clocks differ; the samples do not, over midnight too."""
    found = _read(tmp_path, text, coding)
    assert found["t"] == pytest.approx([0.0, 0.01])
    assert [found[f"specific_force_{a}"][1] for a in "xyz"] == pytest.approx([G / 2, G / 4, G])
    assert [found[f"angular_velocity_{a}"][0] for a in "xyz"] == pytest.approx(
        [np.pi / 2, 0.0, -np.pi]
    )
    assert ("orientation_w" in found) == (text is NEW)


def test_a_turned_sensor_is_turned_back(tmp_path: Path) -> None:
    """With its y axis backwards and x to the left, the columns are those of the body."""
    found = _read(tmp_path, NEW, axes=["-y", "x", "z"])
    assert [found[f"specific_force_{a}"][0] for a in "xyz"] == pytest.approx([-G / 4, G / 2, G])
    # the quaternion is that of the sensor, not of the body
    assert "orientation_w" not in found
    for axes in (["x", "y"], ["x", "y", "-z"], ["x", "x", "z"], ["x", "y", "w"]):
        with pytest.raises(LogError, match="right-handed"):
            ReaderWitmotion(axes=axes)


def test_repeated_stamps_are_spaced_by_the_rate(tmp_path: Path) -> None:
    """Programs write whole milliseconds twice; the rate of the device spaces the rows."""
    text = OLD.replace(" 0.020", " 0.010")
    assert _read(tmp_path, text)["t"] == [0.0, 0.0]
    assert _read(tmp_path, text, rate=200.0)["t"] == [0.0, 0.005]


def test_a_new_heading_begins_a_segment(tmp_path: Path) -> None:
    """Two recordings in one file are two runs; a last line that was cut off is left out."""
    found = _read(tmp_path, OLD + OLD.replace(" 0.0", " 5.0") + " 5.030\t 0.5")
    assert found["segment"] == [0, 0, 1, 1]
    assert found["t"] == pytest.approx([0.0, 0.01, 5.0, 5.01])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", "not a table of a WitMotion"),
        (OLD.replace("1.0", "one"), "is not a number"),
        (OLD.replace("\t 0.25", "", 1).replace("\t 3\t 20\n", "\n", 1) + OLD[36:], "too few"),
        (PHONE.replace("23:59:59.995", "25:99:59"), "not a time of day"),
        (OLD + NEW, "a second heading"),
    ],
)
def test_what_is_no_such_file_is_refused(text: str, words: str, tmp_path: Path) -> None:
    """Other tables, words for numbers and lines too short end in words."""
    with pytest.raises(LogError, match=words):
        _read(tmp_path, text)
