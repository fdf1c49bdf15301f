"""Robot files made to hang, to fill the memory or to write lines: refused in words, or harmless."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import yaml

from seals.cli.main import main
from seals.errors import RobotError
from seals.scaffold.robot import scaffold_robot

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
FLAT = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
MASS = (
    '<inertial><mass value="1"/><inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/>'
    "</inertial>"
)
URDF = f'<robot name="r"><link name="a">{MASS}{{}}</link></robot>'
MESH = '<collision><geometry><mesh filename="{}" scale="{}"/></geometry></collision>'
BOX = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
INERTIAL = MASS.replace('<mass value="1"/>', "<mass>1</mass>").replace(
    '<inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/>',
    "<inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz></inertia>",
)
LINK = f'<link name="body">{INERTIAL}</link>'
SDF = '<sdf version="1.9"><model name="m">{}</model></sdf>'
GEOM = '<geom type="box" size="0.1 0.1 0.1" mass="1"/>'
MJCF = (
    '<mujoco model="m"><asset>{asset}</asset><worldbody><body name="b"><freejoint/>{body}'
    '<body name="c"><joint name="j" axis="0 0 1"/>' + GEOM + "</body></body></worldbody>"
    "<actuator>{act}</actuator>{more}</mujoco>"
)


def mjcf(asset: str = "", body: str = GEOM, act: str = "", more: str = "") -> str:
    """Return a model of two bodies with something else in it."""
    return MJCF.format(asset=asset, body=body, act=act, more=more)


FAN = {f"i{k}.xml": "<mujoco>" + f"<include file='i{k + 1}.xml'/>" * 12 for k in range(3)}
DEEP = "<model name='n'>" * 19 + LINK + "{}" + "</model>" * 19
INCLUDE = "<include><uri>model://{}</uri></include>"
HOSTILE: dict[str, tuple[dict[str, str], str]] = {
    "includes that fan out": (
        {
            "r": mjcf(more="<include file='i0.xml'/>"),
            **{name: f"{text}</mujoco>" for name, text in FAN.items()},
            "i3.xml": "<mujoco/>",
        },
        "100 together",
    ),
    "includes of many elements": (
        {
            "r": mjcf(more="<include file='big.xml'/>" * 9),
            "big.xml": "<mujoco>" + "<a/>" * 60_000 + "</mujoco>",
        },
        "with 200,000 elements",
    ),
    "models of many elements": (
        {
            "r": SDF.format(LINK + INCLUDE.format("big") * 9),
            "big/model.sdf": SDF.format("<frame/>" * 60_000),
        },
        "above 200,000 elements",
    ),
    "models in models by includes": (
        {
            "r": SDF.format(DEEP.format(INCLUDE.format("m0"))),
            "m0/model.sdf": SDF.format(DEEP.format("")),
        },
        "nests its models too deeply",
    ),
    "a model in a model, and so on": (
        {"r": SDF.format("<model name='n'>" * 40 + LINK + "</model>" * 40)},
        "nests its models too deeply",
    ),
    "geoms without end": ({"r": mjcf(body=GEOM * 2100)}, "elements <geom>"),
    "sites without end": ({"r": mjcf(body=GEOM + "<site/>" * 2100)}, "elements <site>"),
    "keyframes without end": (
        {"r": mjcf(more="<keyframe>" + "<key/>" * 2100 + "</keyframe>")},
        "elements <key>",
    ),
    "motors without end": ({"r": mjcf(act="<motor joint='j'/>" * 2100)}, "elements <motor>"),
    "a mesh that the engine makes": (
        {"r": mjcf(asset="<mesh name='q' builtin='wedge' params='9 9 9 9 0'/>")},
        "lets MuJoCo generate a mesh",
    ),
    "a mesh of half a million numbers": (
        {"r": mjcf(asset=f"<mesh name='q' vertex='{'1 2 4 ' * 160_000}'/>")},
        "a mesh of 480,000 numbers",
    ),
    "shapes without end": ({"r": URDF.format(BOX * 2100)}, "has 2,100 shapes"),
    "a line in the name of a link": (
        {"r": URDF.format("").replace('"a"', '"a&#10;effects: {}"')},
        "a link is named 'a effects: {}'",
    ),
    "a line in the name of a robot": (
        {"r": URDF.format("").replace('"r"', '"r&#10;fixed_base: true"')},
        "a robot is named 'r fixed_base: true'",
    ),
    "a lookup as a name": (
        {"r": URDF.format("").replace('"a"', '"${oc.env:HOME}"')},
        "without '${'",
    ),
    "a name of many signs": ({"r": URDF.format("").replace('"a"', f'"{"a" * 900}"')}, "up to 200"),
    "a mass of 1e308": (
        {"r": URDF.format("").replace('value="1"', 'value="1e308"')},
        "value='1e308' is not a finite number",
    ),
    "a sphere of 1e150 m": (
        {"r": URDF.format('<collision><geometry><sphere radius="1e150"/></geometry></collision>')},
        "radius='1e150' is not a finite number",
    ),
    "a mesh scaled to nothing": (
        {"r": URDF.format(MESH.format("a.obj", "0 0 0")), "a.obj": OBJ},
        "scale='0 0 0'",
    ),
    "a mesh scaled to less than an atom": (
        {"r": URDF.format(MESH.format("a.obj", "1e-300 1 1")), "a.obj": OBJ},
        "scale='1e-300 1 1'",
    ),
    "a flat mesh": ({"r": URDF.format(MESH.format("a.obj", "1 1 1")), "a.obj": FLAT}, "is flat"),
    "a mesh with a corner that is not a number": (
        {"r": URDF.format(MESH.format("a.obj", "1 1 1")), "a.obj": OBJ.replace("1", "nan", 1)},
        "is flat",
    ),
    "an address that is none": (
        {"r": URDF.format(MESH.format("package://[/a.stl", "1 1 1"))},
        "is not an address",
    ),
    "a text that is not there": (
        {"r": URDF.format(MESH.format("compiled://../../a", "1 1 1"))},
        "does not exist",
    ),
}


def written(folder: Path, files: dict[str, str]) -> Path:
    """Write files, return the path of the robot's."""
    for name, text in files.items():
        path = folder / ("robot.xml" if name == "r" else name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder / "robot.xml"


@pytest.mark.thorough
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_robot_is_refused_in_two_lines(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before it costs time or memory; no folder is left behind."""
    files, said = HOSTILE[name]
    written(tmp_path / "it", files)
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "mine", "--urdf", "it/robot.xml"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["it"]


@pytest.mark.parametrize("order", ["actdim='2000000000'", "nsample='16000000' delay='1'"])
def test_a_motor_orders_no_memory(order: str, tmp_path: Path) -> None:
    """What an actuator asks to be kept beside its command is left out."""
    act = f"<general name='a' joint='j' dyntype='user' {order}/>"
    made = scaffold_robot("mine", written(tmp_path / "it", {"r": mjcf(act=act)}), parent=tmp_path)
    assert made.robot.joints == ("j",)


@pytest.mark.parametrize("name", ["a: b", "a #b", "1", "null", "[a", "{a: b}", "- a", "*a", "a/b"])
def test_names_are_names_in_the_files_that_are_written(name: str, tmp_path: Path) -> None:
    """Signs with a meaning in YAML are quoted; a hull's file lies in the robot's folder."""
    text = URDF.format(MESH.format("a.obj", "2 1 1")).replace('"a"', f'"{name}"')
    file = written(tmp_path / "it", {"r": text, "a.obj": OBJ})
    made = scaffold_robot("mine", file, parent=tmp_path)
    data = yaml.safe_load((made.folder / "robot.yaml").read_text(encoding="utf-8"))
    assert [*data["hulls"]] == [name]
    assert data["sensors"]["imu"]["link"] == name
    assert (made.folder / data["hulls"][name]["shapes"][0]["file"]).is_file()
    assert [*data] == ["summary", "urdf", "fixed_base", "hulls", "effects", "sensors"]


def test_a_plug_in_writes_no_line(tmp_path: Path) -> None:
    """The name of its file stands in a comment of robot.yaml, on the same line."""
    plug = (
        "<plugin filename='x.so&#10;fixed_base: true' name='n&#10;fixed_base: true'>"
        "<linkName>body</linkName><motorConstant>1e-5</motorConstant></plugin>"
    )
    file = written(tmp_path / "it", {"r": SDF.format(LINK + plug)})
    made = scaffold_robot("mine", file, parent=tmp_path)
    text = (made.folder / "robot.yaml").read_text(encoding="utf-8")
    assert yaml.safe_load(text)["fixed_base"] is False
    assert "\nfixed_base: true" not in text


@pytest.mark.parametrize("kind", ["include", "model"])
def test_a_link_out_of_the_folder_is_not_followed(kind: str, tmp_path: Path) -> None:
    """A symbolic link among the files of a model leads nowhere."""
    secret = tmp_path / "secret.xml"
    secret.write_text(SDF.format(LINK) if kind == "model" else "<mujoco/>", encoding="utf-8")
    folder = tmp_path / "of" / "it"
    more = "<include file='in.xml'/>"
    files = {"r": mjcf(more=more) if kind == "include" else SDF.format(INCLUDE.format("in"))}
    file = written(folder, files)
    (folder / "in").mkdir()
    (folder / ("in.xml" if kind == "include" else "in/model.sdf")).symlink_to(secret)
    with pytest.raises(RobotError, match=r"outside its folder|does not exist"):
        scaffold_robot("mine", file, parent=tmp_path)


def test_a_pipe_is_said_to_be_no_file(tmp_path: Path) -> None:
    """It is there, and is not waited for."""
    os.mkfifo(tmp_path / "r.urdf")
    with pytest.raises(RobotError, match=r"r\.urdf is not a regular file"):
        scaffold_robot("r", tmp_path / "r.urdf", parent=tmp_path)
