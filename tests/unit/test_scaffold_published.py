"""Files of other projects, with their own numbers: what is read, made sound, left out, and said."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from seals.check.robot import Verdict, check_robot
from seals.effects import bind_effects
from seals.errors import RobotError
from seals.motion import Inputs, Medium, Motion
from seals.multibody.tree import forward, poses_in_base
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.scaffold.mending import fixed_joints, sound_inertias, turned_base, weighted_base
from seals.scaffold.robot import NewRobot, scaffold_robot
from seals.scaffold.urdf import UrdfDraft

PUBLISHED = Path(__file__).parent / "urdfs/published"


def made(file: str, parent: Path, **options: object) -> NewRobot:
    """Take over a published file."""
    return scaffold_robot("my", PUBLISHED / file, parent=parent, **options)  # type: ignore[arg-type]


def failures(new: NewRobot) -> list[str]:
    """What ``seals check`` fails."""
    run = run_settings([f"robot={new.folder}"])
    found = check_robot(run.robot, run.actuators, run.effects)
    return [str(one) for one in found if one.verdict is Verdict.FAIL]


def said(new: NewRobot) -> str:
    """Changes and remarks as one text."""
    return "\n".join((*new.changes, *new.remarks))


def test_bicopter(tmp_path: Path) -> None:
    """Rotors on two servos, a mesh of each link missing, and a joint that holds it in its stand."""
    with pytest.raises(RobotError, match=r"base\.stl.*does not exist[\s\S]*missing-meshes=boxes"):
        made("bicopter/model.sdf", tmp_path)
    new = made("bicopter/model.sdf", tmp_path, boxes=True)
    assert failures(new) == []
    (rotors,) = new.drives
    # motorConstant and momentConstant of the file; 1500 rad/s give 45 N each
    np.testing.assert_allclose(rotors.thrust, 2e-5)
    np.testing.assert_allclose(rotors.torque, 2e-5 * 0.06)
    np.testing.assert_allclose(rotors.max_speed, 1500.0)
    assert rotors.tilting == {"ccw_mot_link": "servo_1_joint", "cw_mot_link": "servo_0_joint"}
    assert new.limbs.grippers == {}
    assert new.limbs.arms == {}
    assert "released" in said(new)
    # the box of 0.16 x 0.12 x 0.10 m that the inertia of its base is that of
    (box,) = new.hulls["base_link"].boxes
    np.testing.assert_allclose(np.sort(box.edges), [0.10, 0.12, 0.16], rtol=1e-3)


def test_bluerov2(tmp_path: Path) -> None:
    """Thrusters whose largest force only the autopilot's channels state."""
    new = made("bluerov2/model.sdf", tmp_path)
    assert failures(new) == []
    (thrusters,) = new.drives
    # multiplier 100, offset -0.5
    np.testing.assert_allclose(thrusters.thrust, 50.0)
    assert "max_force" in thrusters.sources
    # 10.05 kg of water displaced by 10.012 kg
    assert new.hulls["base_link"].volume == pytest.approx(10.05e-3, rel=1e-6)
    text = (new.folder / "robot.yaml").read_text()
    assert "coefficient_x: 33.8, coefficient_y: 54.2687, coefficient_z: 73.3714" in text
    assert "quadratic_x: 4.0, quadratic_y: 4.0, quadratic_z: 4.0" in text
    assert "added_mass" not in text.split("effects:")[1].split("sensors:")[0]


def test_x500(tmp_path: Path) -> None:
    """Rotors of an included model, with drawings that are not there."""
    new = made("x500/model.sdf", tmp_path)
    assert failures(new) == []
    (rotors,) = new.drives
    np.testing.assert_allclose(rotors.thrust, 8.54858e-6)
    assert rotors.direction.tolist() == [1.0, 1.0, -1.0, -1.0]
    assert "1345_prop_ccw.stl, 1345_prop_cw.stl" in said(new)


def test_tethys(tmp_path: Path) -> None:
    """An AUV that faces -x, with a weight that a plug-in holds and a battery within its hull."""
    new = made("tethys_equipped/model.sdf", tmp_path, forward="-x")
    assert failures(new) == []
    assert new.robot.links[0] == "body"
    assert "drop_weight is fixed to base_link" in said(new)
    # Gazebo's buoyancy acts on collision shapes alone
    assert "battery" not in new.hulls
    volume = 2.0 * 0.3 * 0.245945166667 + 2 * 0.1 * 0.1 * 0.02 + 0.03 * 0.1 * 0.1
    assert sum(hull.volume for hull in new.hulls.values()) == pytest.approx(volume, rel=1e-5)
    # the propeller lies astern of the turned base
    (thruster,) = new.drives
    np.testing.assert_allclose(thruster.position, [[-1.43162, 0.0, 0.0]], atol=1e-8)
    # largest force: the drag of the file at 2 m/s
    np.testing.assert_allclose(thruster.thrust, 6.2282 * 4.0)
    text = (new.folder / "robot.yaml").read_text()
    assert "mass_x: 4.87616, mass_y: 126.325, mass_z: 126.325" in text
    assert "links: [vertical_fins_wing, horizontal_fins_wing]" in text


def test_wamv(tmp_path: Path) -> None:
    """Names with a slash, and packages that include each other's macros."""
    new = made("vrx/wamv_gazebo/urdf/wamv_gazebo.urdf.xacro", tmp_path)
    assert failures(new) == []
    assert new.robot.links[0] == "wamv/base_link"
    (thrusters,) = new.drives
    # (51.3 + 72.4 v) v / 2 at 7.71667 m/s
    np.testing.assert_allclose(thrusters.thrust, (51.3 + 72.4 * 7.71667) * 7.71667 / 2.0, rtol=1e-6)
    names = re.findall(r"^  (\w+): \{effect", (new.folder / "robot.yaml").read_text(), re.M)
    # the legs of its engines are held: the hydrodynamics that the file states are of the whole
    assert not any("engine" in joint for joint in new.robot.joints)
    assert not any("engine" in name for name in names)


def test_eca_a9(tmp_path: Path) -> None:
    """An AUV with four fins aslant: fins, hull damping and buoyancy of the UUV simulator."""
    new = made("eca_a9_description/urdf/eca_a9_base.xacro", tmp_path, boxes=True)
    assert failures(new) == []
    # moments of 0.6, 30 and 35 kg m^2: 35 is 4.4 too many, shared by their squares
    assert "eca_a9/base_link (0.6, 30, 35 becomes 0.601, 31.9, 32.5 kg m^2)" in said(new)
    moments = np.linalg.eigvalsh(new.robot.inertia[0])
    assert moments[2] < moments[0] + moments[1]
    # neutrally buoyant in its water: 69.7 kg and what is fixed to it, not the stated 82.3 litre
    assert new.hulls["eca_a9/base_link"].stated["displaced_volume"] == pytest.approx(
        (69.7 + 0.001) / 1027.0, rel=1e-6
    )
    (thruster,) = new.drives
    np.testing.assert_allclose(thruster.thrust, 8.0 * 2.0**2)
    run = run_settings([f"robot={new.folder}"])
    # angles of attack of 1e-3 at most, whose square is left out; coefficients of six digits
    speed = np.array([2.0, 0.001, -0.002])
    v, w, p, q, r = (*speed[1:], 0.003, 0.001, -0.002)
    force, moment = _load(run, "lift", "base_link_wing", speed, np.array([p, q, r]), 1027.0)
    u = speed[0]
    np.testing.assert_allclose(force[1:], [-162.0 * u * v, -108.0 * u * w], rtol=5e-6)
    np.testing.assert_allclose(moment[1:], [-20.0 * u * q, -32.0 * u * r], rtol=5e-6)
    # a fin aslant to the flow: lift 7.2 a u^2 and drag 6.3 a^2 u^2 in its own water, for small a
    fin = next(e for n, e in run.effects.items() if "fin0_wing" in n)
    assert fin.coefficient == pytest.approx(2.0 * 7.2 / 1028.0, rel=1e-5)
    assert fin.attack_drag == pytest.approx(2.0 * 6.3 / 1028.0, rel=1e-5)
    assert "roll, and coupling of axes, in linear_damping_forward_speed" in said(new)


def _load(
    run: Any, kind: str, links: str, velocity: Any, rate: Any, density: float
) -> tuple[Any, Any]:
    """Return force and moment about the base of one kind of effect on some links in water."""
    robot = build_robot(run.robot)
    origins, turns = forward(robot.tree, np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 4)))
    force, moment = np.zeros(3), np.zeros(3)
    for bound in bind_effects(run.effects, robot.links).bound:
        if kind not in bound.effect.accounts_for:
            continue
        for k in bound.links:
            if links not in robot.links[k]:
                continue
            turn, arm = turns[0, k], origins[0, k]
            own = ((velocity + np.cross(rate, arm)) @ turn)[None]
            zero, one, none = np.zeros((1, 3)), np.ones((1, 1)), np.zeros((1, 1))
            motion = Motion(none, zero, turn[None], zero, own, (rate @ turn)[None], None)
            around = Medium(density * one, zero, zero, one, one, one, none, zero, zero, none, one)
            params = {name: value[:1] for name, value in bound.params.items()}
            found, _ = bound.effect.loads(motion, around, Inputs(0.004, none), none, params)
            push = turn @ found.force[0]
            force, moment = force + push, moment + np.cross(arm, push)
    return force, moment


def test_skydio_x2(tmp_path: Path) -> None:
    """An MJCF whose drawing is not there; its rotors of one side turn alike, which the check says.

    The gears 0 0 1 0 0 -+0.0201 N m/N lie right and left: rolling moments and yawing ones are one.
    """
    new = made("skydio_x2/x2.xml", tmp_path)
    left = "1 visual shape(s) left out because missing, empty or unreadable: X2_lowpoly.obj"
    assert left in said(new)
    assert new.robot.mass.sum() == pytest.approx(4 * 0.25 + 0.325)
    (rotors,) = new.drives
    np.testing.assert_allclose(rotors.thrust * rotors.max_speed**2, 13.0)
    np.testing.assert_allclose(rotors.torque / rotors.thrust, 0.0201)
    run = run_settings([f"robot={new.folder}"])
    words = [str(one) for one in check_robot(run.robot, run.actuators, run.effects)]
    assert any("allocation" in line and "rank 3 of 4" in line for line in words)
    crossed = run_settings([f"robot={new.folder}", "actuators.rotors.direction=[-1,1,-1,1]"])
    found = check_robot(crossed.robot, crossed.actuators, crossed.effects)
    assert any("rank 4 of 4" in str(one) for one in found)


def test_mesh_that_weighs_is_not_left_out(tmp_path: Path) -> None:
    """An MJCF whose body has its mass from a mesh that is not there has none without it."""
    file = tmp_path / "robot.xml"
    text = (
        '<mujoco><asset><mesh file="a.stl"/></asset><worldbody><body name="b"><freejoint/>{}'
        '<geom type="mesh" mesh="a" contype="{}" conaffinity="0"/></body></worldbody></mujoco>'
    )
    inertial = '<inertial pos="0 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>'
    file.write_text(text.format("", 1))
    with pytest.raises(RobotError, match=r"'a\.stl'.*'b' gets its mass from it.*\n.*<inertial>"):
        scaffold_robot("my", file, parent=tmp_path, boxes=True)
    file.write_text(text.format(inertial, 1))
    with pytest.raises(RobotError, match=r"missing-meshes=boxes"):
        scaffold_robot("my", file, parent=tmp_path)
    new = scaffold_robot("my", file, parent=tmp_path, boxes=True)
    # 12 I = 2 m e^2
    (box,) = new.hulls["b"].boxes
    np.testing.assert_allclose(box.edges, np.sqrt(6.0 * 0.1 / 2.0), rtol=1e-5)


def test_omnicopter(tmp_path: Path) -> None:
    """Eight rotors towards the corners of a cube command all six axes."""
    new = made("omnicopter/model.sdf", tmp_path)
    assert failures(new) == []
    (rotors,) = new.drives
    np.testing.assert_allclose(rotors.thrust, 2.50972e-5)
    # four push down at full speed forwards, up backwards
    np.testing.assert_allclose(rotors.axis[0], [-0.788675, 0.211325, 0.57735], atol=1e-5)
    np.testing.assert_allclose(rotors.axis[1], [-0.211325, -0.788675, 0.57735], atol=1e-5)
    assert "reversed to point upwards: rotor_1, rotor_2, rotor_5, rotor_6" in said(new)
    run = run_settings([f"robot={new.folder}"])
    found = [str(one) for one in check_robot(run.robot, run.actuators, run.effects)]
    assert any("rank 6 of 6" in line for line in found)


def test_spot(tmp_path: Path) -> None:
    """A robot dog whose collision meshes are not there, with slow servos, which are named."""
    new = made("spot/spot.xml", tmp_path, boxes=True)
    assert failures(new) == []
    assert list(new.limbs.legs) == ["fl", "fr", "hl", "hr"]
    assert new.limbs.legs["hr"]["stance"] == [0.0, 1.04, -1.8]
    # kv / kp of the file: 40 / 500
    assert "servos of the file follow 0.08 s late, 22% of a step" in said(new)
    assert "kp_each of 2.67e+03 N m/rad follows" in said(new)
    quick = (PUBLISHED / "spot/spot.xml").read_text().replace('kp="500"', 'kp="2670"')
    (tmp_path / "quick.xml").write_text(quick)
    other = scaffold_robot("other", tmp_path / "quick.xml", parent=tmp_path, boxes=True)
    assert " late, " not in said(other)


def test_rexrov(tmp_path: Path) -> None:
    """A work-class ROV with the full matrix of added mass of its file."""
    new = made("uuv_descriptions/models/rexrov/urdf/rexrov_base.xacro", tmp_path, boxes=True)
    assert failures(new) == []
    assert new.hulls["rexrov/base_link"].volume == pytest.approx(1.83826)
    assert "joints without range of motion fixed: rexrov/pose_sensor_joint" in said(new)
    text = (new.folder / "robot.yaml").read_text()
    assert "mass_x: 779.79, mass_y: 1222.0, mass_z: 3659.9" in text
    # the file's axes are those of a hull with z down: surge by pitch changes its sign
    assert "coupling: [[0.0, 6.8773, 103.32, 8.5426, 165.54, 7.8033]" in text
    (thrusters,) = new.drives
    assert thrusters.thrust.sum() == pytest.approx(74.82 * 2.0 + 748.22 * 4.0)


@pytest.mark.parametrize(
    ("file", "volume"),
    [("robotx_light_buoy", 1.5 * 1.5 * 0.4 + np.pi * 0.4**2 * 1.75), ("round_buoy", 0.0654)],
)
def test_buoys(file: str, volume: float, tmp_path: Path) -> None:
    """Buoys whose drawings are not there float by their collision shapes."""
    new = made(f"buoys/{file}.sdf", tmp_path)
    assert failures(new) == []
    (hull,) = new.hulls.values()
    assert hull.volume == pytest.approx(volume, rel=1e-3)


def _robot(*parts: str) -> ElementTree.Element:
    return ElementTree.fromstring(f"<robot name='r'>{''.join(parts)}</robot>")


def _link(name: str, mass: float, moments: tuple[float, ...], place: str = "0 0 0") -> str:
    rows = " ".join(f'{k}="{x}"' for k, x in zip(("ixx", "iyy", "izz"), moments, strict=True))
    return (
        f'<link name="{name}"><inertial><origin xyz="{place}"/><mass value="{mass}"/>'
        f'<inertia {rows} ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def test_sound_inertias() -> None:
    """The nearest inertia of a body, on small parts alone."""
    root = _robot(
        _link("base", 10.0, (1.0, 1.0, 3.0)),
        _link("camera", 0.1, (0.0, 0.0, 3e-6)),
        _link("imu", 0.01, (0.0, 0.0, 0.0)),
        _link("sound", 0.1, (1e-4, 1e-4, 1e-4)),
        _link("negative", 0.1, (-1.0, 1.0, 1.0)),
    )
    assert sound_inertias(UrdfDraft(root)) == ["camera", "imu"]
    found = {
        str(link.get("name")): [
            float(link.find("inertial/inertia").get(k))  # type: ignore[union-attr, arg-type]
            for k in ("ixx", "iyy", "izz")
        ]
        for link in root
    }
    assert found["base"] == [1.0, 1.0, 3.0]
    np.testing.assert_allclose(found["camera"], [1e-6, 1e-6, 2e-6], rtol=2e-4)
    assert found["camera"][2] < found["camera"][0] + found["camera"][1]
    radius = (0.75 * 0.01 / (np.pi * 1000.0)) ** (1.0 / 3.0)
    np.testing.assert_allclose(found["imu"], 0.4 * 0.01 * radius**2, rtol=1e-6)


def test_base_without_mass_gets_that_of_what_is_fixed_to_it() -> None:
    """Mass, place and axes are those of the whole robot as before."""
    joint = (
        '<joint name="j" type="fixed"><parent link="frame"/><child link="{}"/>'
        '<origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/></joint>'
    )
    root = _robot(
        '<link name="frame"/>',
        _link("small", 1.0, (1.0, 1.0, 1.0)),
        _link("body", 5.0, (1.0, 2.0, 2.5), "0.2 0 0"),
        joint.format("small").replace('"j"', '"k"'),
        joint.format("body"),
    )
    assert weighted_base(UrdfDraft(root)) == "body"
    base = root.find("link[@name='frame']/inertial")
    assert base is not None
    origin = base.find("origin")
    assert origin is not None
    place = [float(x) for x in origin.get("xyz", "").split()]
    np.testing.assert_allclose(place, [0.0, 0.2, 0.5], atol=1e-9)
    np.testing.assert_allclose(
        [float(x) for x in origin.get("rpy", "").split()], [0.0, 0.0, np.pi / 2], atol=1e-9
    )
    left = root.find("link[@name='body']/inertial/mass")
    assert left is not None
    assert left.get("value") == "0"
    assert weighted_base(UrdfDraft(root)) == ""


def test_base_gets_the_mass_of_what_is_fixed_below_frames() -> None:
    """Over a chain of frames, poses add up."""
    joint = (
        '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/>'
        '<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/></joint>'
    )
    root = _robot(
        '<link name="top"/><link name="frame"/>',
        _link("hull", 5.0, (1.0, 2.0, 2.5), "0.5 0 0"),
        joint.format("j", "frame", "hull"),
        joint.format("k", "top", "frame"),
    )
    assert weighted_base(UrdfDraft(root)) == "hull"
    origin = root.find("link[@name='top']/inertial/origin")
    assert origin is not None
    # one ahead, one to the left, half a metre back
    place = [float(x) for x in origin.get("xyz", "").split()]
    np.testing.assert_allclose(place, [0.5, 1.0, 0.0], atol=1e-8)


def test_joints_without_room_are_fixed() -> None:
    """A servo needs two limits that differ; a joint without limits moves freely."""
    joint = '<joint name="{}" type="revolute"><axis xyz="0 0 1"/>{}</joint>'
    root = _robot(
        joint.format("mount", '<limit lower="0" upper="0" effort="0" velocity="0"/>'),
        joint.format("hinge", '<limit lower="-1" upper="1"/>'),
        joint.format("unsaid", '<limit effort="1" velocity="1"/>'),
    )
    assert fixed_joints(UrdfDraft(root)) == ["mount"]
    assert [j.get("type") for j in root] == ["fixed", "revolute", "revolute"]


@pytest.mark.parametrize("forward", ["-x", "y", "-y"])
def test_forward(forward: str, tmp_path: Path) -> None:
    """The axis named forward lies along x of the new base."""
    file = tmp_path / "r.urdf"
    text = ElementTree.tostring(_robot(_link("hull", 5.0, (1.0, 1.0, 1.0))), encoding="unicode")
    file.write_text(text)
    new = scaffold_robot("r", file, parent=tmp_path, forward=forward)
    turn = poses_in_base(new.robot.tree)[1][new.robot.links.index("hull")]
    axis = np.eye(3)["xyz".index(forward[-1])] * (-1.0 if forward[0] == "-" else 1.0)
    np.testing.assert_allclose(turn @ axis, [1.0, 0.0, 0.0], atol=1e-8)  # nine digits
    assert new.robot.mass[0] == 5.0


def test_turned_base_takes_a_free_name() -> None:
    """A link of that name may be there."""
    root = _robot(_link("body", 1.0, (1.0, 1.0, 1.0)))
    assert turned_base(UrdfDraft(root), "-x") == "body_2"


def _quadruped(adapter: str) -> str:
    """Four legs that hang straight, each with a foot behind an adapter beside the knee."""
    parts = [_link("base", 20.0, (0.5, 0.8, 1.0))]
    hinge = '<axis xyz="{}"/><limit lower="-2" upper="2" effort="80" velocity="9"/>'

    def joint(name: str, parent: str, child: str, xyz: str, kind: str, more: str = "") -> str:
        return (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}"/>{more}</joint>'
        )

    for leg, x, y in (("LF", 0.3, 0.2), ("RF", 0.3, -0.2), ("LH", -0.3, 0.2), ("RH", -0.3, -0.2)):
        aside = 0.1 if y > 0 else -0.1
        turn, swing = hinge.format("1 0 0"), hinge.format("0 1 0")
        parts += [_link(f"{leg}_{k}", 0.5, (1e-3,) * 3) for k in ("HIP", "THIGH", "SHANK")]
        parts += [_link(f"{leg}_{k}", 0.1, (1e-4,) * 3) for k in ("ADAPTER", "FOOT")]
        parts += [
            joint(f"{leg}_HAA", "base", f"{leg}_HIP", f"{x} {y} 0", "revolute", turn),
            joint(f"{leg}_HFE", f"{leg}_HIP", f"{leg}_THIGH", "0.05 0 0", "revolute", swing),
            joint(
                f"{leg}_KFE", f"{leg}_THIGH", f"{leg}_SHANK", f"0 {aside} -0.25", "revolute", swing
            ),
            joint(f"{leg}_A", f"{leg}_SHANK", f"{leg}_ADAPTER", adapter, "fixed"),
            joint(f"{leg}_F", f"{leg}_ADAPTER", f"{leg}_FOOT", "0 0 -0.32", "fixed"),
        ]
    return ElementTree.tostring(_robot(*parts), encoding="unicode")


def test_feet_behind_adapters(tmp_path: Path) -> None:
    """The foot is the farthest link fixed to the last one; what lies aside of it makes no bend."""
    file = tmp_path / "walker.urdf"
    file.write_text(_quadruped("0.05 0 0"))
    new = scaffold_robot("walker", file, parent=tmp_path)
    assert [leg["foot"] for leg in new.limbs.legs.values()] == [
        f"{leg}_FOOT" for leg in ("LF", "RF", "LH", "RH")
    ]
    # straight but for the adapter: it is bent to stand
    assert "stance is chosen" in said(new)
    for leg in new.limbs.legs.values():
        assert abs(leg["stance"][2]) > 0.5


def test_a_joint_frame_as_parent_is_its_child(tmp_path: Path) -> None:
    """A rotor whose joint names that of the servo as its parent is tilted by the servo."""
    new = made("bicopter/model.sdf", tmp_path, boxes=True)
    tree = new.robot.tree
    parents = {name: new.robot.links[tree.parent[k]] for k, name in enumerate(new.robot.links)}
    assert parents["cw_mot_link"] == "servo_0"
    assert parents["ccw_mot_link"] == "servo_1"


def test_a_file_without_links_is_refused_whatever_points_forward(tmp_path: Path) -> None:
    """There is no base to turn: the refusal is that of a file without links."""
    path = tmp_path / "none.urdf"
    path.write_text('<robot name="none"/>', encoding="utf-8")
    with pytest.raises(RobotError, match="has no links"):
        scaffold_robot("bare", path, parent=tmp_path, forward="-y")
