"""The verb convert: a foreign log becomes a log folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.cli.convert import _of_log
from seals.cli.main import main
from seals.logs import read_native

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
