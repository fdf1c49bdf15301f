"""Calibrated numbers written into a robot's folder: text, inertia, copies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from seals.errors import ConfigError
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import RobotSettings
from seals.robot.whole_body import whole_body
from seals.robot.yaml_edit import holds, with_entry, with_number
from seals.sysid.calibration.applying import Edited, base_inertial, with_inertial, write_robot

YAML = """\
urdf: hull.urdf
effects:
  # measured in the tank
  drag: {effect: quadratic_drag, medium: water, coefficient_x: 20.0}
actuators:
  rotors:
    thrust_coefficient: [1.0e-5, 2.0e-5]
"""
URDF = """\
<?xml version="1.0"?>
<robot name="hull">
  <link name="body">
    <inertial><origin xyz="0.01 0.0 -0.02" rpy="0 0 0"/><mass value="2.0"/>
      <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
  </link>
  <link name="tank">
    <inertial><mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
  </link>
  <joint name="mount" type="fixed"><parent link="body"/><child link="tank"/>
    <origin xyz="0.2 0.1 0.0" rpy="0 0 0"/></joint>
</robot>
"""


def built(folder: Path, urdf: str) -> RobotModel:
    """Write a URDF and read it."""
    folder.mkdir(exist_ok=True)
    (folder / "hull.urdf").write_text(urdf, encoding="utf-8")
    return build_robot(RobotSettings(name="hull", folder=str(folder), urdf="hull.urdf"))


def test_a_number_changes_and_the_rest_of_the_file_stays() -> None:
    """One coefficient of a flow mapping, and a list by a factor; comments stay."""
    text = with_number(YAML, ["effects", "drag", "coefficient_x"], lambda old: 31.25)
    assert text == YAML.replace("20.0", "31.25")
    rotors = ["actuators", "rotors", "thrust_coefficient"]
    assert "[1.5e-05, 3e-05]" in with_number(YAML, rotors, lambda old: 1.5 * old)
    with pytest.raises(ConfigError, match="not a number"):
        with_number(YAML, ["effects", "drag"], lambda old: old)


def test_what_was_left_to_a_default_is_added() -> None:
    """A field of a flow mapping, of a block, and a section that the file lacks."""
    inline = with_entry(YAML, ["effects", "drag", "coefficient_y"], "4")
    assert "coefficient_x: 20.0, coefficient_y: 4}" in inline
    block = with_entry(YAML, ["actuators", "rotors", "time_constant"], "[0.04]")
    assert holds(block, ["actuators", "rotors", "time_constant"])
    assert holds(block, ["actuators", "rotors", "thrust_coefficient"])
    hull = with_entry(YAML, ["hulls", "body", "displaced_volume"], "0.01")
    assert hull.endswith("hulls: {body: {displaced_volume: 0.01}}\n")


def test_mass_alone_changes_nothing_else_of_the_vehicle(tmp_path: Path) -> None:
    """Centre of gravity and inertia about it stay, with another link fixed to the base."""
    before = built(tmp_path / "a", URDF)
    mass, centre, inertia = whole_body(before)
    found = base_inertial(before, 1.2, np.array([0.004, 0.0, -0.01]), centre)
    after = built(tmp_path / "b", with_inertial(URDF, "body", *found))
    heavier, there, turned = whole_body(after)
    assert heavier == pytest.approx(mass + 1.2, rel=1e-5)
    assert_allclose(there, centre, atol=1e-6)
    assert_allclose(turned, inertia + np.diag([0.004, 0.0, -0.01]), atol=1e-6)
    with pytest.raises(ConfigError, match="less than that of the links"):
        base_inertial(before, -2.1, np.zeros(3), centre)


def test_a_link_without_an_inertial_of_its_own_is_refused() -> None:
    """The refusal says where the numbers are."""
    with pytest.raises(ConfigError, match=r"calibration\.json"):
        with_inertial(URDF, "wing", 1.0, np.zeros(3), np.eye(3))


def test_the_copy_has_the_new_numbers_and_the_folder_stays(tmp_path: Path) -> None:
    """All files are copied, the edited one with its new text; a folder that is there is refused."""
    own = tmp_path / "own"
    (own / "meshes").mkdir(parents=True)
    (own / "robot.yaml").write_text(YAML, encoding="utf-8")
    (own / "meshes" / "hull.obj").write_text("v 0 0 0\n", encoding="utf-8")
    new = YAML.replace("20.0", "31.25")
    edit = Edited(folder=own, before={"robot.yaml": YAML}, after={"robot.yaml": new})
    out = write_robot(edit, tmp_path / "new")
    assert (out / "robot.yaml").read_text(encoding="utf-8") == new
    assert (out / "meshes" / "hull.obj").is_file()
    assert (own / "robot.yaml").read_text(encoding="utf-8") == YAML
    assert "+  drag: {effect: quadratic_drag, medium: water, coefficient_x: 31.25}" in edit.diff
    with pytest.raises(ConfigError, match="already exists"):
        write_robot(edit, out)
