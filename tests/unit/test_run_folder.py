"""A run fills its folder: a log like a measured one, a ledger, facts, a report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.cli.main import main
from seals.errors import ConfigError
from seals.logs import Log
from seals.logs.check import check_log
from seals.logs.finding import Severity
from seals.logs.native import read_native
from seals.logs.table import read_parquet
from seals.robot.whole_body import whole_body
from seals.run.build import run_settings
from seals.run.simulation import Record, simulate
from seals.sysid.data.robot_description import described_by

pytestmark = pytest.mark.usefixtures("elsewhere")

GRAVITY = 9.81
POINT = """<robot name="point"><link name="base"><inertial><mass value="2"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link></robot>"""
SENSORS = """
sensors:
  slow: {sensor: imu, rate: 50}
  second: {sensor: imu, rate: 250}
"""
TWO = """<robot name="two">
<link name="base"><inertial><mass value="3"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/></inertial></link>
<link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0.4 0 0"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="3" effort="1" velocity="1"/></joint></robot>"""


def make(folder: Path, urdf: str, more: str = "") -> Path:
    """Write a robot folder."""
    folder.mkdir()
    (folder / "r.urdf").write_text(urdf, encoding="utf-8")
    (folder / "robot.yaml").write_text(f"urdf: r.urdf\n{more}", encoding="utf-8")
    return folder


def ran(*words: str) -> Record:
    """Simulate without a folder."""
    return simulate(run_settings(list(words)))


def only_run(folder: Path) -> Path:
    """Return the one run folder below a folder."""
    (found,) = folder.glob("runs/*/*")
    return found


def test_run_fills_its_folder(elsewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All files are there, none is half, and the last line names the report."""
    assert main(["run", "experiment=drop_test", "time.step=0.004", "time.duration=0.6"]) == 0
    run = only_run(elsewhere)
    names = {path.name for path in run.iterdir()} - {"plots"}
    wanted = "run.json log.parquet meta.yaml robot ledger.parquet report.html .hydra"
    assert names == set(wanted.split())
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"report: {(run / 'report.html').relative_to(elsewhere)}"
    facts = json.loads((run / "run.json").read_text())
    assert (facts["state"], facts["steps"], facts["seed"]) == ("done", 150, 0)
    assert facts["versions"]["numpy"] == np.__version__
    assert facts["overrides"] == ["experiment=drop_test", "time.step=0.004", "time.duration=0.6"]
    assert len(facts["robot"]["files"]["ball.urdf"]) == 64


@pytest.mark.usefixtures("drawn")
def test_pictures_are_written(elsewhere: Path) -> None:
    """Each subject has a picture."""
    pytest.importorskip("matplotlib", reason="pictures need matplotlib")
    assert main(["run", "robot=free_arm", "time.duration=0.1"]) == 0
    files = list((only_run(elsewhere) / "plots").iterdir())
    assert {f.name for f in files} == {"motion.png", "loads.png", "imu.png", "joints.png"}
    assert all(f.read_bytes().startswith(b"\x89PNG") for f in files)


def test_run_reads_like_a_measurement(elsewhere: Path) -> None:
    """The native reader takes the folder, and the check of logs refuses nothing."""
    assert main(["run", "experiment=drop_test", "time.step=0.004"]) == 0
    log = read_native(only_run(elsewhere))
    assert [f for f in check_log(log) if f.severity is Severity.REFUSE] == []
    assert (log.rows, log.time[-1]) == (376, 1.5)
    stems = "position orientation velocity angular_velocity specific_force depth"
    assert set(log.channels()) == set(stems.split())
    assert np.array_equal(log.channel("depth")[:, 0], -log.channel("position")[:, 2])


def test_free_fall_is_logged_as_it_is(tmp_path: Path) -> None:
    """Without sensors the log holds the truth: z0 - g t^2/2, and a specific force of zero."""
    robot = make(tmp_path / "point", POINT)
    log = ran(f"robot={robot}", "initial.position=[0,0,9]", "time.duration=1").log
    t = log.time
    assert log.channel("position")[:, 2] == pytest.approx(9 - GRAVITY * t**2 / 2, abs=1e-9)
    assert np.isnan(log.channel("specific_force")[0]).all()
    assert np.abs(log.channel("specific_force")[1:]).max() < 1e-9
    assert not log.has("depth")
    assert "specific_force" in log.meta["known_exactly"]


def test_velocity_is_in_body_axes_and_orientation_starts_with_w(tmp_path: Path) -> None:
    """A body turned by 90 deg about z that moves north moves along its own x."""
    robot = make(tmp_path / "point", POINT)
    start = ["initial.rpy=[0,0,1.5707963267948966]", "initial.velocity=[0,3,0]"]
    log = ran(f"robot={robot}", *start, "time.duration=0.1").log
    half = np.sqrt(0.5)
    assert log.channel("orientation")[0] == pytest.approx([half, 0, 0, half], abs=1e-12)
    assert log.channel("velocity")[-1, :2] == pytest.approx([3.0, 0.0], abs=1e-9)
    assert log.meta["initial_state"][0]["velocity"] == pytest.approx([3.0, 0.0, 0.0], abs=1e-9)


def test_slow_sensor_leaves_gaps_and_a_second_one_its_own_columns(tmp_path: Path) -> None:
    """50 Hz in steps of 4 ms gives every fifth row; the second sensor is called by its name."""
    robot = make(tmp_path / "point", POINT, SENSORS)
    log = ran(f"robot={robot}", "time.duration=0.2").log
    there = np.isfinite(log.channel("specific_force")[:, 0])
    assert np.array_equal(np.flatnonzero(there), np.arange(5, 51, 5))
    assert np.isfinite(log.columns["second_specific_force_z"][1:]).all()
    channels = log.meta["sensors"]["channels"]
    assert (channels["specific_force"]["sensor"], channels["specific_force"]["rate"]) == (
        "slow",
        50,
    )
    # 2e-3 m/s^2/sqrt(Hz) at 50 readings a second
    assert channels["specific_force"]["sigma"] == pytest.approx(2e-3 * np.sqrt(50))
    assert log.meta["known_exactly"] == ["position", "orientation", "velocity"]


def test_joints_and_arm_are_described(tmp_path: Path) -> None:
    """Joint columns are numbered from one; base, links and limits stand in the metadata."""
    robot = make(tmp_path / "two", TWO)
    log = ran(f"robot={robot}", "initial.joint_position=[0.3]", "time.duration=0.02").log
    assert log.columns["joint_position_1"][0] == 0.3
    assert log.columns["joint_velocity_1"].size == 6
    found = described_by(log.meta)
    assert found is not None
    assert found.robot.mass.tolist() == [3.0, 1.0]
    assert (found.robot.lower.tolist(), found.robot.upper.tolist()) == ([-2.0], [3.0])
    assert found.robot.tree.axis.tolist() == [[0.0, 1.0, 0.0]]


def test_whole_body_follows_the_parallel_axis_theorem(tmp_path: Path) -> None:
    """Mass, centre and inertia of two links are those worked out by hand."""
    mass, centre, inertia = whole_body(
        ran(f"robot={make(tmp_path / 'two', TWO)}", "time.duration=0.004").robot
    )
    # 3 kg at the origin, 1 kg at (0.4, 0, -0.5): reduced mass 0.75 kg over that distance
    assert mass == 4.0
    assert centre == pytest.approx([0.1, 0.0, -0.125])
    expected = np.diag([0.11, 0.21, 0.31]) + 0.75 * np.array(
        [[0.25, 0.0, 0.2], [0.0, 0.41, 0.0], [0.2, 0.0, 0.16]]
    )
    assert inertia == pytest.approx(expected)


def test_baseline_names_the_installed_effects(pebble: Path) -> None:
    """Effects stand in the metadata by the name they are installed under, with their values."""
    log = ran(
        f"robot={pebble}", "water=fossen", "effects.hull_drag.coefficient_y=4", "time.duration=0.01"
    ).log
    drag = next(e for e in log.meta["baseline"] if e["instance"] == "hull_drag")
    assert (drag["name"], drag["medium"], drag["links"]) == ("quadratic_drag", "water", ["base"])
    assert drag["parameters"] == {"coefficient_x": 3.1, "coefficient_y": 4.0, "coefficient_z": 0.0}
    assert log.meta["environment"]["gravity"] == [0.0, 0.0, -GRAVITY]
    assert log.meta["environment"]["water_level"] == 0.0
    (shape,) = log.meta["robot"]["hulls"]["base"]["shapes"]
    assert log.meta["robot"]["effects"]["hull_drag"]["coefficient_y"] == 4.0
    assert (shape["type"], shape["size"]) == ("sphere", [0.05])


def test_ledger_holds_every_effect(elsewhere: Path) -> None:
    """The ledger has one row a step and the weight of the ball in it."""
    assert main(["run", "experiment=drop_test", "time.step=0.004", "time.duration=0.1"]) == 0
    ledger = read_parquet(only_run(elsewhere) / "ledger.parquet")
    assert ledger["t"].size == 25
    assert ledger["gravity.base.force_z"] == pytest.approx(np.full(25, -0.3 * GRAVITY))


def test_report_says_what_happened(elsewhere: Path) -> None:
    """The report names the robot, the moment of the splash, the effects and how to repeat it."""
    assert main(["run", "experiment=drop_test", "time.step=0.004"]) == 0
    run = only_run(elsewhere)
    html = (run / "report.html").read_text(encoding="utf-8")
    # a ball of 0.05 m radius falls 0.95 m: sqrt(2 h / g) = 0.440 s, felt one step later
    for words in (
        "A floating ball",
        "touches water at",
        "0.444 s",
        "quadratic_drag",
        f"repeat={run}",
    ):
        assert words in html, words


def test_endless_run_is_refused(pebble: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A run of a thousand million steps is refused before memory is taken."""
    with pytest.raises(ConfigError, match="makes 1,000,000,000 steps"):
        ran(f"robot={pebble}", "time.step=0.001", "time.duration=1e6")


def test_metadata_is_plain_yaml(elsewhere: Path, pebble: Path) -> None:
    """Any program can read ``meta.yaml``: no tags, no program's own types."""
    assert main(["run", f"robot={pebble}", "time.duration=0.02"]) == 0
    text = (only_run(elsewhere) / "meta.yaml").read_text(encoding="utf-8")
    meta: dict[str, Any] = yaml.safe_load(text)
    assert (meta["format"], meta["format_version"]) == ("hidden-effect-log", 1)
    assert "!" not in text
    assert isinstance(read_native(only_run(elsewhere)), Log)
