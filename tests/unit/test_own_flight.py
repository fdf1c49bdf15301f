"""The recordings of the tutorial: readable by the field's own programs, whole once converted."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.logs import check_log, read_native
from seals.logs.shipped import find_log

PWM = (
    "reader: mcap\ncolumns: {"
    + ", ".join(f"'/motors/data[{k}]': motor_pwm_{k + 1}" for k in range(4))
    + "}\n"
)


def test_the_ulog_is_one_to_the_library_of_px4() -> None:
    """Pyulog reads the file: topics, rows and microseconds as they were flown."""
    pyulog = pytest.importorskip("pyulog", reason="pyulog, which reads the file, is not installed")
    with gzip.open(find_log("own_flight/flight_1.ulg.gz")) as unpacked:
        log = pyulog.ULog(unpacked)
    assert not log.file_corruption
    rows = {data.name: data.data["timestamp"].size for data in log.data_list}
    assert rows["sensor_combined"] == rows["actuator_motors"] == 1800
    motors = next(data for data in log.data_list if data.name == "actuator_motors")
    share = motors.data["control[0]"]
    assert 0.1 < np.median(share) < 0.9


def test_both_recordings_convert_to_one_vehicle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Shares of thrust in NED and pulse widths in ENU: even rows, sound axes, speeds that carry."""
    pytest.importorskip("mcap", reason="mcap is not installed")
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "quad", "--urdf", "own_flight/quad"]) == 0
    (tmp_path / "pwm.yaml").write_text(PWM)
    rotors = ["actuators.rotors.max_speed=[805.562]", "rate=100", "robot=quad"]
    assert main(["convert", "log=own_flight/flight_1.ulg.gz", *rotors, "out=a"]) == 0
    assert main(["convert", "log=own_flight/flight_2.mcap", "map=pwm.yaml", *rotors, "out=b"]) == 0
    said = capsys.readouterr().out
    assert "thrust_share of 0 to 1" in said
    assert "pwm of 1000 to 2000" in said
    for name in ("a", "b"):
        log = read_native(tmp_path / name)
        assert np.allclose(np.diff(log.time), 0.01, atol=1e-9)
        grave = {f.code for f in check_log(log) if f.severity.value != "note"}
        assert not grave & {"position_axes", "frame_down", "time_offset", "attitude_convention"}
        # four rotors, 1.924 kg: each turns near sqrt(m g / 4 k)
        speed = np.median(log.channel("rotor_speed_cmd"))
        assert speed == pytest.approx(np.sqrt(1.924 * 9.81 / 4 / 2.227e-5), rel=0.05)
