"""CSV tables with a column map, and units."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from seals.errors import ConfigError, LogError
from seals.logs.channels import CHANNELS
from seals.logs.column_map import ColumnMap
from seals.logs.units import UNITS, find_unit, to_si
from seals.plugins.readers.csv import ReaderCsv
from seals.schema import read

TEXT = "stamp;acc;wz;rpm;p\n0;1.0;180;6000;1\n10;2.0;-90;3000;2\n"


def _file(place: Path, text: str = TEXT) -> Path:
    file = place / "flight.csv"
    file.write_text(text)
    return file


def _reader(**changes: object) -> ReaderCsv:
    columns = {
        "stamp": "t",
        "acc": "specific_force_z",
        "wz": "angular_velocity_z",
        "rpm": "rotor_speed_cmd_1",
        "p": "pressure",
    }
    units = {"stamp": "ms", "acc": "g", "wz": "deg/s", "rpm": "rpm", "p": "bar"}
    return ReaderCsv(**{"columns": columns, "units": units, "delimiter": ";", **changes})  # type: ignore[arg-type]


def test_units_are_converted_to_si(tmp_path: Path) -> None:
    """ms, g, deg/s, rpm and bar come out in SI."""
    (log,) = _reader().read(_file(tmp_path))
    assert log.time.tolist() == [0.0, 0.01]
    assert log.columns["specific_force_z"].tolist() == [9.80665, 19.6133]
    assert log.columns["angular_velocity_z"] == pytest.approx([math.pi, -math.pi / 2])
    assert log.columns["rotor_speed_cmd_1"][0] == pytest.approx(628.3185307)
    assert log.columns["pressure"].tolist() == [1e5, 2e5]


def test_signs_can_be_turned(tmp_path: Path) -> None:
    """A column listed in negate changes its sign, after the unit."""
    (log,) = _reader(negate=["acc"]).read(_file(tmp_path))
    assert log.columns["specific_force_z"][0] == -9.80665


def test_gzip_blanks_and_byte_order_mark_are_accepted(tmp_path: Path) -> None:
    """A packed file with a byte-order mark and blanks after commas is read."""
    file = tmp_path / "a.csv.gz"
    file.write_bytes(gzip.compress("\ufefft, depth\n0, 1.5\n1, 2.5\n".encode()))
    (log,) = ReaderCsv().read(file)
    assert log.columns["depth"].tolist() == [1.5, 2.5]


def test_lines_before_the_header_are_skipped(tmp_path: Path) -> None:
    """Two lines of preamble are left out."""
    (log,) = ReaderCsv(skip_lines=2).read(
        _file(tmp_path, "logger 3\nserial 7\nt,depth\n0,1\n1,2\n")
    )
    assert log.columns["depth"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"units": {"acc": "gees"}}, "the unit 'gees' is not known"),
        ({"units": {"acc": "deg"}}, r"a unit of \[rad\], this channel is in \[m/s\^2\]"),
        ({"units": {"acceleration": "g"}}, "'acceleration', which is not mapped"),
        ({"columns": {"stamp": "t", "ac": "depth"}, "units": {}}, "Did you mean 'acc'"),
        ({"columns": {"acc": "depth"}, "units": {}}, "no column is mapped to the time"),
        (
            {"columns": {"stamp": "t", "acc": "depth", "p": "depth"}, "units": {}},
            "mapped to depth",
        ),
    ],
)
def test_wrong_maps_are_refused_with_the_way_out(
    tmp_path: Path, changes: dict[str, object], words: str
) -> None:
    """Each wrong map or unit is refused, naming what would be right."""
    with pytest.raises(LogError, match=words):
        _reader(**changes).read(_file(tmp_path))


def test_wrong_options_are_refused_at_once() -> None:
    """A delimiter of two characters and a negative number of lines are refused."""
    with pytest.raises(LogError, match="one character"):
        ReaderCsv(delimiter=";;")
    with pytest.raises(ConfigError, match=r"reader\.skip_lines=-1 .*\n.*from 0 to"):
        read(ReaderCsv, {"skip_lines": -1}, where="reader")


@pytest.mark.parametrize(
    ("value", "unit", "si"),
    [
        (1.0, "ft", 0.3048),
        (36.0, "km/h", 10.0),
        (1.0, "knot", 0.514444),
        (25.0, "degC", 298.15),
        (10.0, "dbar", 1e5),
        (500.0, "cm^3", 5e-4),
        (16.0, "oz", 0.45359237),
        (50.0, "%", 0.5),
        (212.0, "degF", 373.15),
        (1.0, "gauss", 1e-4),
        (250.0, "mA", 0.25),
        (4500.0, "cdeg", math.pi / 4),
        (2.0, "mdeg/s", 3.490658504e-5),
        (1.0, "mph", 0.44704),
        (60.0, "RPM", 2 * math.pi),
        (1.0, "m/s2", 1.0),
    ],
)
def test_units_have_their_textbook_size(value: float, unit: str, si: float) -> None:
    """Conversion factors agree with the textbook."""
    assert to_si(np.array([value]), unit)[0] == pytest.approx(si, rel=1e-5)


def test_unknown_unit_suggests_a_near_one() -> None:
    """A misspelt unit is answered with the nearest."""
    with pytest.raises(LogError, match="Did you mean 'mbar'"):
        find_unit("mbarr")


def test_every_si_unit_is_itself_a_unit() -> None:
    """Each SI target is in the table with scale one."""
    for unit in {entry.si for entry in UNITS.values()}:
        assert UNITS[unit].scale == 1.0
        assert UNITS[unit].offset == 0.0


def test_every_channel_can_be_stated_in_its_own_unit() -> None:
    """A battery current in A and a magnetic field in T were refused."""
    assert not {channel.unit for channel in CHANNELS.values()} - set(UNITS)


def test_numbers_of_a_converter_have_a_factor_and_an_offset(tmp_path: Path) -> None:
    """A gyroscope of 16.4 counts for a degree per second; Hall sensor of 66 mV/A about 2.5 V."""
    file = _file(tmp_path, "t,w,i,p\n0,1640,2.83,1500\n1,-82,2.17,1100\n")
    names = {"t": "t", "w": "angular_velocity_x", "i": "battery_current", "p": "motor_pwm_1"}
    (log,) = ReaderCsv(
        columns=names,
        units={"w": "deg/s", "i": "A", "p": "us"},
        scale={"w": 1 / 16.4, "i": 1 / 0.066},
        offset={"i": -2.5 / 0.066},
        negate=["w"],
    ).read(file)
    assert np.degrees(log.columns["angular_velocity_x"]) == pytest.approx([-100.0, 5.0])
    assert log.columns["battery_current"] == pytest.approx([5.0, -5.0])
    assert log.columns["motor_pwm_1"] == pytest.approx([1500.0, 1100.0], rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"scale": {"acc": 0.0}}, "scale of 'acc' is 0"),
        ({"scale": {"acc": math.nan}}, "Allowed: a finite number"),
        ({"scale": {"acc": "two"}}, "Allowed: a finite number"),
        ({"offset": {"acc": True}}, r"offset\.acc=True is not allowed"),
        ({"scale": {"ac": 2.0}}, "scale names 'ac', which is not mapped.\nDid you mean 'acc'"),
    ],
)
def test_wrong_factors_are_refused(tmp_path: Path, changes: dict[str, object], words: str) -> None:
    """A factor of nothing, of no number or of no column."""
    with pytest.raises(LogError, match=words):
        _reader(**changes).read(_file(tmp_path))


def test_a_clock_of_ticks_is_counted_as_stated(tmp_path: Path) -> None:
    """A factor of the time column is not taken for a guess: 4096 ticks a second."""
    file = _file(tmp_path, "tick,depth\n0,1\n4096,2\n8192,3\n")
    reader = ReaderCsv(columns={"tick": "t", "depth": "depth"}, scale={"tick": 1 / 4096})
    assert reader.read(file)[0].time.tolist() == [0.0, 1.0, 2.0]
    assert ColumnMap(scale={"a": 2.0}, offset={"a": 1.0}).converted(np.ones(1), "a", "x") == [3.0]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"delimiter": ","}, "delimiter=';', skip_lines=2"),
        ({"skip_lines": 0}, "Use skip_lines=2"),
        ({"columns": {}, "units": {}, "skip_lines": 0, "delimiter": ","}, "skip_lines=2"),
    ],
)
def test_a_header_elsewhere_is_pointed_at(
    given: dict[str, object], said: str, tmp_path: Path
) -> None:
    """Lines of a recorder above the header, and semicolons: what to say is in the message."""
    file = _file(tmp_path, f"# a recorder\n#\n{TEXT}")
    with pytest.raises(LogError, match="Line 3 looks like the header: stamp;acc") as refused:
        _reader(**given).read(file)
    assert said in str(refused.value)
    (log,) = _reader(skip_lines=2).read(file)
    assert log.rows == 2
    # a name that is nowhere is compared with the columns, as before
    with pytest.raises(LogError, match="Did you mean 'stamp'"):
        _reader(skip_lines=2, columns={"stmp": "t"}).read(file)


def test_kilograms_force_are_newtons(tmp_path: Path) -> None:
    """Makers of thrusters state their forces so."""
    file = _file(tmp_path, "t,a,b\n0,1,500\n1,2,0\n")
    names = {"t": "t", "a": "thruster_cmd_1", "b": "thruster_cmd_2"}
    (log,) = ReaderCsv(columns=names, units={"a": "kgf", "b": "gf"}).read(file)
    assert log.channel("thruster_cmd")[0].tolist() == [9.80665, 4.903325]
