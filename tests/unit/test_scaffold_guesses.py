"""Guesses of an import from shapes and physics against closed forms; the degenerate is refused."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.check.robot import Verdict, check_robot
from seals.cli.main import main
from seals.errors import ConfigError, RobotError
from seals.run.build import run_settings
from seals.scaffold.robot import NewRobot, scaffold_robot

INERTIA = '<inertia ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"/>'
BOX = '<collision>{}<geometry><box size="{}"/></geometry></collision>'


def link(
    name: str, mass: float, at: str = "0 0 0", box: str = "", place: str = "", moment: float = 1e-3
) -> str:
    """Return a link with a centre of mass and a box."""
    shape = BOX.format(f'<origin xyz="{place}"/>' if place else "", box) if box else ""
    return (
        f'<link name="{name}"><inertial><origin xyz="{at}"/><mass value="{mass}"/>'
        f"{INERTIA.format(moment)}</inertial>{shape}</link>"
    )


def joint(name: str, parent: str, child: str, at: str = "0 0 0", **more: str) -> str:
    """Return a joint; fixed unless it has an axis."""
    axis, effort = more.get("axis", ""), more.get("effort", "0")
    limits = f'<limit lower="-1.2" upper="1.2" effort="{effort}" velocity="0"/>'
    moves = f'<axis xyz="{axis}"/>{limits}' if axis else ""
    kind = "revolute" if axis else "fixed"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/>{moves}</joint>'
    )


def taken(parent: Path, text: str, **options: Any) -> tuple[NewRobot, dict[str, Any]]:
    """Import elements of a URDF; return the robot and its ``robot.yaml``."""
    (parent / "it.urdf").write_text(f'<robot name="r">{text}</robot>', encoding="utf-8")
    made = scaffold_robot("my", parent / "it.urdf", parent=parent, **options)
    return made, yaml.safe_load((made.folder / "robot.yaml").read_text(encoding="utf-8"))


PLACES = [(0.03, -0.04), (-0.03, -0.04), (-0.03, 0.04), (0.03, 0.04)]


def props(mass: float, *, apart: bool) -> str:
    """Return four propellers whose places stand in their joints, or in their inertials."""
    found = link("base_link", 0.5, box="0.1 0.1 0.02")
    for k, (x, y) in enumerate(PLACES):
        here, there = (f"{x} {y} 0.01", "0 0 0") if apart else ("0 0 0", f"{x} {y} 0.01")
        found += link(f"prop{k}", mass, at=there, moment=1e-6 if mass else 0.0)
        found += joint(f"p{k}", "base_link", f"prop{k}", at=here)
    return found


@pytest.mark.parametrize(("mass", "apart"), [(0.0, True), (0.0, False), (0.01, False)])
def test_hubs_of_rotors(tmp_path: Path, mass: float, *, apart: bool) -> None:
    """In the inertials of links without mass, or of links whose frames coincide."""
    made, _ = taken(tmp_path, props(mass, apart=apart))
    hubs = made.drives[0].position
    assert hubs == pytest.approx(np.array([(x, y, 0.01) for x, y in PLACES]), abs=1e-9)


def test_cascade_refuses_rotors_at_one_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four rotors at the origin command lift alone; it flew all the same."""
    _, data = taken(tmp_path, props(0.0, apart=False))
    rotors = data["actuators"]["rotors"]
    rotors["position"] = [[0.0, 0.0, 0.0]] * 4
    (tmp_path / "my" / "robot.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ["run", "robot=my", "controller=cascade", "guide=hover", "time.duration=0.1"]
    assert main([*words, "out=flight"]) == 2
    assert "lift, roll, pitch and yaw" in capsys.readouterr().err


def arm(effort: str = "0", offset: float = 0.0) -> str:
    """Return a body with a rotor on a tilting arm, whose weight lies on the hinge."""
    rotors = (
        "<gazebo><plugin filename='libx.so' name='m'><motorConstant>1e-5</motorConstant>"
        "<maxRotVelocity>1000</maxRotVelocity><jointName>spin{0}</jointName>"
        "<linkName>rotor{0}</linkName></plugin></gazebo>"
    )
    found = link("base_link", 1.0, box="0.1 0.1 0.1")
    for k, (x, y) in enumerate(PLACES):
        found += link(f"arm{k}", 0.1, moment=1e-5) + link(f"rotor{k}", 0.01, moment=1e-6)
        found += joint(
            f"tilt{k}", "base_link", f"arm{k}", at=f"{x} {y} 0", axis="1 0 0", effort=effort
        )
        spin = joint(f"spin{k}", f"arm{k}", f"rotor{k}", at=f"0 {offset} 0.0", axis="0 0 1")
        found += spin.replace('type="revolute"', 'type="continuous"') + rotors.format(k)
    return found


def test_servo_bears_the_thrust_beside_its_hinge(tmp_path: Path) -> None:
    """Thrust of 10 N at 8 mm, weight of the rotor at 8 mm, a swing of half a radian at 1 Hz."""
    _, data = taken(tmp_path, arm(offset=0.008), medium="air")
    inertia = 1e-5 + 1e-6 + 0.01 * 0.008**2
    load = 10.0 * 0.008 + 0.01 * 9.81 * 0.008 + 0.5 * (2.0 * math.pi) ** 2 * inertia
    limits = data["actuators"]["servos"]["torque_limit_each"]
    assert limits == pytest.approx([3.0 * load] * 4, rel=5e-3)


def test_servo_bears_the_water(tmp_path: Path) -> None:
    """A paddle that weighs nothing on its hinge: drag at 1 m/s and added mass in a swing."""
    text = link("base_link", 5.0, box="0.4 0.2 0.1")
    text += link("paddle", 0.1, box="0.02 0.3 0.3", place="0 0 -0.4")
    text += joint("hinge", "base_link", "paddle", axis="0 1 0")
    (tmp_path / "w").mkdir()
    (tmp_path / "a").mkdir()
    wet = taken(tmp_path / "w", text, medium="water")[1]["actuators"]["servos"]
    dry = taken(tmp_path / "a", text, medium="air")[1]["actuators"]["servos"]
    more = wet["torque_limit_each"][0] - dry["torque_limit_each"][0]
    drag = 0.5 * 998.0 * 1.0 * 0.3 * 0.3 * 1.0**2 * 0.4
    # at least the drag; a square plate carries less than a disc of its diagonal
    disc = 8.0 / 3.0 * 998.0 * (0.5 * 0.3 * math.sqrt(2.0)) ** 3
    assert 3.0 * drag < more < 3.0 * (drag + disc * 0.5 * (2.0 * math.pi) ** 2 * 0.4**2)


def rov(damping: float) -> str:
    """Return a vehicle of 11 kg with two thrusters and a stated linear damping."""
    found = link("hull", 11.0, box="0.5 0.3 0.1", moment=0.2)
    for k, y in enumerate((0.1, -0.1)):
        found += link(f"thruster_{k}", 0.01, moment=1e-6)
        found += joint(f"t{k}", "hull", f"thruster_{k}", at=f"-0.2 {y} 0")
    return found + (
        "<gazebo><plugin filename='libuuv_underwater_object_ros_plugin.so' name='u'>"
        "<link name='hull'><volume>0.011</volume><hydrodynamic_model><type>fossen</type>"
        f"<linear_damping>{-damping} -1 -1 -0.1 -0.1 -0.1</linear_damping>"
        "</hydrodynamic_model></link></plugin></gazebo>"
    )


@pytest.mark.parametrize(("damping", "together"), [(0.02, 0.5 * 11.02 * 9.81), (10.0, 20.0)])
def test_thrust_is_not_by_a_drag_that_no_hull_has(
    tmp_path: Path, damping: float, together: float
) -> None:
    """Less drag than the most slender hull of its volume: half of the weight instead."""
    _, data = taken(tmp_path, rov(damping))
    force = data["actuators"]["thrusters"]["max_force"][0]
    assert 2.0 * force == pytest.approx(together, rel=6e-3)


def test_thrusters_hold_the_depth(tmp_path: Path) -> None:
    """Upright thrusters bear twice what is left of weight and buoyancy."""
    text = rov(10.0).replace("0.011</volume>", "0.0105</volume>")
    for k in range(2):
        text = text.replace(
            f'<child link="thruster_{k}"/><origin xyz="',
            f'<child link="thruster_{k}"/><origin rpy="0 -1.5707963267948966 0" xyz="',
        )
    _, data = taken(tmp_path, text.replace(">-10.0 -1", ">-3.0 -1"))
    net = 9.81 * (11.02 - 998.0 * 0.0105)
    force = data["actuators"]["thrusters"]["max_force"][0]
    assert force == pytest.approx(max(net, 0.5 * 3.0 * 2.0), rel=2e-2)


def legs(
    centre: str, box: str = "0.02 0.02 0.13", place: str = "0 0 -0.065", more: str = ""
) -> str:
    """Return a body on four legs of three joints whose last link has a box."""
    found = link("body", 2.0, box="0.3 0.2 0.05")
    for k, (x, y) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        found += link(f"coxa_{k}", 0.05) + link(f"femur_{k}", 0.05, box="0.02 0.1 0.02")
        found += link(f"tibia_{k}", 0.05, at=centre, box=box, place=place)
        found += joint(f"leg{k}_a", "body", f"coxa_{k}", at=f"{0.1 * x} {0.1 * y} 0", axis="0 0 1")
        found += joint(f"leg{k}_b", f"coxa_{k}", f"femur_{k}", at=f"0 {0.05 * y} 0", axis="1 0 0")
        found += joint(f"leg{k}_c", f"femur_{k}", f"tibia_{k}", at=f"0 {0.1 * y} 0", axis="1 0 0")
        found += more.format(k)
    return found


SENSOR = link("sensor_{0}", 0.001) + joint("s_{0}", "tibia_{0}", "sensor_{0}", at="0 0 -0.02")
FOOT = '<link name="foot_{0}"/>' + joint("f_{0}", "tibia_{0}", "foot_{0}", at="0 0 -0.14")


@pytest.mark.parametrize(
    ("centre", "more", "foot", "toe"),
    [
        ("0 0 0", "", "tibia_0", [0.0, 0.0, -0.13]),
        ("0 0 -0.02", "", "tibia_0", [0.0, 0.0, -0.13]),
        ("0 0 -0.02", SENSOR, "tibia_0", [0.0, 0.0, -0.13]),
        ("0 0 -0.02", FOOT, "foot_0", [0.0, 0.0, 0.0]),
    ],
)
def test_toes_are_ends_of_shapes(
    tmp_path: Path, centre: str, more: str, foot: str, toe: list[float]
) -> None:
    """Not twice the centre of mass, and not a sensor half way up the leg."""
    _, data = taken(tmp_path, legs(centre, more=more))
    leg = data["legs"]["leg0"]
    assert leg["foot"] == foot
    assert leg["toe"] == pytest.approx(toe, abs=1e-6)


def test_a_leg_without_a_toe_is_refused(tmp_path: Path) -> None:
    """With the line to write."""
    with pytest.raises(RobotError, match="LENGTH"):
        taken(tmp_path, legs("0 0 0", box="", place=""))


def motors(constant: float, speed: float, more: str = "") -> str:
    """Return a quadrotor by motor plug-ins."""
    found = link("base_link", 1.0, box="0.1 0.1 0.1")
    for k, (x, y) in enumerate(PLACES):
        found += link(f"rotor_{k}", 0.01, moment=1e-6)
        spin = joint(f"spin{k}", "base_link", f"rotor_{k}", at=f"{x} {y} 0", axis="0 0 1")
        found += spin.replace('type="revolute"', 'type="continuous"')
        found += (
            f"<gazebo><plugin filename='libmotor.so' name='m{k}'><jointName>spin{k}</jointName>"
            f"<linkName>rotor_{k}</linkName><motorConstant>{constant}</motorConstant>"
            f"<maxRotVelocity>{speed}</maxRotVelocity>{more}</plugin></gazebo>"
        )
    return found


def test_a_motor_constant_of_another_law_is_not_used(tmp_path: Path) -> None:
    """Ten times a million rad^2/s^2 is no thrust: it is chosen, and the file's line is named."""
    made, data = taken(tmp_path, motors(10.0, 1000.0))
    rotors = data["actuators"]["rotors"]
    full = rotors["thrust_coefficient"][0] * rotors["max_speed"][0] ** 2
    assert full == pytest.approx(2.0 * 1.04 * 9.81 / 4.0, rel=1e-2)
    assert any("spin0: thrust constant not used" in line for line in made.changes)


@pytest.mark.parametrize("kind", ["position", "force"])
def test_motors_of_other_types_state_no_thrust(tmp_path: Path, kind: str) -> None:
    """RotorS: commands of these are no speeds."""
    made, _ = taken(tmp_path, motors(8e-6, 1000.0, f"<motorType>{kind}</motorType>"))
    assert "thrust" not in made.drives[0].sources


def test_what_no_run_takes_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A retry said that the folder exists already."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "it.urdf").write_text(f'<robot name="r">{motors(8e-6, 1000.0)}</robot>')

    def refuse(_: str) -> str:
        raise ConfigError("robot.yaml: out of bounds.\nAllowed: less.")

    monkeypatch.setattr("seals.cli.new._first_run", refuse)
    assert main(["new", "robot", "my", "--urdf", "it.urdf"]) == 2
    assert not (tmp_path / "my").exists()
    assert "it.urdf describes a robot that cannot be simulated" in capsys.readouterr().err


def test_centre_of_buoyancy_of_the_uuv_simulator(tmp_path: Path) -> None:
    """Relative to the centre of mass of the link with all that is fixed to it."""
    text = link("hull", 3.0, at="0.02 0 -0.03", box="0.3 0.2 0.1")
    text += link("tank", 1.0) + joint("t", "hull", "tank", at="0.1 0 0.05")
    text += (
        "<gazebo><plugin filename='libuuv_underwater_object_ros_plugin.so' name='u'>"
        "<link name='hull'><volume>0.004</volume><center_of_buoyancy>0 0 0.04</center_of_buoyancy>"
        "</link></plugin></gazebo>"
    )
    _, data = taken(tmp_path, text)
    centre = np.array([0.75 * 0.02 + 0.25 * 0.1, 0.0, 0.75 * -0.03 + 0.25 * 0.05 + 0.04])
    assert data["hulls"]["hull"]["centre_of_buoyancy"] == pytest.approx(centre, abs=1e-6)


def test_a_volume_without_its_centre(tmp_path: Path) -> None:
    """The centre is that of the shape."""
    text = link("hull", 10.0, box="0.5 0.2 0.1", place="0 0 0.01") + (
        "<gazebo><plugin filename='libBuoyancyPlugin.so' name='b'><link name='hull'>"
        "<volume>0.0105</volume></link></plugin></gazebo>"
    )
    made, data = taken(tmp_path, text)
    assert data["hulls"]["hull"]["displaced_volume"] == 0.0105
    assert "centre_of_buoyancy" not in data["hulls"]["hull"]
    assert made.folder.is_dir()


BLADE = (
    '<gazebo><plugin filename="gz-sim-lift-drag-system" name="l{0}"><cla>4.2</cla>'
    "<area>0.002</area><cp>{2} 0 0</cp><forward>0 1 0</forward><upward>0 0 1</upward>"
    "<air_density>1.2</air_density>"
    "<link_name>{1}</link_name></plugin></gazebo>"
)


def test_lift_of_blades_is_the_thrust_of_their_rotor(tmp_path: Path) -> None:
    """A file whose propellers are spinning wings: four rotors, no wing that stands still."""
    text = link("base_link", 0.5, box="0.1 0.1 0.02")
    for k, (x, y) in enumerate(PLACES):
        text += link(f"rotor_{k}", 0.01, moment=1e-6)
        text += joint(f"r{k}", "base_link", f"rotor_{k}", at=f"{x} {y} 0.01", axis="0 0 1").replace(
            "revolute", "continuous"
        )
        text += BLADE.format(f"{k}a", f"rotor_{k}", 0.05) + BLADE.format(
            f"{k}b", f"rotor_{k}", -0.05
        )
    made, facts = taken(tmp_path, text, medium="air")
    assert [each.links for each in made.drives] == [[f"rotor_{k}" for k in range(4)]]
    assert not any("wing" in name for name in made.robot.links)
    assert not any(e["effect"] == "lift" for e in facts["effects"].values())
    assert any("rotor_0" in words and "blades" in words for words in made.changes)


def test_the_one_propeller_of_a_plane_is_a_rotor(tmp_path: Path) -> None:
    """Its axis lies level, but beside a wing in air it pulls in air."""
    text = link("base_link", 1.0, box="0.4 1.2 0.05") + BLADE.format("w", "base_link", 0.0)
    text += link("propeller", 0.02, moment=1e-6)
    text += joint("p", "base_link", "propeller", at="0.3 0 0", axis="1 0 0").replace(
        "revolute", "continuous"
    )
    made, facts = taken(tmp_path, text)
    assert [(each.kind, each.links) for each in made.drives] == [("rotor", ["propeller"])]
    np.testing.assert_allclose(np.abs(made.drives[0].axis), [[1.0, 0.0, 0.0]], atol=1e-9)
    assert any(e["effect"] == "lift" for e in facts["effects"].values())
    # it need not hover: 1.02 kg on 4.2 x 0.002 m^2, half of 1.2041 kg/m^3, 0.2 rad
    run = run_settings([f"robot={made.folder}"])
    found = check_robot(run.robot, run.actuators, run.effects)
    assert not any(each.verdict is Verdict.FAIL for each in found)
    words = next(str(each) for each in found if "wings" in str(each))
    told = re.search(r"at ([\d.]+) m/s", words)
    assert told is not None
    assert float(told[1]) == pytest.approx(
        math.sqrt(2 * 1.02 * 9.81 / (1.2041 * 0.0084 * 0.2)), rel=0.01
    )


def test_motor_models_of_a_vehicle_with_hydrodynamics_are_thrusters(tmp_path: Path) -> None:
    """Two that push ahead and four that push up, of an underwater vehicle: none is a rotor."""
    text = link("hull", 10.0, box="0.4 0.3 0.2", moment=0.1)
    places = [(0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1)]
    poses = [(f"{x} {y} 0", "0 0 1") for x, y in places]
    poses += [("-0.2 0.1 0", "1 0 0"), ("-0.2 -0.1 0", "1 0 0")]
    for k, (at, axis) in enumerate(poses):
        text += link(f"motor{k}", 0.05, moment=1e-5)
        text += joint(f"m{k}", "hull", f"motor{k}", at=at, axis=axis).replace(
            "revolute", "continuous"
        )
        text += (
            '<gazebo><plugin filename="gz-sim-multicopter-motor-model-system" name="m">'
            f"<jointName>m{k}</jointName><linkName>motor{k}</linkName><motorConstant>1e-4"
            "</motorConstant><momentConstant>0.01</momentConstant><maxRotVelocity>500"
            "</maxRotVelocity><turningDirection>ccw</turningDirection></plugin></gazebo>"
        )
    text += (
        '<gazebo><plugin filename="gz-sim-hydrodynamics-system" name="h"><link_name>hull'
        "</link_name><xDotU>-5</xDotU><yDotV>-6</yDotV><zDotW>-7</zDotW><xUU>-20</xUU>"
        "<yVV>-30</yVV><zWW>-40</zWW></plugin></gazebo>"
    )
    made, _ = taken(tmp_path, text)
    assert [each.kind for each in made.drives] == ["thruster"]
    np.testing.assert_allclose(made.drives[0].thrust, 25.0)  # 1e-4 x 500^2


def test_legs_that_turn_thrusters_are_held(tmp_path: Path) -> None:
    """Outboard engines: their force would keep to zero while the leg swings in the flow."""
    text = link("hull", 60.0, box="1.2 0.6 0.3", moment=5.0)
    for side, y in (("left", 0.25), ("right", -0.25)):
        text += link(f"{side}_leg", 1.0, box="0.05 0.05 0.3", moment=0.01)
        text += joint(f"{side}_leg_joint", "hull", f"{side}_leg", at=f"-0.6 {y} 0", axis="0 0 1")
        text += link(f"{side}_thruster", 0.1, moment=1e-4)
        text += joint(
            f"{side}_screw", f"{side}_leg", f"{side}_thruster", at="0 0 -0.3", axis="1 0 0"
        ).replace("revolute", "continuous")
    made, _ = taken(tmp_path, text)
    assert [each.kind for each in made.drives] == ["thruster"]
    assert made.robot.joints == ()
    assert sum("fixed at zero" in words for words in made.changes) == 2
    assert not any("joint position zero" in words for words in made.remarks)
