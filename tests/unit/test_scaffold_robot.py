"""``seals new robot``: a folder from a bare URDF, its numbers derived, its refusals in words."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.check.robot import Verdict, check_robot
from seals.cli.main import main
from seals.robot.build import build_robot
from seals.run.build import run_settings
from seals.scaffold.robot import NewRobot, scaffold_robot

LINK = """<link name="{name}"><inertial><origin xyz="0 0 {low}"/><mass value="{mass}"/>
<inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/></inertial>{shape}</link>"""
BOX = '<collision><geometry><box size="{}"/></geometry></collision>'
MESH = '<{kind}><geometry><mesh filename="{file}" scale="{scale}"/></geometry></{kind}>'
TETRAHEDRON = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def link(name: str, mass: float = 0.1, shape: str = "", low: float = 0.0, i: float = 1e-4) -> str:
    """Return a link element."""
    return LINK.format(name=name, mass=mass, shape=shape, low=low, i=i)


def joint(
    child: str, parent: str, xyz: str, kind: str = "fixed", more: str = "", axis: str = "0 0 1"
) -> str:
    """Return a joint element above ``child``."""
    moving = f'<axis xyz="{axis}"/>{more}' if kind != "fixed" else ""
    return (
        f'<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{xyz}"/>{moving}</joint>'
    )


def limit(low: float, high: float, effort: float = 0.0, velocity: float = 1.0) -> str:
    """Return a limit element."""
    return f'<limit lower="{low}" upper="{high}" effort="{effort}" velocity="{velocity}"/>'


def rotors(names: list[str], kind: str = "continuous", speed: float = 900.0) -> str:
    """Return rotors on a circle of 0.2 m."""
    text = ""
    for k, name in enumerate(names):
        angle = 2.0 * math.pi * (k + 0.5) / len(names)
        xyz = f"{0.2 * math.cos(angle)} {0.2 * math.sin(angle)} 0.05"
        stop = f'<limit effort="1" velocity="{speed}"/>'
        text += link(name, 0.02, i=1e-6) + joint(name, "body", xyz, kind, stop)
    return text


def quad(names: tuple[str, ...] = ("rotor_0", "rotor_1", "rotor_2", "rotor_3")) -> str:
    """Return a box with rotors."""
    return link("body", 1.0, BOX.format("0.2 0.2 0.1"), i=4e-3) + rotors(list(names))


def ascii_stl(scale: float = 1.0) -> str:
    """Return a tetrahedron as a text STL."""
    text = "solid t\n"
    for face in FACES:
        text += "facet normal 0 0 0\nouter loop\n"
        for corner in face:
            text += "vertex " + " ".join(str(scale * x) for x in TETRAHEDRON[corner]) + "\n"
        text += "endloop\nendfacet\n"
    return text + "endsolid t\n"


def write(folder: Path, elements: str, name: str = "model.urdf") -> Path:
    """Write a URDF."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<robot name="model">{elements}</robot>', encoding="utf-8")
    return path


def made(tmp_path: Path, elements: str, medium: str | None = None) -> NewRobot:
    """Scaffold a robot from elements."""
    urdf = write(tmp_path / "from", elements)
    return scaffold_robot("mine", urdf, parent=tmp_path, medium=medium)


def yaml_of(new: NewRobot) -> dict[str, dict[str, dict[str, object]]]:
    """Return ``robot.yaml`` as data."""
    return yaml.safe_load((new.folder / "robot.yaml").read_text(encoding="utf-8"))


def test_a_quadrotor_hovers_at_half_thrust(tmp_path: Path) -> None:
    """Rotors are found, balanced in yaw, and strong enough by the stated rule; nothing fails."""
    new = made(tmp_path, quad())
    settings = run_settings([f"robot={new.folder}", "water=fossen"])
    findings = check_robot(settings.robot, settings.actuators)
    assert [str(f) for f in findings if f.verdict is Verdict.FAIL] == []
    (hover,) = [f.found for f in findings if f.subject == "hover in air"]
    assert hover.startswith("50% of full thrust")
    rotors = settings.actuators["rotors"]
    assert rotors.limit.tolist() == [900.0] * 4
    assert sum(rotors.direction) == 0.0
    # 4 k w^2 = 2 m g, three digits in the file
    assert 4 * rotors.thrust_coefficient[0] * 900.0**2 == pytest.approx(2 * 1.08 * 9.81, rel=5e-3)


def test_rotor_joints_no_longer_move(tmp_path: Path) -> None:
    """Propellers on continuous joints become fixed links of the same mass."""
    new = made(tmp_path, quad())
    assert new.robot.joints == ()
    assert float(new.robot.mass.sum()) == pytest.approx(1.08)
    assert "4 rotor joint(s) fixed" in " ".join(new.changes)


def test_names_say_the_sense_of_rotation(tmp_path: Path) -> None:
    """``cw`` and ``ccw`` in the names rule over the alternation."""
    names = ("prop_ccw_0", "prop_ccw_1", "prop_cw_0", "prop_cw_1")
    new = made(tmp_path, quad(names))
    assert new.drives
    assert new.drives[0].direction.tolist() == [1.0, 1.0, -1.0, -1.0]


def test_guards_and_mounts_are_no_rotors(tmp_path: Path) -> None:
    """Names that only contain such a word are passed over; without rotors it says so."""
    new = made(tmp_path, quad(("prop_guard_0", "prop_guard_1", "motor_mount_0", "motor_mount_1")))
    assert not new.drives
    assert "no link is named like a rotor" in " ".join(new.remarks)


def test_thrusters_become_thrusters(tmp_path: Path) -> None:
    """Links named thruster push both ways along their own x."""
    elements = link("hull", 5.0, BOX.format("0.4 0.2 0.2"), i=0.05)
    for side in (1, -1):
        elements += link(f"thruster_{side + 1}", 0.1) + joint(
            f"thruster_{side + 1}", "hull", f"0 {0.15 * side} 0"
        )
    settings = run_settings([f"robot={made(tmp_path, elements).folder}"])
    assert settings.actuators["thrusters"].axis == [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]


ARM = (
    link("base", 2.0, BOX.format("0.3 0.3 0.1"), i=0.02)
    + link("upper", 0.3, BOX.format("0.04 0.04 0.2"), low=-0.1)
    + joint("upper", "base", "0 0 -0.05", "revolute", limit(-1.5, 1.5, effort=4.0), "0 1 0")
    + link("fore", 0.2, low=-0.1)
    + joint("fore", "upper", "0 0 -0.2", "revolute", limit(0.2, 2.0), "0 1 0")
    + link("wrist_plate", 0.05)
    + joint("wrist_plate", "fore", "0 0 -0.2")
    + link("left", 0.01, low=-0.03)
    + joint("left", "wrist_plate", "0 0.02 0", "prismatic", limit(0.0, 0.03), "0 1 0")
    + link("right", 0.01, low=-0.03)
    + joint("right", "wrist_plate", "0 -0.02 0", "prismatic", limit(0.0, 0.03), "0 -1 0")
    + link("left_pad", 0.001)
    + joint("left_pad", "left", "0 0 -0.05")
)


def test_a_chain_is_an_arm_and_its_fork_a_gripper(tmp_path: Path) -> None:
    """Joints, tool, tips, and which end of the travel is open are read off the tree."""
    new = made(tmp_path, ARM)
    data = yaml_of(new)
    joints = ["upper_joint", "fore_joint"]
    assert data["arms"]["arm"] == {"joints": joints, "tool": "wrist_plate", "stowed": [0.0, 0.2]}
    assert data["grippers"]["gripper"] == {
        "joints": ["left_joint", "right_joint"],
        "open": [0.03, 0.03],
        "closed": [0.0, 0.0],
        "tips": ["left_pad", "right"],
    }
    settings = run_settings([f"robot={new.folder}"])
    robot = build_robot(settings.robot)
    assert robot.arms["arm"].tool == robot.links.index("wrist_plate")


def test_servos_are_critically_damped_at_six_hertz(tmp_path: Path) -> None:
    """Stiffness I w^2 and damping 2 I w, with the inertia of all that hangs on the joint."""
    new = made(tmp_path, ARM, medium="air")
    servos = yaml_of(new)["actuators"]["servos"]
    w = 2.0 * math.pi * 6.0
    # about the elbow: forearm, plate, fingers and pad, all hanging straight down
    bodies = ((0.2, 0.1), (0.05, 0.2), (0.01, 0.23), (0.01, 0.23), (0.001, 0.25))
    inertia = sum(m * z**2 + 1e-4 for m, z in bodies)
    kp, kd = servos["kp_each"], servos["kd_each"]
    assert isinstance(kp, list)
    assert isinstance(kd, list)
    assert kp[1] == pytest.approx(inertia * w**2, rel=5e-3)
    assert kd[1] == pytest.approx(2.0 * inertia * w, rel=5e-3)
    limits = servos["torque_limit_each"]
    assert isinstance(limits, list)
    # the first is the URDF's effort, the second three times what holds it level and swings it
    assert limits[0] == 4.0
    held = 9.81 * sum(m * z for m, z in bodies)
    swung = 0.5 * (2.0 * math.pi) ** 2 * inertia
    assert limits[1] == pytest.approx(3.0 * (held + swung), rel=0.02)


def test_a_density_gives_links_their_mass(tmp_path: Path) -> None:
    """Two boxes of 500 kg/m^3 on one link: mass, centre and inertia as of the solid bodies."""
    shape = BOX.format("0.1 0.1 0.1").replace("<geo", '<origin xyz="{} 0 0"/><geo', 1)
    bare = f'<link name="body">{shape.format(-0.1)}{shape.format(0.2)}</link>'
    urdf = write(tmp_path / "from", bare)
    with pytest.raises(Exception, match="density=500"):
        scaffold_robot("mine", urdf, parent=tmp_path)
    new = scaffold_robot("mine", urdf, parent=tmp_path, density=500.0)
    assert new.robot.mass.tolist() == [1.0]
    assert new.robot.centre[0] == pytest.approx([0.05, 0.0, 0.0])
    # the file holds six digits
    own = 1.0 / 12.0 * 2.0 * 0.01
    wanted = np.diag([own, own + 0.15**2, own + 0.15**2])
    assert new.robot.inertia[0] == pytest.approx(wanted, rel=1e-5, abs=1e-9)


def test_a_base_of_mass_zero_is_bolted_to_the_world(tmp_path: Path) -> None:
    """As engines take such files of arms; a density gives it mass and lets it go."""
    hinge = joint("arm", "base", "0 0 0.1", "revolute", limit(-1.0, 1.0))
    base = link("base", 0.0, BOX.format("0.1 0.1 0.1"), i=0.01)
    urdf = write(tmp_path / "from", base + hinge + link("arm", 1.0, low=0.1, i=0.01))
    new = scaffold_robot("bolted", urdf, parent=tmp_path)
    assert yaml.safe_load((new.folder / "robot.yaml").read_text())["fixed_base"] is True
    assert "'base' has a mass of 0: bolted to the world" in " ".join(new.changes)
    freed = scaffold_robot("freed", urdf, parent=tmp_path, density=500.0)
    assert yaml.safe_load((freed.folder / "robot.yaml").read_text())["fixed_base"] is False
    assert freed.robot.mass.tolist() == [0.5, 1.0]


def test_a_frame_as_base_is_left_out(tmp_path: Path) -> None:
    """An empty base on a fixed joint goes, and the first link with mass is the base."""
    elements = '<link name="base_footprint"/>' + joint("body", "base_footprint", "0 0 1") + quad()
    new = made(tmp_path, elements)
    assert new.robot.links[0] == "body"
    assert "base_footprint" in " ".join(new.changes)


def test_foreign_elements_are_left_out(tmp_path: Path) -> None:
    """Elements of other programs do not reach the folder, comments do."""
    foreign = "<gazebo><plugin name='x'/></gazebo><transmission name='t'/><!-- mine -->"
    new = made(tmp_path, quad() + foreign)
    text = (new.folder / "mine.urdf").read_text(encoding="utf-8")
    assert "gazebo" not in text
    assert "transmission" not in text
    assert "<!-- mine -->" in text


def test_a_text_stl_is_converted_and_scaled(tmp_path: Path) -> None:
    """A mesh the engine cannot read becomes OBJ; a scaled one gives a hull of the scaled size."""
    mesh = MESH.format(kind="collision", file="t.stl", scale="0.001 0.001 0.001")
    urdf = write(tmp_path / "from", link("body", 0.1, mesh))
    (urdf.parent / "t.stl").write_text(ascii_stl(300.0), encoding="utf-8")
    new = scaffold_robot("mine", urdf, parent=tmp_path)
    assert (new.folder / "meshes" / "t.obj").is_file()
    settings = run_settings([f"robot={new.folder}"])
    (hull,) = build_robot(settings.robot).hulls
    assert hull is not None
    assert hull.volume == pytest.approx(0.3**3 / 6.0, rel=1e-6)


@pytest.mark.parametrize(
    ("urdf", "mesh"),
    [
        ("ws/src/my_pkg/urdf/a.urdf", "ws/src/my_pkg/meshes/t.stl"),
        ("ws/src/other/urdf/a.urdf", "ws/src/my_pkg/meshes/t.stl"),
        ("flat/a.urdf", "flat/meshes/t.stl"),
        ("renamed/urdf/a.urdf", "renamed/meshes/t.stl"),
    ],
)
def test_packages_are_found_around_the_urdf(tmp_path: Path, urdf: str, mesh: str) -> None:
    """``package://`` means a parent folder, one beside it, or the URDF's own surroundings."""
    element = MESH.format(kind="visual", file="package://my_pkg/meshes/t.stl", scale="1 1 1")
    path = write((tmp_path / urdf).parent, link("body", 0.1, element), "a.urdf")
    (tmp_path / mesh).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / mesh).write_text(ascii_stl(), encoding="utf-8")
    assert scaffold_robot("mine", path, parent=tmp_path).hulls["body"].volume > 0.0


def test_a_package_can_be_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``package=NAME=FOLDER`` rules where nothing is found around the URDF."""
    element = MESH.format(kind="visual", file="package://far/t.stl", scale="1 1 1")
    write(tmp_path / "here", link("body", 0.1, element))
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "t.stl").write_text(ascii_stl(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ["new", "robot", "mine", "--urdf", "here/model.urdf"]
    assert main(words) == 2
    assert main([*words, "--package", "far=elsewhere"]) == 0


def test_a_fin_is_held_by_its_effort(tmp_path: Path) -> None:
    """2 N m at 0.4 rad are 5 N m/rad, of which 30 Hz take what a light fin can; others 6 Hz."""
    joint = (
        '<joint name="{0}_joint" type="revolute"><parent link="body"/><child link="{0}"/>'
        '<axis xyz="0 1 0"/><limit lower="-0.4" upper="0.4" effort="{1}" velocity="3"/></joint>'
    )
    parts = [link("body", 9.0), *(link(name, 0.1) for name in ("fin_port", "rudder", "lid"))]
    parts += [joint.format(*x) for x in (("fin_port", 2), ("rudder", 1e-6), ("lid", 2))]
    made = scaffold_robot("mine", write(tmp_path, "".join(parts)), parent=tmp_path)
    entry = yaml.safe_load((made.folder / "robot.yaml").read_text("utf-8"))
    kp = dict(zip(made.robot.joints, entry["actuators"]["servos"]["kp_each"], strict=True))
    inertia = kp["lid_joint"] / (2.0 * np.pi * 6.0) ** 2
    assert kp["rudder_joint"] == kp["lid_joint"]
    stiffest = min(2.0 / 0.4, inertia * (2.0 * np.pi * 30.0) ** 2)
    assert kp["fin_port_joint"] == pytest.approx(stiffest, rel=0.01)
    assert kp["fin_port_joint"] > 1.5 * kp["lid_joint"]


def test_a_missing_mesh_names_the_places_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The refusal lists where it looked and how to say it; no folder is left behind."""
    element = MESH.format(kind="visual", file="package://gone/meshes/t.stl", scale="1 1 1")
    write(tmp_path, link("body", 0.1, element))
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "mine", "--urdf", "model.urdf"]) == 2
    said = capsys.readouterr().err
    assert "package://gone/meshes/t.stl" in said
    assert str(tmp_path / "gone" / "meshes" / "t.stl") in said
    assert "package=gone=FOLDER" in said
    assert [p.name for p in tmp_path.iterdir()] == ["model.urdf"]


def test_millimetres_are_refused_with_the_remedy(tmp_path: Path) -> None:
    """A mesh of 300 m is taken for one of 300 mm, and the scale to write is given."""
    urdf = write(tmp_path, link("body", 0.1, MESH.format(kind="visual", file="t.stl", scale="1")))
    urdf.write_text(urdf.read_text().replace(' scale="1"', ""), encoding="utf-8")
    (tmp_path / "t.stl").write_text(ascii_stl(300.0), encoding="utf-8")
    with pytest.raises(Exception, match=r"(?s)millimetres.*0\.001 0\.001 0\.001"):
        scaffold_robot("mine", urdf, parent=tmp_path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["robott", "x"], "Did you mean 'robot'?"),
        (["robot"], "has no name"),
        (["robot", "x"], "model.urdf"),
        (["robot", "x", "--urdf", "modl.urdf"], "Did you mean 'model.urdf'?"),
        (["robot", "x", "--udrf", "model.urdf"], "Did you mean 'urdf'?"),
        (["robot", "x", "--urdf"], "--urdf has no value"),
        (["robot", "My-Robot", "--urdf", "model.urdf"], "my_robot"),
        (["robot", "ball", "--urdf", "model.urdf"], "already installed"),
        (["robot", "crab", "--urdf", "model.urdf"], "animal 'crab' is already installed"),
        (["robot", "taken", "--urdf", "model.urdf"], "exists already"),
        (["robot", "x", "--urdf", "model.urdf", "medum=water"], "Did you mean 'medium'?"),
        (["robot", "x", "--urdf", "model.urdf", "--package", "a"], "NAME=FOLDER"),
        (["robot", "x", "--urdf", "model.urdf", "--density", "heavy"], "kg/m^3"),
        (["robot", "x", "--urdf", "model.urdf", "--missing-meshes", "none"], "Allowed: boxes"),
        (["robot", "x", "--urdf", "model.urdf", "--forward=up"], "Allowed: x, -x, y, -y"),
        (["effect", "gravity"], "already installed"),
        (["effect", "x", "--urdf", "model.urdf"], "no option 'urdf'"),
    ],
)
def test_refusals_are_two_lines(
    words: list[str],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Whatever is mistyped, two lines say what and what to write instead."""
    write(tmp_path, quad())
    (tmp_path / "taken").mkdir()
    monkeypatch.chdir(tmp_path)
    assert main(["new", *words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 2


def test_what_to_write_next_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``urdf=FILE`` works as ``--urdf FILE``; the output ends with the next commands."""
    write(tmp_path, quad())
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "mine", "urdf=model.urdf"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "mine/robot.yaml: 1.08 kg, 5 links, 0 joints, 4 rotors"
    assert "  seals check robot=mine" in lines
