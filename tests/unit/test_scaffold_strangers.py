"""Robot files of strangers: hostile ones and mistaken ones are refused in words, none is read."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from seals.cli.main import main
from seals.errors import RobotError
from seals.scaffold.robot import scaffold_robot

INERTIAL = (
    "<inertial><mass>1</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia></inertial>"
)
LINK = f'<link name="body">{INERTIAL}</link>'
SDF = '<sdf version="1.9"><model name="m">{}</model></sdf>'
PLUGIN = SDF.format(LINK + "<plugin filename='libx.so' name='x'>{}</plugin>")
MJCF = '<mujoco model="m"><worldbody><body name="b"><freejoint/>{}</body></worldbody>{}</mujoco>'
GEOM = '<geom type="box" size="0.1 0.1 0.1" mass="1"/>'
CHILD = '<link name="arm">' + INERTIAL + "</link>"
JOINT = (
    '<joint name="j" type="{}"><parent>body</parent><child>{}</child><axis><xyz>{}</xyz></axis>'
    "</joint>"
)
LOOP = '<pose relative_to="body">0 0 0 0 0 0</pose>'
BALL = f'<body name="c"><joint type="ball"/>{GEOM}</body>'
MASS = (
    '<inertial><mass value="{}"/><inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/>'
    "</inertial>"
)
URDF = (
    '<robot name="r"><link name="a">{}</link><link name="b">' + MASS.format(1) + "</link>{}</robot>"
)
HINGE = (
    '<joint name="j" type="revolute"><parent link="{}"/><child link="b"/><axis xyz="{}"/>'
    '<limit lower="{}" upper="1" effort="1" velocity="1"/></joint>'
)
MESH = '<collision><geometry><mesh filename="package://gone/a.stl"/></geometry></collision>'
LIFT = PLUGIN.format("<cla>4</cla><link_name>{}</link_name>{}")
FIN = PLUGIN.format("<link_name>{}</link_name><liftdrag>{}</liftdrag>")
QUADRATIC = "<type>Quadratic</type><lift_constant>7</lift_constant><drag_constant>6</drag_constant>"
NEUTRAL = "<link name='body'>{}<neutrally_buoyant>{}</neutrally_buoyant></link>"
HOSTILE = {
    "an entity": ('<!DOCTYPE s [<!ENTITY a "b">]><sdf version="1.9"/>', "DOCTYPE or an ENTITY"),
    "a file as entity": (
        '<!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/passwd">]><mujoco>&x;</mujoco>',
        "DOCTYPE or an ENTITY",
    ),
    "a deep nest": (
        SDF.format("<model name='n'>" * 300 + "</model>" * 300),
        "nested deeper than 100",
    ),
    "many elements": (SDF.format("<link/>" * 210_000), "more than 200,000 elements"),
    "half a file": ('<sdf version="1.9"><model name="m">', "cannot be read as XML"),
    "another format": ("<scene/>", "contains a <scene>"),
    "an include elsewhere": (
        SDF.format("<include><uri>model://../../etc</uri></include>"),
        "not the name of a model beside it",
    ),
    "an include of an address": (
        SDF.format("<include><uri>https://example.org/m</uri></include>"),
        "package=NAME=FOLDER",
    ),
    "a model that includes itself": (
        SDF.format("<include><uri>model://loop</uri></include>"),
        "includes itself",
    ),
    "an include of a file elsewhere": (
        "<mujoco><include file='../../etc/passwd'/></mujoco>",
        "lies outside its folder",
    ),
    "a file that includes itself": (
        "<mujoco><include file='robot.xml'/></mujoco>",
        "includes itself",
    ),
    "bodies without end": (
        MJCF.format(GEOM + "<replicate count='1000000000'>" + GEOM + "</replicate>", ""),
        "holds a <replicate>",
    ),
    "a plug-in of an engine": (MJCF.format(GEOM + "<plugin plugin='x'/>", ""), "holds a <plugin>"),
    "too many bodies": (MJCF.format(GEOM + f"<body>{GEOM}</body>" * 600, ""), "Allowed: up to 500"),
    "a huge number": (
        SDF.format(LINK.replace("<mass>1<", "<mass>1e300<")),
        "mass='1e300' is not a finite number",
    ),
    "no number": (PLUGIN.format("<motorConstant>nan</motorConstant>"), "motorConstant='nan'"),
    "a frame around itself": (
        SDF.format(
            LINK.replace("><inertial", '><pose relative_to="body">0 0 0 0 0 0</pose><inertial', 1)
        ),
        "relative to itself",
    ),
}
MISTAKES = {
    "a joint that URDF has not": (
        SDF.format(LINK + CHILD + JOINT.format("screw", "arm", "0 0 1")),
        "screw",
    ),
    "a child that is not there": (
        SDF.format(LINK + CHILD + JOINT.format("revolute", "arn", "0 0 1")),
        "Did you mean 'arm'?",
    ),
    "an axis of two numbers": (
        SDF.format(LINK + CHILD + JOINT.format("revolute", "arm", "0 1")),
        "axis='0 1' is not 3 finite numbers",
    ),
    "a decimal comma": (
        SDF.format(LINK.replace("<ixx>.1", "<ixx>0,1")),
        "ixx='0,1' is not a finite number",
    ),
    "two models": (
        '<sdf version="1.9"><world name="w"><model name="a"/><model name="b"/></world></sdf>',
        "holds 2 models: a, b",
    ),
    "a motor on a joint that is not there": (
        SDF.format(
            LINK
            + CHILD.replace("arm", "rotor_0")
            + JOINT.format("continuous", "rotor_0", "0 0 1")
            + "<plugin filename='motor.so'><jointName>i</jointName>"
            "<motorConstant>1e-5</motorConstant></plugin>"
        ),
        "names the joint 'i', which does not exist",
    ),
    "hydrodynamics of a link that is not there": (
        PLUGIN.format("<link_name>boddy</link_name><xU>-1</xU>"),
        "Did you mean 'body'?",
    ),
    "a negative volume": (
        PLUGIN.format("<link name='body'><volume>-1</volume></link>"),
        "Allowed: above zero, in m^3",
    ),
    "added mass of seven numbers": (
        PLUGIN.format(
            "<link name='body'><hydrodynamic_model><added_mass>1 2 3 4 5 6 7</added_mass>"
            "</hydrodynamic_model></link>"
        ),
        "7 numbers",
    ),
    "a mesh that is not there": (
        SDF.format(
            LINK.replace(
                "</link>",
                '<collision name="c"><geometry><mesh><uri>model://gone/a.stl</uri></mesh></geometry>'
                "</collision></link>",
            )
        ),
        "package=gone=FOLDER",
    ),
    "no mass": (SDF.format('<link name="body"/>'), "has no mass"),
    "a ball joint": (
        MJCF.format(GEOM + f'<body name="c"><joint type="ball"/>{GEOM}</body>', ""),
        "three hinges",
    ),
    "a body without size": (MJCF.format('<geom type="sphere"/>', ""), "cannot be compiled"),
    "no body": ("<mujoco><worldbody/></mujoco>", "contains no body"),
    "an axis of zeros": (
        URDF.format(MASS.format(1), HINGE.format("a", "0 0 0", -1)),
        "axis is zero",
    ),
    "a negative mass": (URDF.format(MASS.format(-2), HINGE.format("a", "0 0 1", -1)), "negative"),
    "a mass with its unit": (
        URDF.format(MASS.format("2 kg"), HINGE.format("a", "0 0 1", -1)),
        "value='2 kg' is not a finite number",
    ),
    "limits the wrong way round": (
        URDF.format(MASS.format(1), HINGE.format("a", "0 0 1", 2)),
        "lower limit 2 is above the upper limit 1",
    ),
    "a parent that is not there": (
        URDF.format(MASS.format(1), HINGE.format("bas", "0 0 1", -1)),
        "joint 'j' names the link 'bas'",
    ),
    "two bases": (URDF.format(MASS.format(1), ""), "2 base links: a, b"),
    "a link of a URDF twice": (URDF.format("", "<link name='a'/>"), "the link 'a' occurs twice"),
    "a mesh of a package that is not there": (
        URDF.format(MASS.format(1) + MESH, HINGE.format("a", "0 0 1", -1)),
        "package=gone=FOLDER",
    ),
    "an undefined property of a macro": (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a">'
        + MASS.format("${masss}")
        + "</link></robot>",
        "masss",
    ),
    "a number with its unit in a plug-in": (
        PLUGIN.format("<linkName>body</linkName><motorConstant>8.5e-6 N</motorConstant>"),
        "motorConstant='8.5e-6 N' is not allowed",
    ),
    "a turning direction": (
        PLUGIN.format(
            "<linkName>body</linkName><turningDirection>left</turningDirection>"
            "<motorConstant>1e-5</motorConstant>"
        ),
        "Allowed: cw, ccw",
    ),
    "a pose of five numbers": (
        SDF.format(LINK.replace("<inertial>", "<pose>0 0 0 0 0</pose><inertial>")),
        "pose='0 0 0 0 0' is not 6 finite numbers",
    ),
    "a link of an SDF twice": (SDF.format(LINK + LINK), "the link 'body' occurs twice"),
    "a wing on a link that is not there": (LIFT.format("bdy", ""), "Did you mean 'body'?"),
    "a wing without span": (
        LIFT.format("body", "<forward>0 0 1</forward>"),
        "Allowed: two directions at right angles",
    ),
    "no worldbody": ('<mujoco model="m"><asset/></mujoco>', "at least one <body>"),
    "a motor on no joint": (
        MJCF.format(GEOM, "<actuator><motor joint='hing'/></actuator>"),
        "unknown transmission target 'hing'",
    ),
    "a mesh of textures": (
        MJCF.format(GEOM, "<asset><mesh name='a' file='a.png'/></asset>"),
        "'a.png'",
    ),
    "a web page": ("<!DOCTYPE html><html><body>Not Found</body></html>", "page of a web site"),
    "an answer of a server": ("404: Not Found", "page of a web site"),
    "a pointer": (
        "version https://git-lfs.github.com/spec/v1\noid sha256:ab\nsize 12\n",
        "Fetch the file: git lfs pull.",
    ),
    "a launch file": ("<launch><node name='n'/></launch>", "seals new robot also takes xacro"),
    "a type misspelt": (
        URDF.format(MASS.format(1), HINGE.format("a", "0 0 1", -1)).replace("revolute", "revolut"),
        "Did you mean 'revolute'?",
    ),
    "a hinge without limits": (
        URDF.format(MASS.format(1), HINGE.format("a", "0 0 1", -1)).replace("<limit", "<limits"),
        "has no <limit>",
    ),
    "a joint without a child": (
        URDF.format(MASS.format(1), HINGE.format("a", "0 0 1", -1)).replace(
            '<child link="b"/>', ""
        ),
        "has no child link",
    ),
    "a ring of links": (
        URDF.format(
            MASS.format(1),
            HINGE.format("a", "0 0 1", -1)
            + '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>',
        ),
        "form a cycle",
    ),
    "an include that is not there": (
        MJCF.format(GEOM, "").replace("<worldbody>", "<include file='arm.xml'/><worldbody>"),
        "arm.xml' does not exist",
    ),
    "a fin of a type misspelt": (
        FIN.format("body", "<type>Quadratc</type>"),
        "Did you mean 'Quadratic'?",
    ),
    "a fin without its number": (
        FIN.format("body", "<type>Quadratic</type><drag_constant>6</drag_constant>"),
        "lift_constant='' is not allowed",
    ),
    "a fin in no water": (
        FIN.format("body", QUADRATIC + "<fluid_density>0</fluid_density>"),
        "fluid_density=0 is not allowed",
    ),
    "a fin on a link that is not there": (FIN.format("bdy", QUADRATIC), "Did you mean 'body'?"),
    "a density with its unit": (
        PLUGIN.format("<fluid_density>1027 kg/m^3</fluid_density>" + NEUTRAL.format("", 1)),
        "fluid_density='1027 kg/m^3' is not allowed",
    ),
    "a trim in words": (PLUGIN.format(NEUTRAL.format("", "yes")), "Allowed: 0, 1, true, false"),
    "damping by forward speed of 35 numbers": (
        PLUGIN.format(
            NEUTRAL.format(
                "<hydrodynamic_model><linear_damping_forward_speed>"
                + "1 " * 35
                + "</linear_damping_forward_speed></hydrodynamic_model>",
                0,
            )
        ),
        "has 35 numbers",
    ),
    "a mesh that is not there and weighs": (
        MJCF.format('<geom type="mesh" mesh="a"/>', '<asset><mesh name="a" file="b.stl"/></asset>'),
        "state the mass in an <inertial>",
    ),
    "an inertia far from a body's": (
        URDF.format(MASS.format(1), HINGE.format("a", "0 0 1", -1)).replace(
            'ixx=".1"', 'ixx=".9"', 1
        ),
        "Correct ixx, iyy or izz in the file.",
    ),
    "an axis in a frame misspelt": (
        SDF.format(LINK + CHILD + JOINT.format("revolute", "arm", "0 0 1")).replace(
            "<xyz>", '<xyz expressed_in="bod">'
        ),
        "Did you mean 'body'?",
    ),
    "a world of no model": ('<sdf version="1.9"><world name="w"/></sdf>', "holds 0 models"),
}


@pytest.mark.parametrize("name", [*HOSTILE, *MISTAKES])
def test_strangers_files_are_refused_in_words(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two lines say what is wrong and what is allowed; no folder is left behind."""
    text, said = {**HOSTILE, **MISTAKES}[name]
    if "xmlns:xacro" in text:
        pytest.importorskip("xacro", reason="xacro is not installed")
    home = tmp_path / "loop"
    home.mkdir()
    (home / "robot.xml").write_text(text, encoding="utf-8")
    (home / "model.sdf").write_text(text, encoding="utf-8")
    (home / "a.png").write_bytes(b"x")
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "mine", "--urdf", "loop/robot.xml"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["loop"]


@pytest.mark.parametrize(
    ("joint", "named"),
    [
        (HINGE.format("a", "0 0 1", -90), True),
        (HINGE.format("a", "0 0 1", -9), False),
        (HINGE.format("a", "0 0 1", -1).replace("<axis", '<origin rpy="0 0 180"/><axis'), True),
    ],
)
def test_degrees_are_pointed_out(tmp_path: Path, joint: str, named: bool) -> None:
    """A limit of 90 or an angle of 180 is no radian; a turn and a half may be."""
    file = tmp_path / "robot.urdf"
    file.write_text(URDF.format(MASS.format(1), joint), encoding="utf-8")
    made = scaffold_robot("mine", file, parent=tmp_path)
    said = [remark for remark in made.remarks if "angles above two turns: j" in remark]
    assert bool(said) is named


MOTOR = (
    "<plugin filename='motor.so' name='m'><jointName>j</jointName><motorConstant>1e-5"
    "</motorConstant><maxRotVelocity>900</maxRotVelocity>{}</plugin>"
)
THRUST = MJCF.format(
    GEOM + '<site name="s"/>',
    '<actuator><motor name="t" site="s" gear="0 0 1 0 0 0"{}/></actuator>{}',
)
TOLD = {
    "a motor twice": (
        SDF.format(
            LINK
            + CHILD.replace("arm", "rotor_0")
            + JOINT.format("continuous", "rotor_0", "0 0 1")
            + 2 * MOTOR.format("<momentConstant>0.06</momentConstant>")
        ),
        "a second motor of 'j'",
    ),
    "a motor without a moment": (
        SDF.format(
            LINK
            + CHILD.replace("arm", "rotor_0")
            + JOINT.format("continuous", "rotor_0", "0 0 1")
            + MOTOR.format("")
        ),
        "the drag torque is chosen",
    ),
    "a thrust without bounds": (THRUST.format("", ""), "actuator t (no ctrlrange)"),
    "a pose of too few numbers": (
        THRUST.format(' ctrlrange="0 9"', '<keyframe><key name="home" qpos="0 0 1"/></keyframe>'),
        "keyframes left out: home; 7 numbers are expected",
    ),
}


@pytest.mark.parametrize("name", TOLD)
def test_what_a_file_misses_is_told(name: str, tmp_path: Path) -> None:
    """The robot is made, and what was chosen or left out is named."""
    text, said = TOLD[name]
    file = tmp_path / "robot.xml"
    file.write_text(text, encoding="utf-8")
    made = scaffold_robot("mine", file, parent=tmp_path)
    assert said in "\n".join((*made.changes, *made.remarks))


def test_a_wrong_medium_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The nearest of the three is named."""
    monkeypatch.chdir(tmp_path)
    words = ["new", "robot", "mine", "--urdf", "own_robot/hexa", "--medium", "watr"]
    assert main(words) == 2
    assert "Did you mean 'water'?" in capsys.readouterr().err


def test_packages_of_macros(tmp_path: Path) -> None:
    """$(find) reads from the given folder and from nowhere else."""
    pytest.importorskip("xacro", reason="xacro is not installed")
    space = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    body = (
        '<link name="body"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1"'
        ' iyz="0" izz="1"/></inertial></link>'
    )
    for folder in ("here", "parts", "secret"):
        (tmp_path / folder).mkdir()
        inner = f'<robot {space}><xacro:property name="a" value="1"/>{body}</robot>'
        (tmp_path / folder / "part.xacro").write_text(inner, encoding="utf-8")
    outer = f'<robot name="r" {space}><xacro:include filename="$(find parts){{}}"/></robot>'
    file = tmp_path / "here" / "r.xacro"
    file.write_text(outer.format("/part.xacro"), encoding="utf-8")
    with pytest.raises(Exception, match="package=NAME=FOLDER"):
        scaffold_robot("mine", file, parent=tmp_path / "here")
    given = {"parts": tmp_path / "parts"}
    made = scaffold_robot("mine", file, parent=tmp_path / "here", packages=given)
    assert made.robot.mass.tolist() == [2.0]
    file.write_text(outer.format("/../secret/part.xacro"), encoding="utf-8")
    with pytest.raises(Exception, match="it is elsewhere"):
        scaffold_robot("mine_2", file, parent=tmp_path / "here", packages=given)


def test_rotors_and_thrusters_together(tmp_path: Path) -> None:
    """A vehicle for air and water has both actuators; the columns of the second follow."""
    elements = [f'<link name="hull">{INERTIAL}</link>']
    for k, (x, y) in enumerate(((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2))):
        elements.append(
            f'<link name="rotor_{k}"><pose>{x} {y} 0.1 0 0 0</pose>{INERTIAL}</link>'
            f'<joint name="r{k}" type="continuous"><parent>hull</parent><child>rotor_{k}</child>'
            "<axis><xyz>0 0 1</xyz></axis></joint><plugin filename='m'>"
            f"<jointName>r{k}</jointName><turningDirection>{'cw' if k % 2 else 'ccw'}"
            "</turningDirection><motorConstant>1e-4</motorConstant>"
            "<momentConstant>0.02</momentConstant><maxRotVelocity>900</maxRotVelocity></plugin>"
        )
    elements.append(
        f'<link name="screw"><pose>-0.3 0 0 0 0 0</pose>{INERTIAL}</link><joint name="s" '
        'type="continuous"><parent>hull</parent><child>screw</child><axis><xyz>1 0 0</xyz></axis>'
        "</joint><plugin filename='t'><joint_name>s</joint_name><max_thrust_cmd>30</max_thrust_cmd>"
        "</plugin>"
    )
    file = tmp_path / "m.sdf"
    file.write_text(SDF.format("".join(elements)), encoding="utf-8")
    made = scaffold_robot("mine", file, parent=tmp_path)
    data = yaml.safe_load((made.folder / "robot.yaml").read_text(encoding="utf-8"))
    assert data["actuators"]["thrusters"]["first"] == 4
    assert made.medium.value == "both"
    from seals.run.build import run_settings
    from seals.run.simulation import simulate

    words = [f"robot={made.folder}", "water=fossen", "time.duration=0.02"]
    assert simulate(run_settings(words)).log.rows > 1


def test_a_model_config_names_the_file_of_an_included_model(tmp_path: Path) -> None:
    """Models of Gazebo lie under the name that their model.config states, the last of several."""
    folder = tmp_path / "of"
    (folder / "gps").mkdir(parents=True)
    part = '<sdf version="1.6"><model name="gps"><link name="link">{}</link></model></sdf>'
    (folder / "gps" / "gps.sdf").write_text(part.format(INERTIAL), encoding="utf-8")
    (folder / "gps" / "model.config").write_text(
        "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.6'>gps.sdf</sdf></model>",
        encoding="utf-8",
    )
    joint = (
        '<joint name="j" type="fixed"><parent>body</parent><child>gps::link</child></joint>'
        "<include><uri>model://gps</uri></include>"
    )
    (folder / "it.sdf").write_text(SDF.format(LINK + joint), encoding="utf-8")
    made = scaffold_robot("mine", folder / "it.sdf", parent=tmp_path)
    assert made.robot.mass.sum() == pytest.approx(2.0)


def test_a_scale_of_one_number_is_that_of_all_axes(tmp_path: Path) -> None:
    """Drake reads scale="2" of a mesh so."""
    (tmp_path / "t.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
        encoding="utf-8",
    )
    shape = '<collision><geometry><mesh filename="t.obj" scale="0.2"/></geometry></collision>'
    text = f'<robot name="r"><link name="a">{MASS.format(1)}{shape}</link></robot>'
    (tmp_path / "it.urdf").write_text(text, encoding="utf-8")
    made = scaffold_robot("mine", tmp_path / "it.urdf", parent=tmp_path)
    assert made.hulls["a"].volume == pytest.approx(0.2**3 / 6.0)


def test_a_drawing_of_another_format_is_left_out(tmp_path: Path) -> None:
    """Beside a collision shape it is left out and named; a collision mesh is refused or a box."""
    (tmp_path / "t.gltf").write_text("{}", encoding="utf-8")
    mesh = '<{0}><geometry><mesh filename="t.gltf"/></geometry></{0}>'
    box = '<collision><geometry><box size=".3 .3 .1"/></geometry></collision>'
    text = '<robot name="r"><link name="a">{}</link></robot>'
    (tmp_path / "it.urdf").write_text(
        text.format(MASS.format(1) + mesh.format("visual") + box), encoding="utf-8"
    )
    made = scaffold_robot("mine", tmp_path / "it.urdf", parent=tmp_path)
    assert any("empty or unreadable: t.gltf" in said for said in made.changes)
    (tmp_path / "it.urdf").write_text(
        text.format(MASS.format(1) + mesh.format("collision")), encoding="utf-8"
    )
    with pytest.raises(RobotError, match="an unsupported format"):
        scaffold_robot("other", tmp_path / "it.urdf", parent=tmp_path)


def test_a_boat_of_ten_metres_has_the_drag_of_its_hull(tmp_path: Path) -> None:
    """Turning drag grows with the fifth power of the length: beyond 1e5 N m s^2/rad^2."""
    hull = '<collision><geometry><box size="10 4 1.5"/></geometry></collision>'
    inertial = (
        '<inertial><mass value="15000"/><inertia ixx="2e4" ixy="0" ixz="0" iyy="1e5" iyz="0" '
        'izz="1e5"/></inertial>'
    )
    text = f'<robot name="r"><link name="a">{inertial}{hull}</link></robot>'
    (tmp_path / "it.urdf").write_text(text, encoding="utf-8")
    made = scaffold_robot("mine", tmp_path / "it.urdf", parent=tmp_path)
    assert made.robot.mass.sum() == 15000.0


FREE = (
    '<robot name="r"><link name="world">{}</link><link name="b"><collision><geometry>'
    '<capsule radius="0.1" length="0.3"/></geometry></collision>' + MASS.format(1) + "</link>"
    '<joint name="j" type="floating"><parent link="world"/><child link="b"/></joint></robot>'
)


def test_a_floating_joint_to_the_world_is_left_out(elsewhere: Path) -> None:
    """The base is free without it; a capsule keeps its radius and volume as a cylinder."""
    (elsewhere / "r.urdf").write_text(FREE.format(""), encoding="utf-8")
    lines = "\n".join(scaffold_robot("free", Path("r.urdf"), parent=elsewhere).changes)
    assert "floating joint 'j' to the world left out" in lines
    assert "1 capsule(s) replaced by cylinders" in lines
    settings = yaml.safe_load((elsewhere / "free" / "robot.yaml").read_text(encoding="utf-8"))
    assert settings["fixed_base"] is False
    shape = settings["hulls"]["b"]["shapes"][0]
    assert shape["type"] == "cylinder"
    assert shape["size"] == pytest.approx([0.1, 0.3 + 4.0 / 3.0 * 0.1])


def test_a_floating_joint_between_bodies_is_refused(elsewhere: Path) -> None:
    """A parent with mass is a second body, which no robot has."""
    (elsewhere / "r.urdf").write_text(FREE.format(MASS.format(1)), encoding="utf-8")
    with pytest.raises(RobotError, match=r"type 'floating', between two bodies.*\n.*own"):
        scaffold_robot("free", Path("r.urdf"), parent=elsewhere)
