"""Recordings of others become logs: converted, resampled, and turned into the axes of SEALS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from seals.cli.convert import _of_log
from seals.cli.main import main
from seals.errors import LogError
from seals.logs import read_native
from seals.logs.accelerations import filtered_alike, second_derivative
from seals.logs.axes import AxesSettings, with_axes
from seals.logs.check import check_log
from seals.logs.finding import Severity
from seals.logs.log import Log
from seals.logs.resample import even_rows
from seals.logs.time_offset import time_offset

TABLE = "stamp,gauge\n" + "\n".join(f"{10 * k},{50 + (7 * k) % 5}" for k in range(60)) + "\n"
MAP = "reader: csv\ncolumns: {stamp: t, gauge: depth}\nunits: {stamp: ms, gauge: cm}\n"


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a table, its map, and facts on the vehicle."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tank.csv").write_text(TABLE)
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "facts.yaml").write_text("vehicle: {name: raft, mass: 2.5}\n")
    return tmp_path


def test_a_table_with_a_map_becomes_a_log_folder(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Reader, columns and units come from the map, the vehicle from meta; no run folder is left."""
    assert main(["convert", "log=tank.csv", "map=map.yaml", "meta=facts.yaml", "out=tank"]) == 0
    said = capsys.readouterr().out
    assert "tank: 60 rows, depth" in said
    assert "Next: the same command with robot=NAME" in said
    log = read_native(bench / "tank")
    assert log.time[:2].tolist() == [0.0, 0.01]
    assert log.columns["depth"][1] == pytest.approx(0.52)
    assert log.meta["vehicle"]["mass"] == 2.5
    assert not (bench / "runs").exists()


@pytest.mark.parametrize("run", ["[]", "3", "{", '{"robot": []}'])
def test_a_run_json_of_another_program_names_no_robot(
    bench: Path, capsys: pytest.CaptureFixture[str], run: str
) -> None:
    """A log folder beside such a file is used as it is."""
    assert main(["convert", "log=tank.csv", "map=map.yaml", "meta=facts.yaml", "out=tank"]) == 0
    (bench / "tank" / "run.json").write_text(run)
    assert main(["convert", "log=tank", "out=again"]) == 2
    said = capsys.readouterr().err
    assert "Use it as it is: seals diagnose log=tank out=answer" in said
    assert "Traceback" not in said


def test_a_channel_that_is_late_is_shifted(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its values stand earlier by the time given; a number without a channel is refused."""
    words = ["convert", "log=tank.csv", "map=map.yaml"]
    assert main([*words, "out=plain"]) == 0
    assert main([*words, "late={depth: 0.02}", "out=shifted"]) == 0
    assert "depth was late by 0.02 s" in capsys.readouterr().out
    plain, shifted = (read_native(bench / k).columns["depth"] for k in ("plain", "shifted"))
    assert shifted[:-2] == pytest.approx(plain[2:])
    for wrong in ("late=3", "late={depth: soon}", "late=[1]"):
        assert main([*words, wrong, "out=not"]) == 2
        assert "late={position: 0.03}" in capsys.readouterr().err


def test_a_reader_that_knows_a_mass_leaves_the_vehicle_to_the_robot() -> None:
    """Half a description beside a robot's folder would be refused as one that is damaged."""
    partial = {"vehicle": {"name": "cf", "mass": 0.027}, "battery": {"full_voltage": 4.2}}
    assert _of_log(partial, {"mass": 0.03}) == {"battery": {"full_voltage": 4.2}}
    assert _of_log(partial, {}) == partial
    whole = {"vehicle": {"mass": 0.027, "inertia": 1}}
    assert _of_log(whole, {"mass": 0.03}) == whole


def test_a_folder_is_replaced_only_when_told_and_only_a_log(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without replace nothing is overwritten; with it, never a folder that is no log."""
    words = ["convert", "log=tank.csv", "map=map.yaml", "out=tank"]
    assert main(words) == 0
    assert main(words) == 2
    assert "replace=true" in capsys.readouterr().err
    assert main([*words, "replace=true"]) == 0
    assert main([*words[:-1], f"out={bench}", "replace=true"]) == 2
    assert "is not a log folder" in capsys.readouterr().err
    assert (bench / "tank.csv").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (MAP.replace("columns", "colums"), "columns"),
        (MAP.replace("cm", "furlong"), "furlong"),
        (MAP + "_target_: os.system\n", "states _target_"),
        (MAP + "name: '${oc.env:HOME}'\n", "holds a reference"),
        (MAP.replace("reader: csv", "reader: cvs"), "csv"),
    ],
)
def test_a_wrong_map_is_refused(
    content: str, words: str, bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Unknown fields, units and readers, targets and references end in two lines."""
    (bench / "map.yaml").write_text(content)
    assert main(["convert", "log=tank.csv", "map=map.yaml", "out=tank"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 2
    assert words in " ".join(said)
    assert not (bench / "tank").exists()


def test_a_log_that_no_verb_could_use_is_not_written(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Time that runs backwards is refused before anything is written."""
    (bench / "tank.csv").write_text(TABLE.replace("\n300,", "\n3,"))
    assert main(["convert", "log=tank.csv", "map=map.yaml", "out=tank"]) == 2
    assert "backwards" in capsys.readouterr().err
    assert not (bench / "tank").exists()


def _pulses(place: Path) -> None:
    """A table of four pulse widths at ragged times, full battery, and a map of it."""
    stamps = [5 * k + (k * 7) % 3 for k in range(400)]
    rows = [f"{t},1500,1250,1750,1000,4.2" for t in stamps]
    (place / "flight.csv").write_text("ms,m1,m2,m3,m4,volt\n" + "\n".join(rows) + "\n")
    motors = ", ".join(f"m{k}: motor_pwm_{k}" for k in (1, 2, 3, 4))
    (place / "flight.yaml").write_text(
        f"reader: csv\ncolumns: {{ms: t, volt: battery_voltage, {motors}}}\nunits: {{ms: ms}}\n"
    )


def test_pulse_widths_become_rotor_speeds_of_a_robot(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """PWM of 1000 to 2000 us is recognised and said; the robot's rotors give the full speed."""
    _pulses(bench)
    words = ["convert", "log=flight.csv", "map=flight.yaml", "robot=crazyflie", "rate=100"]
    assert main([*words, "out=a"]) == 0
    said = capsys.readouterr().out
    assert "recognised: motor commands are pwm of 1000 to 2000; full is 3053 rad/s" in said
    log = read_native(bench / "a")
    assert log.channel("rotor_speed_cmd")[7] == pytest.approx(
        [3053 * share for share in (0.5, 0.25, 0.75, 0.0)]
    )
    assert log.time[:3].tolist() == pytest.approx([0.0, 0.01, 0.02])
    other = ["motors.range=[1000,3000]", "motors.order=[3,1,2,4]", "span=[0.1,0.9]"]
    assert main([*words, *other, "out=b"]) == 0
    log = read_native(bench / "b")
    assert log.columns["rotor_speed_cmd_1"][7] == pytest.approx(3053 * 0.375)
    assert log.time[-1] <= 0.9
    assert main([*words, "motors.command=pvm", "out=c"]) == 2
    assert "pwm" in capsys.readouterr().err
    # a curve in whole numbers, as the page on one's own flight has it
    assert main([*words, "motors.points=[[0,0],[0.5,500],[1,800]]", "out=d"]) == 0
    log = read_native(bench / "d")
    assert log.columns["rotor_speed_cmd_1"][7] == pytest.approx(500.0)
    assert main([*words, "motors.points=[[0,0],[a,500]]", "out=e"]) == 2
    assert "motors.points[1][0]=a is not allowed" in capsys.readouterr().err


def test_a_data_sheet_in_the_robot_folder_goes_into_the_log(bench: Path) -> None:
    """What datasheet.yaml says of motors and sensors is taken; meta= goes before it."""
    from seals.cli.main import main as seals

    _pulses(bench)
    import shutil

    from seals import robots

    shutil.copytree(Path(robots.__path__[0]) / "crazyflie", bench / "mine")
    (bench / "mine" / "datasheet.yaml").write_text(
        "format: robot-datasheet\nmotors: {command: pwm, full_voltage: 8.4}\nvehicle: {name: x}\n"
    )
    words = ["convert", "log=flight.csv", "map=flight.yaml", "robot=mine", "meta=facts.yaml"]
    assert seals([*words, "rate=100", "out=d"]) == 0
    log = read_native(bench / "d")
    # half of the full voltage: half the speed
    assert log.columns["rotor_speed_cmd_1"][7] == pytest.approx(3053 * 0.25)
    assert log.meta["vehicle"]["name"] == "raft"


def test_a_log_without_a_pose_is_told_what_a_diagnosis_lacks(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a robot: no command is printed that would be refused; a stated start is enough."""
    words = ["convert", "log=tank.csv", "map=map.yaml", "robot=ball"]
    assert main([*words, "out=tank"]) == 0
    said = capsys.readouterr().out
    assert "no diagnosis yet: the log has no position and orientation" in said
    assert "seals diagnose" not in said
    (bench / "start.yaml").write_text("initial_state: [{position: [0, 0, 0]}]\n")
    assert main([*words, "meta=start.yaml", "out=known"]) == 0
    assert "seals diagnose log=known robot=ball" in capsys.readouterr().out


Columns = dict[str, NDArray[np.float64]]
ROWS, STEP = 2400, 0.01
NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""From north, east, down to east, north, up, and back."""
FRD = np.diag([1.0, -1.0, -1.0])


def _motion(time: NDArray[np.float64]) -> tuple[NDArray[np.float64], Rotation]:
    place = np.stack([1.5 * np.sin(0.9 * time), np.cos(1.3 * time), 0.8 * np.sin(0.7 * time)], 1)
    angles = np.stack([0.3 * np.sin(1.1 * time), 0.2 * np.sin(0.8 * time), 0.5 * np.sin(time)], 1)
    return place, Rotation.from_euler("xyz", angles)


def _flight(late: float = 0.0, *, world: object = None, body: object = None) -> Log:
    """A wandering body; its IMU late by some time, its axes by two matrices from ENU and FLU."""
    rng = np.random.default_rng(3)
    time = np.arange(ROWS) * STEP
    place, turn = _motion(time)
    h = 1e-3
    before, middle, after = (_motion(time - late + s)[0] for s in (-h, 0.0, h))
    early, then, later = (_motion(time - late + s)[1] for s in (-1e-5, 0.0, 1e-5))
    force = then.inv().apply((before - 2 * middle + after) / h**2 + [0.0, 0.0, 9.81])
    rate = (early.inv() * later).as_rotvec() / 2e-5
    w = np.eye(3) if world is None else np.asarray(world)
    b = np.eye(3) if body is None else np.asarray(body)
    quaternion = (Rotation.from_matrix(w.T) * turn * Rotation.from_matrix(b)).as_quat()
    place, force, rate = place @ w, force @ b, rate @ b
    columns: Columns = {"t": time}
    for k, axis in enumerate("xyz"):
        columns[f"position_{axis}"] = place[:, k] + rng.normal(0.0, 0.003, ROWS)
        columns[f"specific_force_{axis}"] = force[:, k] + rng.normal(0.0, 0.1, ROWS)
        columns[f"angular_velocity_{axis}"] = rate[:, k] + rng.normal(0.0, 0.01, ROWS)
    columns |= {f"orientation_{axis}": quaternion[:, k] for k, axis in enumerate("xyzw")}
    return Log(name="flight", columns=columns)


def _found(log: Log) -> dict[str, str]:
    found = (finding for finding in check_log(log) if finding.severity.value != "note")
    return {finding.code: finding.message for finding in found}


def test_ned_and_frd_become_enu_and_flu() -> None:
    """A log in north-east-down and forward-right-down is that of ENU and FLU after the map."""
    true = _flight()
    log, said = with_axes(_flight(world=NED, body=FRD), AxesSettings(world="ned", body="frd"))
    for stem in ("position", "specific_force", "angular_velocity"):
        # the noise of both was drawn alike but along other axes
        assert np.abs(log.channel(stem) - true.channel(stem)).max() < 1.0
        assert np.abs(log.channel(stem) - true.channel(stem)).mean() < 0.15
    dots = np.sum(log.channel("orientation") * true.channel("orientation"), axis=1)
    assert np.abs(dots).min() == pytest.approx(1.0, abs=1e-12)
    assert _found(log) == {}
    assert len(said) == 2
    assert "frame_down" in _found(_flight(world=NED, body=FRD))


@pytest.mark.parametrize(
    "axes", [("y", "x", "z"), ("y", "x", "-z"), ("-x", "y", "z"), ("-y", "x", "z")]
)
def test_swapped_axes_of_the_position_are_found_and_mended(axes: tuple[str, ...]) -> None:
    """East for north, down for up, a mirror, a quarter turn: each with the option that mends it."""
    wrong, _ = with_axes(_flight(), AxesSettings(position=list(axes)))
    message = _found(wrong)["position_axes"]
    option = message.split("axes.position=[")[1].split("]")[0].split(",")
    mended, _ = with_axes(wrong, AxesSettings(position=option))
    assert "position_axes" not in _found(mended)
    assert np.array_equal(mended.channel("position"), _flight().channel("position"))


def test_a_turned_world_is_found_and_turned_back() -> None:
    """A tracking system whose axes are 40 degrees off those of the compass."""
    wrong, _ = with_axes(_flight(), AxesSettings(heading=-0.7))
    assert "position_axes" not in _found(wrong)
    angle = float(_found(wrong)["position_heading"].split("axes.heading=")[1].split(",")[0])
    assert angle == pytest.approx(0.7, abs=0.03)
    assert _found(with_axes(wrong, AxesSettings(heading=angle))[0]) == {}


@pytest.mark.parametrize("option", ["axes.quaternion=xyzw", "axes.inverse=true"])
def test_quaternions_are_told_without_a_gyroscope(option: str) -> None:
    """Order and inverse by accelerometer and position alone; the named option mends them."""
    log = _flight()
    columns = {k: v for k, v in log.columns.items() if not k.startswith("angular")}
    q = dict(zip("xyzw", (columns[f"orientation_{x}"] for x in "xyzw"), strict=True))
    if "inverse" in option:
        q |= {axis: -q[axis] for axis in "xyz"}
    else:
        q = dict(zip("wxyz", q.values(), strict=True))
    wrong = Log(name="a", columns=columns | {f"orientation_{x}": v for x, v in q.items()})
    assert option in _found(wrong)["attitude_convention"]
    axes = AxesSettings(quaternion="xyzw") if "xyzw" in option else AxesSettings(inverse=True)
    assert _found(with_axes(wrong, axes)[0]) == {}


def test_accelerations_are_filtered_like_positions_without_a_shift() -> None:
    """Of a sine both filters leave the same but for the error of a sum, w^2 h^2 / 12."""
    time, w = np.arange(1200) * 0.01, 4.0
    place, bend = np.sin(w * time)[:, None], -w * w * np.sin(w * time)[:, None]
    left = (filtered_alike(bend) - second_derivative(place))[60:-60]
    assert np.abs(left).max() < 2 * w**2 * w**2 * 0.01**2 / 12


def test_a_late_clock_is_found_and_mended() -> None:
    """Inertial channels 60 ms late against the pose: found within 5 ms, mended by the option."""
    log = _flight(late=0.06)
    message = _found(log)["time_offset"]
    shift = float(message.split("position: ")[1].split(",")[0])
    assert shift == pytest.approx(-0.06, abs=0.005)
    mended = even_rows(log, 0.0, {"position": shift, "orientation": shift})
    assert "time_offset" not in _found(mended)
    assert "time_offset" not in _found(_flight())


@pytest.mark.parametrize(("late", "refused"), [(0.1, False), (-0.03, False), (-0.1, True)])
def test_a_pose_too_late_for_any_fit_is_refused(late: float, refused: bool) -> None:
    """Late sensors are an effect; sensors ahead of the pose are a clock, to be set first."""
    found = next(f for f in check_log(_flight(late=late)) if f.code == "time_offset")
    assert (found.severity is Severity.REFUSE) == refused
    assert "late={position" in found.message


@pytest.mark.parametrize("rate", [0.0, 0.12])
def test_a_body_that_turns_steadily_tells_no_offset_of_its_clocks(rate: float) -> None:
    """A level circle, nose first, and swings of 0.12 rad/s at most: nothing late is claimed."""
    rng = np.random.default_rng(8)
    time = np.arange(1800) * 0.02
    yaw = 0.42 * time + rate / 0.9 * np.sin(0.9 * time)
    turn = Rotation.from_euler("z", yaw[:, None]) * Rotation.from_rotvec(
        rng.normal(0.0, 0.004, (1800, 3))
    )
    columns: Columns = {"t": time}
    columns |= {f"orientation_{a}": turn.as_quat()[:, k] for k, a in enumerate("xyzw")}
    spin = 0.42 + rate * np.cos(0.9 * time)
    gyro = np.stack([0.0 * time, 0.0 * time, spin], 1) + rng.normal(0.0, 0.02, (1800, 3))
    columns |= {f"angular_velocity_{a}": gyro[:, k] for k, a in enumerate("xyz")}
    offset = time_offset(Log(name="circle", columns=columns))
    assert offset is None or abs(offset.late) < 0.01


def test_even_rows_keep_slow_channels_sparse_and_bridge_no_gap() -> None:
    """Ragged stamps become even; a slow channel stands in rows near its samples; a gap stays."""
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.003, 0.007, 2000))
    time = time[(time < 4.0) | (time > 4.5)]
    slow = np.where(np.arange(time.size) % 20 == 0, np.cos(time), np.nan)
    command = np.floor(time)
    columns = {"t": time, "depth": np.sin(time), "range": slow, "thruster_cmd_1": command}
    log = even_rows(Log(name="a", columns=columns), 100.0)
    assert np.allclose(np.diff(log.time), 0.01)
    held = np.isfinite(log.columns["depth"])
    assert not held[(log.time > 4.02) & (log.time < 4.48)].any()
    assert held[(log.time > 0.01) & (log.time < 3.98)].all()
    assert np.abs(log.columns["depth"] - np.sin(log.time))[held].max() < 1e-4
    there = np.isfinite(log.columns["range"])
    assert 0.07 < there.mean() < 0.15
    assert np.abs(log.columns["range"] - np.cos(log.time))[there].max() < 2e-3
    sent = (log.time - np.floor(log.time) > 0.02) & ((log.time < 4.0) | (log.time > 4.51))
    assert np.array_equal(log.columns["thruster_cmd_1"][sent], np.floor(log.time[sent]))


def test_euler_angles_and_world_velocity() -> None:
    """Yaw, pitch, roll about own axes make the attitude; a world velocity turns into the body."""
    angles = np.array([[0.3, -0.2, 1.1]])
    turn = Rotation.from_euler("ZYX", angles[:, ::-1])
    speed = np.array([1.0, 2.0, 3.0])
    names = ("roll", "pitch", "yaw", *(f"velocity_{axis}" for axis in "xyz"))
    columns = {"t": [0.0], **{n: [v] for n, v in zip(names, (*angles[0], *speed), strict=True)}}
    log, said = with_axes(
        Log(name="a", columns=columns),  # type: ignore[arg-type]
        AxesSettings(euler="ZYX", velocity="world"),
    )
    assert log.channel("orientation")[0] == pytest.approx(np.roll(turn.as_quat()[0], 1))
    assert log.channel("velocity")[0] == pytest.approx(turn.inv().apply(speed)[0])
    assert len(said) == 2


def test_a_component_that_was_not_measured_gets_no_column() -> None:
    """North and east of a vehicle that measures its depth: no empty ``position_z``."""
    columns = {"t": [0.0], "position_x": [1.0], "position_y": [2.0]}
    log, _ = with_axes(Log(name="a", columns=columns), AxesSettings(world="ned"))  # type: ignore[arg-type]
    assert {name: values.tolist() for name, values in log.columns.items()} == {
        "t": [0.0],
        "position_x": [2.0],
        "position_y": [1.0],
    }


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ({"world": "nde"}, "axes.world=nde"),
        ({"body": "fru"}, "axes.body=fru"),
        ({"position": ["x", "x", "z"]}, "once each"),
        ({"quaternion": "wzyx"}, "axes.quaternion"),
        ({"euler": "ZYX"}, "needs the column"),
        ({"euler": "321"}, "axes.euler=321"),
    ],
)
def test_wrong_axes_are_refused(axes: dict[str, object], words: str) -> None:
    """Unknown names, doubled axes and absent angles are refused in words."""
    log = Log(name="a", columns={"t": [0.0], "position_x": [1.0]})  # type: ignore[dict-item]
    with pytest.raises(LogError, match=words):
        with_axes(log, AxesSettings(**axes))  # type: ignore[arg-type]
