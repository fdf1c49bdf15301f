"""Files of vehicles as their projects publish them become robots with the numbers they state."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from seals.check.robot import Verdict, check_robot
from seals.multibody.tree import forward
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.scaffold.robot import NewRobot, scaffold_robot

VEHICLES = Path(__file__).with_name("urdfs") / "vehicles"
Data = dict[str, dict[str, dict[str, Any]]]


def taken(tmp_path: Path, name: str, **options: Any) -> tuple[NewRobot, Data]:
    """Return the robot of a file and its ``robot.yaml``, which composes and builds."""
    made = scaffold_robot("mine", VEHICLES / name, parent=tmp_path, **options)
    text = (made.folder / "robot.yaml").read_text(encoding="utf-8")
    settings = run_settings([f"robot={made.folder}"])
    assert build_robot(settings.robot).links == made.robot.links
    data: Data = yaml.safe_load(text)
    return made, data


def failures(made: NewRobot) -> list[str]:
    """Return what the check of a robot says failed."""
    settings = run_settings([f"robot={made.folder}"])
    found = check_robot(settings.robot, settings.actuators)
    return [str(finding) for finding in found if finding.verdict is Verdict.FAIL]


def row(entry: dict[str, Any], stem: str) -> list[float]:
    """Return the three numbers of a stem."""
    return [entry[f"{stem}_{axis}"] for axis in "xyz"]


def test_bluerov2_keeps_its_published_hydrodynamics(tmp_path: Path) -> None:
    """Added mass and both dampings of Wu 2018 and the thrusters' forces come out as written."""
    made, data = taken(tmp_path, "bluerov2.sdf")
    effects = data["effects"]
    assert row(effects["hull_added_mass"], "mass") == [5.5, 12.7, 14.57]
    assert row(effects["hull_added_mass"], "inertia") == [0.12, 0.12, 0.12]
    assert row(effects["hull_linear_drag"], "coefficient") == [4.03, 6.22, 5.18]
    assert row(effects["hull_drag"], "coefficient") == [18.18, 21.66, 36.99]
    assert row(effects["hull_turning"], "coefficient") == [0.07, 0.07, 0.07]
    assert row(effects["hull_turning"], "quadratic") == [1.55, 1.55, 1.55]
    thrusters = data["actuators"]["thrusters"]
    assert thrusters["max_force"] == [51.5]
    assert effects["thruster_medium"]["radius"] == 0.038
    half = math.sqrt(0.5)
    assert thrusters["axis"][0] == pytest.approx([half, half, 0.0], abs=1e-5)
    assert made.medium.value == "water"
    assert any("40.2 N backwards" in remark for remark in made.remarks)
    assert failures(made) == []
    text = (made.folder / "robot.yaml").read_text(encoding="utf-8")
    assert "plug-in gz-sim-hydrodynamics-system (xDotU" in text


def test_a_fossen_model_is_turned_into_body_axes(tmp_path: Path) -> None:
    """Couplings of surge and pitch change sign from z down to z up; volume and lag are kept."""
    made, data = taken(tmp_path, "bluerov2_heavy.urdf")
    added = data["effects"]["hull_added_mass"]
    assert row(added, "mass") == [6.36, 7.12, 18.68]
    assert added["coupling"][0][4] == -0.2
    assert added["coupling"][1][3] == 0.2
    assert row(data["effects"]["hull_drag"], "coefficient") == [141.0, 217.0, 190.0]
    assert row(data["effects"]["hull_linear_drag"], "coefficient") == [13.7, 0.0, 33.0]
    hull = data["hulls"]["base_link"]
    assert (hull["displaced_volume"], hull["centre_of_buoyancy"]) == (0.0134, [0.0, 0.0, 0.05])
    assert data["actuators"]["thrusters"]["time_constant"] == [0.05]
    assert len(data["actuators"]["thrusters"]["position"]) == 8
    assert failures(made) == []


def test_a_torpedo_in_the_older_spelling(tmp_path: Path) -> None:
    """The tag xUU is quadratic drag, zeros are no effect, fins no gripper, fins lift as stated."""
    made, data = taken(tmp_path, "torpedo.sdf")
    assert row(data["effects"]["hull_added_mass"], "mass") == pytest.approx(
        [4.87616, 126.325, 126.325]
    )
    assert row(data["effects"]["hull_drag"], "coefficient") == [6.2282, 601.27, 601.27]
    assert "hull_linear_drag" not in data["effects"]
    assert data["actuators"]["thrusters"]["max_force"] == [30.0]
    assert made.limbs.grippers == {}
    assert made.robot.joints == ("vertical_fins_joint", "horizontal_fins_joint")
    lifts = {k: v for k, v in data["effects"].items() if v["effect"] == "lift"}
    assert [row["coefficient"] for row in lifts.values()] == [pytest.approx(4.13 * 0.0244)]
    assert next(iter(lifts.values()))["links"] == ["horizontal_fins", "vertical_fins_wing"]
    assert "lift of horizontal_fins: not used: cda=0.2, stall" in made.remarks
    origins, turns = forward(made.robot.tree, np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 2)))
    wing = made.robot.links.index("vertical_fins_wing")
    assert turns[0, wing] == pytest.approx(np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), abs=1e-8)
    assert origins[0, wing] == pytest.approx([-1.05, 0.0, 0.0])


def test_motor_plug_ins_of_a_quadrotor(tmp_path: Path) -> None:
    """Constants, turning senses, time constants and rotor drag are those of the motor models."""
    made, data = taken(tmp_path, "iris.sdf")
    rotors = data["actuators"]["rotors"]
    assert rotors["thrust_coefficient"] == [5.84e-6]
    assert rotors["torque_coefficient"] == pytest.approx([0.06 * 5.84e-6])
    assert rotors["direction"] == [1.0, 1.0, -1.0, -1.0]
    assert (rotors["max_speed"], rotors["radius"]) == ([1100.0], [0.128])
    assert (rotors["time_constant"], rotors["spin_down"]) == ([0.0125], [0.025])
    assert rotors["position"][0] == [0.13, -0.22, 0.023]
    # force by speed of rotor and hub: 1.75e-4 w v = c k w^2 v at the speed of hover
    hover = math.sqrt(1.52 * 9.81 / 4.0 / 5.84e-6)
    wanted = 1.75e-4 / (5.84e-6 * hover)
    assert data["effects"]["rotor_drag"]["coefficient"] == pytest.approx(wanted, rel=5e-3)
    assert failures(made) == []


def test_an_included_model_is_found_beside_its_own(tmp_path: Path) -> None:
    """The body of x500 lies in a folder of its own; motors of the outer model turn its rotors."""
    made, data = taken(tmp_path, "x500/model.sdf")
    assert made.robot.mass.sum() == pytest.approx(2.064)
    rotors = data["actuators"]["rotors"]
    assert rotors["thrust_coefficient"] == [8.54858e-6]
    assert rotors["torque_coefficient"] == pytest.approx([0.016 * 8.54858e-6])
    assert rotors["radius"] == [0.14]
    assert failures(made) == []


def test_coaxial_pairs_have_discs_of_their_size(tmp_path: Path) -> None:
    """Discs above each other do not bound each other; axes that point down turn clockwise."""
    made, data = taken(tmp_path, "octocopter.urdf")
    rotors = data["actuators"]["rotors"]
    # four tenths of the distance of neighbouring arms, 0.4 sqrt(2) m, not of the pair's 0.09 m
    assert rotors["radius"] == pytest.approx([0.4 * 0.4 * math.sqrt(2.0)], abs=2e-3)
    assert rotors["direction"] == [1.0, -1.0, -1.0, 1.0] * 2
    assert "axis" not in rotors
    assert failures(made) == []


def test_tilted_rotors_keep_their_tilt(tmp_path: Path) -> None:
    """Every axis leans by 20 degrees across its arm, to either side in turn."""
    made, data = taken(tmp_path, "tilted_hexacopter.urdf")
    axis = np.array(data["actuators"]["rotors"]["axis"])
    assert axis[:, 2] == pytest.approx(np.full(6, math.cos(0.349066)), abs=1e-5)
    assert axis[0, 1] == pytest.approx(math.sin(0.349066), abs=1e-5)
    assert axis[3, 1] == pytest.approx(math.sin(0.349066), abs=1e-5)
    assert data["actuators"]["rotors"]["max_speed"] == [838.0]
    assert failures(made) == []


def test_a_rotor_that_a_servo_tilts_sits_on_its_link(tmp_path: Path) -> None:
    """The tail servo of a tricopter stays a joint, and its rotor an actuator on that side of it."""
    made, data = taken(tmp_path, "tricopter.urdf")
    assert made.robot.joints == ("tail_servo",)
    tail = data["actuators"]["prop_tail_rotors"]
    assert (tail["links"], tail["first"], tail["position"]) == (["prop_tail"], 2, [[0.0, 0.0, 0.0]])
    assert len(data["actuators"]["rotors"]["position"]) == 2
    assert any("prop_tail is tilted by the joint tail_servo" in remark for remark in made.remarks)
    assert failures(made) == []


def test_shapes_of_propellers_are_no_hulls(tmp_path: Path) -> None:
    """The disc of a screw displaces nothing and has no drag, and that is said."""
    made, data = taken(tmp_path, "survey_auv.sdf")
    assert "propeller" not in data["hulls"]
    assert "propeller" not in {
        link for e in data["effects"].values() for link in e.get("links", ())
    }
    assert "shapes of propellers have no hull and no drag: propeller" in made.changes


def test_a_boat_and_its_plug_ins(tmp_path: Path) -> None:
    """Forces fore and aft, drag by speed and zeros for added mass are those of the file."""
    made, data = taken(tmp_path, "boat.sdf")
    assert data["actuators"]["thrusters"]["max_force"] == [250.0]
    assert data["actuators"]["thrusters"]["axis"] == [[1.0, 0.0, 0.0]] * 2
    # of the hull at its draught: the effect is scaled by the share that is under water
    share = made.robot.mass.sum() / (998.2 * sum(hull.volume for hull in made.hulls.values()))
    assert share == pytest.approx(0.1636, abs=2e-4)
    drag = row(data["effects"]["hull_linear_drag"], "coefficient")
    assert drag == pytest.approx(np.array([51.3, 40.0, 500.0]) / share, rel=1e-4)
    assert "hull_added_mass" not in data["effects"]
    assert any("added mass is zero" in remark for remark in made.remarks)
    assert made.robot.joints == ()


def test_a_buoy_and_its_stated_volume(tmp_path: Path) -> None:
    """Frames and degrees of an SDF place the weight; the volume is that of the plug-in."""
    made, data = taken(tmp_path, "buoy.sdf")
    origins, turns = forward(made.robot.tree, np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 0)))
    assert origins[0, 1] == pytest.approx([0.0, 0.0, -0.6])
    assert turns[0, 1] @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-8)
    assert data["hulls"]["float"]["displaced_volume"] == 0.045
    assert list(data["hulls"]) == ["float"]


def test_thrust_at_sites_of_an_mjcf(tmp_path: Path) -> None:
    """Largest thrust, reaction and sense of rotation follow from control range and gear."""
    made, data = taken(tmp_path, "quadrotor.xml")
    rotors = data["actuators"]["rotors"]
    top = rotors["thrust_coefficient"][0] * rotors["max_speed"][0] ** 2
    assert top == pytest.approx(13.0)
    ratio = rotors["torque_coefficient"][0] / rotors["thrust_coefficient"][0]
    assert ratio == pytest.approx(0.0201)
    # the air turns the body against the rotor
    assert rotors["direction"] == [1.0, -1.0, 1.0, -1.0]
    assert made.robot.mass == pytest.approx([1.325])
    assert made.robot.inertia[0] == pytest.approx(
        np.diag([0.0408, 0.0298, 0.0576]), rel=1e-6, abs=1e-9
    )
    assert failures(made) == []


def test_a_quadruped_of_mjcf(tmp_path: Path) -> None:
    """Bodies are links at their joints, position actuators are servos, a keyframe is the stance."""
    made, data = taken(tmp_path, "quadruped.xml")
    assert list(made.limbs.legs) == ["FR", "FL", "RR", "RL"]
    servos = data["actuators"]["servos"]
    assert servos["kp_each"] == [100.0] * 12
    assert servos["kd_each"] == [1.0, 2.0, 2.0] * 4
    assert data["legs"]["FR"]["toe"] == pytest.approx([0.0, 0.0, -0.213])
    assert data["legs"]["RL"]["stance"] == [0.0, 0.9, -1.8]
    assert servos["torque_limit_each"][:3] == [23.7, 23.7, 35.5]
    assert made.robot.mass.sum() == pytest.approx(5.2 + 4 * (0.68 + 1.01 + 0.196))
    assert made.robot.upper[1] == pytest.approx(4.5)
    capsule = math.pi * 0.015**2 * (0.2 + 4.0 / 3.0 * 0.015)
    assert made.hulls["FL_thigh"].volume == pytest.approx(capsule, rel=1e-6, abs=1e-9)
    assert failures(made) == []


def test_a_quadruped_without_a_stance_bends_its_knees(tmp_path: Path) -> None:
    """Straight legs get one: toes below their lift joints, 0.72 of 0.426 m away, knees behind.

    Rotors of the motors beside each joint are no propellers, and a drawn frame is no base.
    """
    made, data = taken(tmp_path, "quadruped.urdf")
    assert made.drives == []
    assert made.robot.links[0] == "trunk"
    assert any("stance is chosen" in remark for remark in made.remarks)
    for name, leg in data["legs"].items():
        hip, lift, bend = leg["stance"]
        assert hip == 0.0
        knee = -0.213 * math.sin(lift)
        # a grid of 81 values: 0.065 rad of the thigh is 14 mm
        assert knee - 0.213 * math.sin(lift + bend) == pytest.approx(0.0, abs=0.015), name
        assert 0.213 * (math.cos(lift) + math.cos(lift + bend)) == pytest.approx(0.307, abs=0.015)
        assert knee < 0.0
    assert failures(made) == []


def test_a_keyframe_that_does_not_state_all_is_no_stance(tmp_path: Path) -> None:
    """MuJoCo fills a short keyframe with zeros, its numbers on the wrong joints."""
    text = (VEHICLES / "quadruped.xml").read_text(encoding="utf-8")
    file = tmp_path / "short.xml"
    file.write_text(text.replace("0 0 0.27 1 0 0 0", "0 0 0.27"), encoding="utf-8")
    made = scaffold_robot("mine", file, parent=tmp_path)
    assert any("stance is chosen" in remark for remark in made.remarks)


def test_a_joint_of_mjcf_with_another_reference(tmp_path: Path) -> None:
    """A joint drawn at ref=0.5 rad has its URDF zero there: limits and keyframe move with it."""
    text = (VEHICLES / "quadruped.xml").read_text(encoding="utf-8")
    text = text.replace('name="FR_hip_joint"', 'name="FR_hip_joint" ref="0.5"')
    file = tmp_path / "turned.xml"
    file.write_text(text, encoding="utf-8")
    made = scaffold_robot("mine", file, parent=tmp_path)
    assert made.robot.lower[0] == pytest.approx(-1.36)
    assert made.robot.upper[0] == pytest.approx(0.36)
    assert made.limbs.legs["FR"]["stance"] == [-0.5, 0.9, -1.8]


def test_a_crab_with_claws_from_macros_elsewhere(tmp_path: Path) -> None:
    """Six legs walk, two claws are arms with a finger; $(find) follows the given folder."""
    pytest.importorskip("xacro", reason="xacro is not installed")
    made, _ = taken(
        tmp_path,
        "crab_description/urdf/crab.urdf.xacro",
        packages={"crab_parts": VEHICLES / "crab_parts"},
    )
    assert len(made.limbs.legs) == 6
    assert made.limbs.arms["arm_1"]["joints"] == ["left_claw_shoulder", "left_claw_elbow"]
    assert made.limbs.grippers["gripper_2"]["joints"] == ["right_claw_pinch"]
    lines = (made.folder / "mine.urdf").read_text(encoding="utf-8").splitlines()
    # PyBullet breaks longer lines, in the middle of a name too
    assert max(map(len, lines)) < 1000
    assert failures(made) == []


@pytest.mark.parametrize(
    ("medium", "there", "gone"),
    [
        ("air", {"air_drag", "rotor_medium"}, {"hull_drag", "hull_added_mass"}),
        ("water", {"hull_drag", "hull_added_mass", "rotor_medium"}, {"air_drag"}),
        ("both", {"air_drag", "hull_drag", "hull_added_mass", "rotor_medium"}, set()),
    ],
)
def test_the_medium_says_what_is_written(
    medium: str, there: set[str], gone: set[str], tmp_path: Path
) -> None:
    """Rotors know the water in every medium; drag, added mass and reverse go with theirs."""
    made, data = taken(tmp_path, "iris.sdf", medium=medium)
    assert there <= data["effects"].keys()
    assert not gone & data["effects"].keys()
    rotors = data["actuators"]["rotors"]
    assert ("reverse" in rotors) == (medium != "air")
    left_out = " ".join(remark for remark in made.remarks if remark.startswith("left out"))
    assert ("in water" in left_out) == (medium == "air")
    assert ("drag in air" in left_out) == (medium == "water")
    # 1.2 times the torque of full speed
    limit = data["effects"]["rotor_medium"]["torque_limit"]
    assert limit == pytest.approx(1.2 * 0.06 * 5.84e-6 * 1100.0**2, rel=5e-3)


def test_drag_in_air_of_a_bare_base_is_that_of_the_links_fixed_to_it(tmp_path: Path) -> None:
    """A plane whose base link is a frame falls no faster than one whose fuselage is the base."""
    body = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1e-2" iyy="1e-2" izz="1e-2"'
    body += ' ixy="0" ixz="0" iyz="0"/></inertial>{}</link>'
    shape = '<collision><geometry><box size="{}"/></geometry></collision>'
    joint = '<joint name="j_{0}" type="{1}"><parent link="{2}"/><child link="{0}"/></joint>'
    words = body.format("fuselage", shape.format("1.4 0.2 0.2"))
    words += body.format("wing", shape.format("0.3 1.8 0.05"))
    words += body.format("arm", shape.format("0.1 0.1 0.4"))
    words += joint.format("wing", "fixed", "fuselage") + joint.format("arm", "continuous", "wing")
    frame = body.format("base_link", "") + joint.format("fuselage", "fixed", "base_link")
    found = {}
    for name, text in (("whole", words), ("bare", frame + words)):
        file = tmp_path / f"{name}.urdf"
        file.write_text(f'<robot name="{name}">{text}</robot>', encoding="utf-8")
        made = scaffold_robot(f"{name}_robot", file, parent=tmp_path, medium="air")
        entries = yaml.safe_load((made.folder / "robot.yaml").read_text("utf-8"))["effects"]
        found[name] = {k: v for k, v in entries.items() if v.get("medium") == "air"}
    assert found["bare"].keys() == {"fuselage_air_drag", "wing_air_drag"}
    assert found["bare"]["wing_air_drag"]["links"] == ["wing"]
    # broadside of a plate, rho C_d A / 2 = 0.5 * 1.2 * C_d * 0.3 * 1.8 with C_d from 1 to 1.3
    assert 0.3 < found["bare"]["wing_air_drag"]["coefficient_z"] < 0.45
    fuselage = dict(found["bare"]["fuselage_air_drag"])
    assert fuselage.pop("links") == ["fuselage"]
    assert found["whole"] == {"air_drag": fuselage}


def test_wheels_and_airships_are_said_to_be_beyond_the_model(tmp_path: Path) -> None:
    """No drive turns a wheel, and displaced air lifts nothing."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    file = tmp_path / "rover.urdf"
    for radius, carried in ((0.3, False), (0.7, True)):
        file.write_text(
            f'<robot name="rover"><link name="body"><inertial><mass value="2"/>{inertia}</inertial>'
            f'<collision><geometry><sphere radius="{radius}"/></geometry></collision></link>'
            f'<link name="disc"><inertial><mass value="0.1"/>{inertia}</inertial></link>'
            '<joint name="axle" type="continuous"><parent link="body"/><child link="disc"/>'
            '<axis xyz="0 1 0"/></joint></robot>'
        )
        remarks = scaffold_robot(f"rover_{carried}".lower(), file, parent=tmp_path).remarks
        assert "joints without stops, such as wheels, are held at an angle: axle" in remarks
        assert any("it is neglected" in remark for remark in remarks) is carried
