"""Tables of blackbox_decode: units of the header, axes of Betaflight, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.errors import ConfigError, LogError
from seals.logs.log import Log
from seals.plugins.readers.betaflight import ReaderBetaflight
from seals.schema import read

TITLES = (
    "loopIteration, time (us), axisP[0], rcCommand[0], vbatLatest (V), amperageLatest (A), "
    "BaroAlt (cm), gyroADC[0]{w}, gyroADC[1]{w}, gyroADC[2]{w}, accSmooth[0]{a}, accSmooth[1]{a}, "
    "accSmooth[2]{a}, motor[0], motor[1], motor[2], motor[3], eRPM[0], flightModeFlags (flags)"
)
"""As blackbox_decode 0.4 writes them."""


def table(w: str = " (deg/s)", a: str = " (g)", g: float = 1.0) -> str:
    """Three rows: the vehicle rolls to the right, the nose goes down, it turns to the left."""
    rows = [
        f"{k}, {30_280_941 + 1000 * k}, 0, -2, 16.5, 5.97, 120, 180.00, 90.00, 45.00, "
        f"{0.5 * g}, {-0.25 * g}, {1.0 * g}, 138, 156, 147, 138, 70, ANGLE_MODE"
        for k in range(3)
    ]
    return "\n".join([TITLES.format(w=w, a=a), *rows]) + "\n"


def _read(place: Path, text: str | None = None, **fields: object) -> Log:
    file = place / "flight.01.csv"
    file.write_text(table() if text is None else text)
    (log,) = ReaderBetaflight(**fields).read(file)  # type: ignore[arg-type]
    return log


def test_units_are_those_of_the_header(tmp_path: Path) -> None:
    """deg/s, g, us, V and A; roll to the right is positive about x forward, and so on."""
    log = _read(tmp_path)
    assert log.time == pytest.approx([30.280941, 30.281941, 30.282941])
    assert log.channel("angular_velocity")[0] == pytest.approx(np.radians([180.0, 90.0, 45.0]))
    assert log.channel("specific_force")[0] == pytest.approx([4.903325, -2.4516625, 9.80665])
    assert log.columns["battery_voltage"][0] == 16.5
    assert log.columns["battery_current"][0] == 5.97
    assert log.channel("motor_pwm")[0].tolist() == [138.0, 156.0, 147.0, 138.0]
    # 7000 turns of the field a minute, of 7 pairs of poles
    assert log.columns["rotor_speed_1"] == pytest.approx(np.full(3, 1000.0 * 2 * np.pi / 60))


def test_other_units_of_the_decoder(tmp_path: Path) -> None:
    """rad/s and m/s^2 as the decoder can write them."""
    log = _read(tmp_path, table(" (rad/s)", " (m/s2)"))
    assert log.channel("angular_velocity")[0].tolist() == [180.0, 90.0, 45.0]
    assert log.channel("specific_force")[0].tolist() == [0.5, -0.25, 1.0]


def test_counts_need_their_size(tmp_path: Path) -> None:
    """Without units numbers are counts; their size is asked for, with the command."""
    raw = table("", "", 2048.0)
    with pytest.raises(LogError, match=r"no unit.*\nDecode it by blackbox_decode --unit-rotation"):
        _read(tmp_path, raw)
    log = _read(tmp_path, raw, gyro_scale=1.0, acc_1g=2048.0)
    assert log.channel("angular_velocity")[0] == pytest.approx(np.radians([180.0, 90.0, 45.0]))
    assert log.channel("specific_force")[0] == pytest.approx([4.903325, -2.4516625, 9.80665])


def test_further_columns_are_mapped(tmp_path: Path) -> None:
    """A column is named without its unit; one of one's own takes the place of a known one."""
    log = _read(tmp_path, columns={"BaroAlt": "position_z", "axisP[0]": "motor_pwm_1"},
                units={"BaroAlt": "cm"}, poles=12)  # fmt: skip
    assert log.columns["position_z"] == pytest.approx(np.full(3, 1.2))
    assert log.columns["motor_pwm_1"].tolist() == [0.0] * 3
    assert log.columns["rotor_speed_1"] == pytest.approx(np.full(3, 7000 / 6 * 2 * np.pi / 60))
    with pytest.raises(LogError, match="has no column 'baroalt'"):
        _read(tmp_path, columns={"baroalt": "position_z"})


def test_the_viewer_writes_lines_above_the_header(tmp_path: Path) -> None:
    """They are passed over."""
    above = '"Product","Blackbox flight data recorder by Nicholas Sherlock"\n"acc_1G",2048\n'
    assert _read(tmp_path, above + table()).rows == 3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("H Product:Blackbox flight data recorder\nH Data version:2\n", "Decode it: blackbox_deco"),
        ("t,depth\n0,1\n1,2\n", "no line begins with loopIteration"),
        (table(" (grad/s)"), "the unit 'grad/s' is not known"),
        (table(" (g)"), r"a unit of \[m/s\^2\], this channel is in \[rad/s\]"),
    ],
)
def test_what_is_no_such_table_is_refused(text: str, words: str, tmp_path: Path) -> None:
    """The log itself with the command that decodes it, other tables, unknown units."""
    with pytest.raises(LogError, match=words):
        _read(tmp_path, text)


def test_wrong_options_are_refused() -> None:
    """A motor has two poles at least."""
    with pytest.raises(ConfigError, match=r"reader\.poles=1 .*\n.*from 2 to"):
        read(ReaderBetaflight, {"poles": 1}, where="reader")
