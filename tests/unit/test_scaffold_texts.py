"""Texts of robot files as people write them: comments, arguments, includes with equal names."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import RobotError
from seals.multibody.tree import forward
from seals.scaffold.robot import scaffold_robot

LINK = (
    '<link name="{}"><inertial><mass value="2"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" '
    'ixz="0" iyz="0"/></inertial></link>'
)
SDF = (
    "<link name='{}'>{}<inertial><mass>{}</mass><inertia><ixx>.1</ixx><iyy>.1</iyy><izz>.1</izz>"
    "</inertia></inertial></link>"
)
XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
DASHES = "<!-- try: gz topic --msgtype x ------ -->"
xacro = pytest.mark.skipif(importlib.util.find_spec("xacro") is None, reason="needs xacro")


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        (
            "urdf",
            f'{DASHES}<robot name="r"><!-- <xacro:old/> -->{DASHES}{LINK.format("a")}</robot>',
        ),
        ("sdf", f"{DASHES}<sdf><model name='m'>{DASHES}{SDF.format('a', '', 2)}</model></sdf>"),
        (
            "xml",
            f"{DASHES}<mujoco>{DASHES}<worldbody><body name='a'><freejoint/>"
            "<geom type='sphere' size='.1' mass='2'/></body></worldbody></mujoco>",
        ),
    ],
)
def test_comments_are_no_xml(tmp_path: Path, ending: str, text: str) -> None:
    """Two dashes and commented macros stop no import, and the robot can be checked after it."""
    (tmp_path / f"it.{ending}").write_text(text, encoding="utf-8")
    made = scaffold_robot("my", tmp_path / f"it.{ending}", parent=tmp_path)
    assert made.robot.mass.tolist() == [2.0]
    assert main(["check", f"robot={made.folder}"]) in (0, 1)


def test_half_a_file_is_still_refused(tmp_path: Path) -> None:
    """A comment without an end hides no fault."""
    (tmp_path / "it.urdf").write_text(f'<robot name="r">{LINK.format("a")}<!-- a -- b </robot>')
    with pytest.raises(RobotError, match="cannot be read as XML"):
        scaffold_robot("my", tmp_path / "it.urdf", parent=tmp_path)


@xacro
def test_macros_with_dashes_in_comments(tmp_path: Path) -> None:
    """In the file and in one that it includes."""
    inner = f'<robot {XACRO}>{DASHES}<xacro:macro name="h">{LINK.format("a")}</xacro:macro></robot>'
    outer = (
        f'<robot name="o" {XACRO}>{DASHES}<xacro:include filename="in.xacro"/><xacro:h/></robot>'
    )
    (tmp_path / "in.xacro").write_text(inner, encoding="utf-8")
    (tmp_path / "out.xacro").write_text(outer, encoding="utf-8")
    assert scaffold_robot("my", tmp_path / "out.xacro", parent=tmp_path).robot.links == ("a",)
    (tmp_path / "in.xacro").write_text(inner.replace("</xacro:macro>", ""), encoding="utf-8")
    with pytest.raises(RobotError, match=r"in\.xacro: mismatched tag"):
        scaffold_robot("other", tmp_path / "out.xacro", parent=tmp_path)


@xacro
def test_arguments_of_macros(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``arg=`` gives a value; without it the message says how."""
    text = f'<robot name="o" {XACRO}>{LINK.format("$(arg ns)_hull")}</robot>'
    (tmp_path / "it.xacro").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ["new", "robot", "my", "--urdf", "it.xacro"]
    assert main(words) == 2
    assert "arg=NAME=VALUE" in capsys.readouterr().err
    assert main([*words, "--arg", "ns"]) == 2
    assert main([*words, "--arg", "ns=rov"]) == 0
    assert 'link name="rov_hull"' in (tmp_path / "my" / "my.urdf").read_text(encoding="utf-8")


def test_included_models_with_equal_names(tmp_path: Path) -> None:
    """Two sensors whose links are both called link: each has its own place and mass."""
    folder = tmp_path / "sensor"
    folder.mkdir()
    model = (
        f"<sdf><model name='s'>{SDF.format('link', '<pose>0 0 .1 0 0 0</pose>', 0.5)}</model></sdf>"
    )
    (folder / "model.sdf").write_text(model, encoding="utf-8")
    parts = "".join(
        f"<include><name>{n}</name><uri>model://sensor</uri><pose>{x} 0 0 0 0 0</pose></include>"
        f"<joint name='j_{n}' type='fixed'><parent>link</parent><child>{n}::link</child></joint>"
        for n, x in (("left", 1.0), ("right", -2.0))
    )
    robot = tmp_path / "robot"
    robot.mkdir()
    text = f"<sdf><model name='m'>{SDF.format('link', '', 3)}{parts}</model></sdf>"
    (robot / "model.sdf").write_text(text, encoding="utf-8")
    made = scaffold_robot("my", robot / "model.sdf", parent=tmp_path).robot
    assert sorted(made.links) == ["left_link", "link", "right_link"]
    origins, _ = forward(made.tree, np.zeros((1, 3)), np.eye(3)[None], np.zeros((1, 0)))
    places = {name: origins[0, k].tolist() for k, name in enumerate(made.links)}
    assert places["left_link"] == pytest.approx([1.0, 0.0, 0.1])
    assert places["right_link"] == pytest.approx([-2.0, 0.0, 0.1])


def test_worlds_that_include_their_robot(tmp_path: Path) -> None:
    """One that is beside it is taken; one of a server is named; of several one has to be given."""
    (tmp_path / "rov").mkdir()
    model = f"<sdf><model name='s'>{SDF.format('hull', '', 5)}</model></sdf>"
    (tmp_path / "rov" / "model.sdf").write_text(model, encoding="utf-8")
    world = "<sdf><world name='w'>{}</world></sdf>"
    near = "<include><uri>model://rov</uri></include>"
    (tmp_path / "w.sdf").write_text(world.format(near), encoding="utf-8")
    assert scaffold_robot("one", tmp_path / "w.sdf", parent=tmp_path).robot.links == ("hull",)
    far = "<include><uri>https://fuel.gazebosim.org/1.0/models/X Y</uri></include>"
    (tmp_path / "w.sdf").write_text(world.format(far), encoding="utf-8")
    with pytest.raises(RobotError, match="fetch the model"):
        scaffold_robot("two", tmp_path / "w.sdf", parent=tmp_path)
    (tmp_path / "w.sdf").write_text(world.format(near + far), encoding="utf-8")
    with pytest.raises(RobotError, match="includes 2 models"):
        scaffold_robot("three", tmp_path / "w.sdf", parent=tmp_path)


@pytest.mark.parametrize(
    ("ending", "text"),
    [
        ("urdf", f'<robot name="r" xmlns="http://drake.mit.edu">{LINK.format("a")}</robot>'),
        (
            "sdf",
            f"<sdf><model name='m'>{SDF.format('a', '<d:hull>1</d:hull>', 2)}</model></sdf>",
        ),
    ],
)
def test_name_spaces_are_looked_over(tmp_path: Path, ending: str, text: str) -> None:
    """A default one, and prefixes that nothing declares, as other programs write them."""
    (tmp_path / f"it.{ending}").write_text(text, encoding="utf-8")
    made = scaffold_robot("my", tmp_path / f"it.{ending}", parent=tmp_path)
    assert made.robot.mass.tolist() == [2.0]
