"""DataFlash logs of ArduPilot: the same numbers as pymavlink reads, and broken files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from seals.errors import LogError
from seals.logs.log import Log
from seals.plugins.readers.dataflash import ReaderDataflash

reading = pytest.importorskip("pymavlink.DFReader", reason="pymavlink is not installed")

COUNT = 40
STEP = 10_000
CODES = {"c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "n": "4s", "N": "16s", "Z": "64s"}
FORMATS = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "PARM": (64, "QNf", "TimeUS,Name,Value"),
    "MSG": (65, "QZ", "TimeUS,Message"),
    "IMU": (66, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "ATT": (67, "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw"),
    "XKF1": (68, "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD"),
    "GPS": (69, "QBBLLefff", "TimeUS,I,Status,Lat,Lng,Alt,Spd,GCrs,VZ"),
    "BAT": (70, "QBffB", "TimeUS,Instance,Volt,Curr,RemPct"),
    "RCOU": (71, "QHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6"),
    "ESC": (72, "QBe", "TimeUS,Instance,RPM"),
    "MAG": (73, "QBhhh", "TimeUS,I,MagX,MagY,MagZ"),
    "CTUN": (74, "Qff", "TimeUS,Alt,BAlt"),
    "RFND": (75, "QBCB", "TimeUS,Instance,Dist,Stat"),
    "RCO2": (77, "Ihh", "TimeMS,Chan1,Chan2"),
    "GPS2": (78, "BIHLLefffI", "Status,TimeMS,Week,Lat,Lng,Alt,Spd,GCrs,VZ,T"),
    "PIDR": (76, "Qff", "TimeUS,P,I"),
}


def packed(name: str, *values: object) -> bytes:
    """One message, as ArduPilot packs it: whole numbers of hundredths and so on."""
    kind, letters, _ = FORMATS[name]
    layout = "<" + "".join(CODES.get(letter, letter) for letter in letters)
    return b"\xa3\x95" + bytes([kind]) + struct.pack(layout, *values)


def declared(name: str) -> bytes:
    """The declaration of a message."""
    kind, letters, labels = FORMATS[name]
    size = 3 + struct.calcsize("<" + "".join(CODES.get(one, one) for one in letters))
    return packed("FMT", kind, size, name.encode(), letters.encode(), labels.encode())


def flight(vehicle: str = "ArduSub V4.1.0 (89639005)") -> bytes:
    """A log in which the vehicle faces east, level, and moves north-west and down."""
    raw = b"".join(declared(name) for name in FORMATS)
    raw += packed("MSG", 1, vehicle.encode())
    for output, function in ((1, 34), (2, 33), (3, 0), (5, 35)):
        raw += packed("PARM", 1, f"SERVO{output}_FUNCTION".encode(), float(function))
    for motor, way in ((1, 1.0), (2, -1.0), (3, -1.0)):
        raw += packed("PARM", 1, f"MOT_{motor}_DIRECTION".encode(), way)
    for k in range(COUNT):
        t = 5_000_000 + STEP * k
        raw += packed("IMU", t, 0, 0.1, 0.2, 0.3 + k, 0.5, 0.25, -9.8125)
        raw += packed("IMU", t + 7, 1, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0)
        raw += packed("ATT", t, 0, 0, 0, 0, 0, 9000)
        raw += packed("XKF1", t + 1, 0, 4.0, -0.5, 0.25, 1.0, 2.0, -3.0 + k)
        raw += packed("GPS", t, 0, 3 if k else 1, 471234567 + 90 * k, -85, 1234, 5.0, 90.0, -0.5)
        raw += packed("BAT", t, 0, 15.5, 4.0, 75)
        raw += packed("RCOU", t, 1500, 1600 + k, 1100, 1200, 1900, 0)
        raw += packed("ESC", t, 0, 600_000) + packed("ESC", t, 1, 300_000)
        raw += packed("MAG", t, 0, 200, -100, 400)
        raw += packed("CTUN", t, -3.0, -2.5)
        raw += packed("RFND", t, 0, 123, 4 if k else 2)
        raw += packed("PIDR", t, 1.5, float(k))
    return raw


def _read(place: Path, raw: bytes | None = None, **fields: object) -> Log:
    file = place / "flight.bin"
    file.write_bytes(flight() if raw is None else raw)
    (log,) = ReaderDataflash(**fields).read(file)  # type: ignore[arg-type]
    return log


def _theirs(place: Path, name: str, field: str, instance: int | None = None) -> np.ndarray:
    """Stamps and numbers of a field as pymavlink reads them."""
    own = reading.DFReader_binary(str(place / "flight.bin"), zero_time_base=True)
    found = []
    while (message := own.recv_match(type=[name])) is not None:
        if instance in (None, getattr(message, "I", instance)):
            found.append((message.TimeUS, getattr(message, field)))
    own.data_map.close()
    own.filehandle.close()
    return np.array(found)


def test_numbers_are_those_of_pymavlink(tmp_path: Path) -> None:
    """Every mapped field, with the factor of its letter, at its own time."""
    keys = {"ATT/Yaw": "a", "GPS/Lat": "b", "RFND/Dist": "c", "MAG/MagX": "d", "PIDR/I": "e",
            "RCOU/C2": "f", "ESC/RPM": "g", "IMU:1/GyrX": "h", "GPS/Alt": "i"}  # fmt: skip
    log = _read(tmp_path, columns=keys)
    for key, column in keys.items():
        name, _, field = key.partition("/")
        bare, _, second = name.partition(":")
        theirs = _theirs(tmp_path, bare, field, int(second) if second else None)
        if bare == "ESC":
            theirs = theirs[::2]
        held = np.isfinite(log.columns[column])
        assert log.columns[column][held] == pytest.approx(theirs[:, 1], rel=1e-12)
        stamps = log.time[held] + log.meta["recording"]["start"]
        assert stamps == pytest.approx(theirs[:, 0] * 1e-6, abs=1e-9)


def test_frames_and_units_are_ours(tmp_path: Path) -> None:
    """Facing east is no turn in ENU; down is up; hundredths, rpm and mGauss are SI."""
    log = _read(tmp_path)

    def first(stem: str) -> list[float]:
        values = log.channel(stem)
        return [float(x) for x in values[np.isfinite(values).all(axis=1)][0]]

    assert np.abs(first("orientation")) == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-7)
    assert first("angular_velocity") == pytest.approx([0.1, -0.2, -0.3])
    assert first("specific_force") == pytest.approx([0.5, -0.25, 9.8125])
    assert first("position") == pytest.approx([2.0, 1.0, 3.0])
    # north is to the left of one who faces east; the west is behind
    assert first("velocity") == pytest.approx([-0.5, 4.0, -0.25], abs=1e-6)
    assert first("gps_velocity") == pytest.approx([5.0, 0.0, 0.5], abs=1e-12)
    assert first("magnetic_field") == pytest.approx([2e-5, 1e-5, -4e-5])
    assert first("rotor_speed") == pytest.approx([628.3185307, 314.1592654])
    assert [first(s)[0] for s in ("battery_voltage", "battery_current", "battery_charge")] == (
        pytest.approx([15.5, 4.0, 0.75])
    )
    assert first("depth") == [2.5]
    assert first("range") == pytest.approx([1.23])
    assert log.meta["firmware"] == "ArduSub V4.1.0 (89639005)"


def test_gps_without_a_fix_is_no_place(tmp_path: Path) -> None:
    """The first fix is the origin: 90e-7 degrees along the meridian at 47 degrees are 1.0007 m."""
    log = _read(tmp_path)
    north = log.columns["gps_position_y"]
    north = north[np.isfinite(north)]
    assert north.size == COUNT - 1
    assert np.diff(north) == pytest.approx(np.full(COUNT - 2, 1.0007), rel=2e-4)


def test_motors_are_those_of_the_parameters(tmp_path: Path) -> None:
    """Output 2 drives motor 1, output 1 motor 2, output 5 motor 3; the others are no motors."""
    log = _read(tmp_path)
    assert log.channel("motor_pwm")[0].tolist() == [1600.0, 1500.0, 1900.0]
    assert log.meta["motor_command"] == "pwm"
    bare = flight().replace(b"SERVO", b"RCVER")
    log = _read(tmp_path, bare)
    assert log.channel("motor_pwm")[0].tolist() == [1500.0, 1600.0, 1100.0, 1200.0, 1900.0]


def test_logs_of_2014_have_another_clock(tmp_path: Path) -> None:
    """Milliseconds; those of a GPS count from the start of the week, and T from that of the log."""
    raw = b"".join(declared(name) for name in ("FMT", "RCO2", "GPS2"))
    for k in range(5):
        raw += packed("RCO2", 6000 + 100 * k, 1500, 1100 + k)
        place = (471234567 + k, 10, 5, 1.0, 2.0, 3.0)
        raw += packed("GPS2", 3, 108_996_600 + 100 * k, 1820, *place, 6010 + 100 * k)
    for old, name in ((b"RCO2", b"RCOU"), (b"GPS2", b"GPS\0")):
        raw = raw.replace(old, name)
    log = _read(tmp_path, raw)
    assert log.time[-1] == pytest.approx(0.41)
    assert log.channel("motor_pwm")[0].tolist() == [1500.0, 1100.0]


def test_a_copter_has_no_depth(tmp_path: Path) -> None:
    """The barometer of a multirotor measures no depth."""
    assert not _read(tmp_path, flight("ArduCopter V4.5.1 (abc)")).has("depth")


def test_a_torn_file_is_read_up_to_its_end(tmp_path: Path) -> None:
    """A loss of power leaves half a message; noise between messages is passed over."""
    raw = flight()
    whole = _read(tmp_path)
    torn = _read(tmp_path, raw[:-30])
    assert torn.columns["angular_velocity_x"] == pytest.approx(
        whole.columns["angular_velocity_x"][: torn.rows], nan_ok=True
    )
    noisy = _read(tmp_path, raw + b"\0" * 500 + packed("IMU", 9_000_000, 0, *[1.0] * 6))
    assert noisy.time[-1] == pytest.approx(4.0)


def test_broken_files_are_refused(tmp_path: Path) -> None:
    """Another file, one that is mostly noise, one without channels, an unknown field."""
    for raw, words in (
        (b"ULog" * 50, "lacks the file signature"),
        (flight()[:4000] + b"\7" * 4000, "belong to no message"),
        (declared("FMT") + declared("PIDR") + packed("PIDR", 1, 1.0, 2.0), "no sample"),
        (
            declared("IMU") + packed("FMT", 66, 20, b"IMU", b"Qf", b"TimeUS,GyrX"),
            "twice, differently",
        ),
    ):
        with pytest.raises(LogError, match=words):
            _read(tmp_path, raw)
    with pytest.raises(LogError, match="no topic 'BRO'"):
        _read(tmp_path, columns={"BRO/Press": "pressure"})
    with pytest.raises(LogError, match="Did you mean 'BAlt'"):
        _read(tmp_path, columns={"CTUN/Balt": "depth"})
    with pytest.raises(LogError, match="contains text"):
        _read(tmp_path, columns={"MSG/Message": "depth"})


def test_declarations_that_do_not_fit_are_left_out(tmp_path: Path) -> None:
    """More labels than letters, or another length: the message is passed over, not misread."""
    wrong = packed("FMT", 90, 11, b"ODD", b"Q", b"TimeUS,More")
    wrong += packed("FMT", 91, 99, b"LONG", b"Q", b"TimeUS")
    raw = flight() + wrong + b"\xa3\x95\x5a" + bytes(8) + b"\xa3\x95\x5b" + bytes(96)
    log = _read(tmp_path, raw)
    assert log.rows == _read(tmp_path).rows
    for name in ("ODD", "LONG"):
        with pytest.raises(LogError, match=f"no topic '{name}'"):
            _read(tmp_path, raw, topics=[name])


def test_reversed_thrusters_are_those_of_the_parameters(tmp_path: Path) -> None:
    """MOT_n_DIRECTION below zero; a log without such parameters states nothing."""
    assert _read(tmp_path).meta["motor_reverse"] == [2, 3]
    plain = flight().replace(b"_DIRECTION", b"_DIRECTIO_")
    assert "motor_reverse" not in _read(tmp_path, plain).meta
