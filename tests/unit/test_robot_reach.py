"""What a robot can reach: thrust against buoyancy and weight, and the first command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.api import make
from seals.check.reach import GRAVITY, Reach, reach_of
from seals.check.robot import RobotFinding, Verdict, check_robot
from seals.cli.main import main
from seals.environment.seawater import FRESH_WATER
from seals.errors import ConfigError
from seals.logs import read_native
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.run.goals import goal_results
from seals.run.simulation import simulate
from tests.unit.rov_layouts import LAYOUTS, rov_folder

MASS = 11.5


def looked(robot: str) -> dict[str, RobotFinding]:
    """Return the findings about a robot by subject."""
    run = run_settings([f"robot={robot}"])
    return {f.subject: f for f in check_robot(run.robot, run.actuators, run.effects)}


def reach(robot: str) -> Reach:
    """Return what a robot can do."""
    run = run_settings([f"robot={robot}"])
    found = reach_of(build_robot(run.robot), run.actuators, run.effects)
    assert found is not None
    return found


def test_an_rov_with_too_much_buoyancy_cannot_dive(tmp_path: Path) -> None:
    """226 N of net buoyancy against two upright thrusters of 40 N: told with the ballast to add."""
    volume = (226.0 / GRAVITY + MASS) / FRESH_WATER
    found = looked(rov_folder(tmp_path / "r", LAYOUTS["six"], volume=volume))["in water"]
    assert found.verdict is Verdict.FAIL
    assert found.found.startswith("net buoyancy +226 N against 80 N of thrust downwards")
    assert "cannot dive" in found.found
    assert f"{226.0 / GRAVITY - 0.01 * MASS:.3g} kg of ballast" in found.advice


@pytest.mark.parametrize(
    ("force", "verdict", "words"),
    [(20.0, Verdict.OK, "dives, hovers"), (6.0, Verdict.WARN, "dives and surfaces")],
)
def test_thrust_is_held_against_the_net_buoyancy(
    tmp_path: Path, force: float, verdict: Verdict, words: str
) -> None:
    """8 N of net buoyancy: 40 N are plenty, of 12 N two thirds go into holding the depth."""
    volume = (8.0 / GRAVITY + MASS) / FRESH_WATER
    robot = rov_folder(tmp_path / "r", LAYOUTS["six"], volume=volume, force=force)
    found = looked(robot)["in water"]
    assert found.verdict is verdict
    assert words in found.found
    assert (reach(robot).up, reach(robot).down) == pytest.approx((2.0 * force, 2.0 * force))


def test_a_sinking_rov_is_told_what_to_take_away(tmp_path: Path) -> None:
    """Heavier than its water by more than its thrust, it cannot come up."""
    found = looked(rov_folder(tmp_path / "r", LAYOUTS["five"], volume=0.002))["in water"]
    assert found.verdict is Verdict.FAIL
    assert "cannot come up" in found.found


def test_a_passive_axis_that_nothing_holds_level_is_told(tmp_path: Path) -> None:
    """With its centre of gravity above that of buoyancy a passive pitch turns over."""
    found = looked(rov_folder(tmp_path / "r", LAYOUTS["six"], low=0.02))["axes"]
    assert found.verdict is Verdict.WARN
    assert "not stable in pitch" in found.advice
    right = looked(rov_folder(tmp_path / "s", LAYOUTS["six"]))["axes"]
    assert (right.verdict, right.found) == (
        Verdict.OK,
        "commands surge, sway, heave, roll, yaw; passive: pitch",
    )


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        ("torpedo", "guide=los controller=autopilot"),
        ("boat", "guide=los controller=autopilot"),
        ("auv", "guide=hover controller=station"),
        ("hexacopter", "guide=hover controller=cascade"),
    ],
)
def test_the_first_command_of_a_robot_is_one_that_it_can_follow(robot: str, words: str) -> None:
    """The words name a controller that takes the robot: a world with them is built."""
    first = reach(robot).first_run()
    assert words in first
    make([f"robot={robot}", *first.split()]).close()


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ["torpedo", "boat"])
def test_the_first_course_is_long_enough(robot: str) -> None:
    """The printed run takes the vehicle to its place."""
    run = run_settings([f"robot={robot}", *reach(robot).first_run().split()])
    (place,) = goal_results(simulate(run))
    assert place.reached, str(place)


THRUSTERS = (
    ("0.15 -0.11 0", "0 0 0.785"),
    ("0.15 0.11 0", "0 0 -0.785"),
    ("-0.15 -0.11 0", "0 0 -0.785"),
    ("-0.15 0.11 0", "0 0 0.785"),
    ("0 0.22 0", "0 -1.5708 0"),
    ("0 -0.22 0", "0 -1.5708 0"),
)


@pytest.mark.parametrize(
    ("height", "words"), [("0.0965", "controller=station"), ("0.3", "water=fossen")]
)
def test_what_seals_new_prints_runs(
    height: str,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The layout of a common ROV, pitch passive: station keeping; none where it cannot dive."""
    joints = "".join(
        f'<link name="thruster_{k}"/><joint name="t{k}" type="fixed"><parent link="body"/>'
        f'<child link="thruster_{k}"/><origin xyz="{place}" rpy="{turn}"/></joint>'
        for k, (place, turn) in enumerate(THRUSTERS)
    )
    body = (
        '<link name="body"><inertial><origin xyz="0 0 -0.03"/><mass value="11.5"/>'
        '<inertia ixx="0.16" ixy="0" ixz="0" iyy="0.16" iyz="0" izz="0.16"/></inertial>'
        f'<collision><geometry><box size="0.4 0.3 {height}"/></geometry></collision></link>'
    )
    (tmp_path / "rov.urdf").write_text(f'<robot name="rov">{body}{joints}</robot>')
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "my_rov", "--urdf", "rov.urdf"]) == 0
    last = capsys.readouterr().out.strip().splitlines()[-1].split()
    assert last[:3] == ["seals", "run", "robot=my_rov"]
    assert words in " ".join(last[3:])
    world = make(last[2:])
    for _ in range(20):
        world.step()
    world.close()


VEHICLES = Path(__file__).with_name("urdfs") / "vehicles"


def first_command(name: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Make a robot of a vehicle's file; return the words of the first run that is printed."""
    assert main(["new", "robot", "mine", "--urdf", str(VEHICLES / name)]) == 0
    last = capsys.readouterr().out.strip().splitlines()[-1].split()
    return last[1:]


def test_a_tilted_third_rotor_is_told_to_hover(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three rotors and the servo of one command lift, roll, pitch and yaw: the cascade flies it."""
    monkeypatch.chdir(tmp_path)
    words = first_command("tricopter.urdf", capsys)
    assert reach("mine").flies
    assert "controller=cascade" in words
    make(words[1:]).close()


def test_rotors_beside_a_thruster_are_not_told_to_hover() -> None:
    """The cascade refuses a drive that is no rotor: it is not the first command."""
    pusher = ["+actuator@actuators.pusher=thrusters", "actuators.pusher.max_force=[5]"]
    pusher += [
        "actuators.pusher.first=6",
        "actuators.pusher.position=[[-0.2,0,0]]",
        "actuators.pusher.axis=[[1,0,0]]",
    ]
    run = run_settings(["robot=hexacopter", *pusher])
    found = reach_of(build_robot(run.robot), run.actuators, run.effects)
    assert found is not None
    assert found.flies
    assert "cascade" not in found.first_run()


def test_legs_stand_in_the_first_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Feet of 20 mm stand 2 x 0.213 cos(0.9) m below the hips; servos are told what they carry."""
    monkeypatch.chdir(tmp_path)
    words = first_command("quadruped.xml", capsys)
    assert main([*words, "time.duration=1.5", "hydra.run.dir=stand"]) == 0
    height = read_native(tmp_path / "stand").columns["position_z"][-1]
    # without the weight fed forward the knees would give way by 18 mm
    assert height == pytest.approx(0.426 * np.cos(0.9) + 0.02, abs=0.002)


def test_one_propeller_does_not_steer(tmp_path: Path) -> None:
    """A buoyant hull with one thruster along it stays at the surface; it is not said to steer."""
    found = looked(rov_folder(tmp_path / "r", [[-0.15, 0.0, -0.02, 1.0, 0.0, 0.0]]))["in water"]
    assert "stays at the surface" in found.found


def test_two_actuators_do_not_share_a_column() -> None:
    """A thruster whose column is that of a rotor would take its place unseen."""
    pusher = ["+actuator@actuators.pusher=thrusters", "actuators.pusher.max_force=[5]"]
    run = run_settings(["robot=hexacopter", *pusher])
    with pytest.raises(ConfigError, match="already belongs to another actuator") as caught:
        reach_of(build_robot(run.robot), run.actuators, run.effects)
    assert "pusher.first" in str(caught.value) or "rotors.first" in str(caught.value)


def test_a_vehicle_without_sway_is_steered_at_its_depth(tmp_path: Path) -> None:
    """Two thrusters along it and an upright one: the first command is a course under water."""
    layout = [LAYOUTS["four"][k] for k in (0, 1, 3)]
    folder = rov_folder(tmp_path / "r", layout)
    found = looked(folder)["axes"]
    assert found.found.startswith("commands surge, heave, yaw;")
    assert found.verdict is Verdict.OK
    run = run_settings([f"robot={folder}"])
    reach = reach_of(build_robot(run.robot), run.actuators, run.effects)
    assert reach is not None
    assert "controller=autopilot guide.places=[[20,0,-2]]" in reach.first_run()
