"""URDFs in the dialects of other programs load with the right numbers, or are refused in words."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from seals.backend import Configuration
from seals.check.floating import FloatingBody
from seals.check.robot import RobotFinding, Verdict, check_robot
from seals.environment.settings import EnvironmentSettings
from seals.errors import MissingExtra, RobotError
from seals.plugins.backends.pybullet import BackendPybullet
from seals.robot.build import build_robot
from seals.robot.model import RobotModel
from seals.robot.settings import GripperSettings, RobotSettings
from seals.scaffold.robot import scaffold_robot

URDFS = Path(__file__).with_name("urdfs")
XACRO = URDFS / "block" / "block.urdf.xacro"


def direct(name: str, folder: str = "") -> RobotSettings:
    """Return the settings of a URDF as it lies there."""
    return RobotSettings(name=name, folder=str(URDFS / (folder or name)), urdf=f"{name}.urdf")


def stays_whole(robot: RobotModel) -> None:
    """Let the robot turn freely in the engine, and see that its spin does not change."""
    backend = BackendPybullet()
    backend.open(EnvironmentSettings(), 0.001)
    try:
        body = backend.add(robot)
        joints = np.zeros(robot.tree.joints)
        spin = np.array([0.0, 0.0, 1.0])
        still = (np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), spin, joints, joints)
        body.reset(Configuration(*still))
        for _ in range(5):
            backend.advance()
        assert body.read().angular_velocity == pytest.approx(spin, abs=2e-2)
        assert np.all(np.isfinite(body.read().joints))
    finally:
        backend.close()


def remarks(findings: list[RobotFinding], verdict: Verdict) -> str:
    """Return all findings of one verdict as text."""
    return "\n".join(str(finding) for finding in findings if finding.verdict is verdict)


def test_ros_package_is_taken_over(tmp_path: Path) -> None:
    """package:// meshes, a massless root and foreign blocks: `seals new` makes a sound folder."""
    made = scaffold_robot("wanderer", URDFS / "rover_ros" / "urdf" / "rover.urdf", parent=tmp_path)
    assert made.robot.links == ("base_link", "wheel")
    assert made.robot.mass.sum() == pytest.approx(2.7)
    assert np.isinf(made.robot.upper[0])
    assert [p.name.lower() for p in (tmp_path / "wanderer" / "meshes").iterdir()] == ["hull.stl"]
    # the box of 0.3 x 0.2 x 0.1 m and the wheel of 0.04 m radius and 0.02 m width
    volume = sum(hull.volume for hull in made.hulls.values())
    assert volume == pytest.approx(0.006 + math.pi * 0.04**2 * 0.02, rel=0.01)
    settings = RobotSettings(name="wanderer", folder=str(made.folder), urdf="wanderer.urdf")
    stays_whole(build_robot(settings))


def test_ros_package_as_it_lies_is_refused() -> None:
    """Without being taken over, its mesh is refused by name, with what to do."""
    with pytest.raises(RobotError, match=r"hull\.STL' does not exist") as caught:
        build_robot(direct("rover", "rover_ros/urdf"))
    assert "seals new robot NAME urdf=FILE" in str(caught.value)


def test_mimic_joint_is_pointed_out() -> None:
    """A mimic joint loads as a joint of its own, and the check says so until a gripper has both."""
    settings = direct("claw")
    robot = build_robot(settings)
    assert robot.joints == ("left_knuckle", "right_knuckle")
    warned = remarks(check_robot(settings), Verdict.WARN)
    assert "right_knuckle follows left_knuckle" in warned
    assert "grippers:" in warned
    both = ["left_knuckle", "right_knuckle"]
    settings.grippers = {"claw": GripperSettings(joints=both, open=[0.0, 0.0], closed=[0.3, -0.3])}
    assert "follows" not in remarks(check_robot(settings), Verdict.WARN)
    stays_whole(robot)


def test_obj_in_millimetres_keeps_its_scale(tmp_path: Path) -> None:
    """An OBJ drawn in millimetres with a scale displaces what its box in metres does."""
    made = scaffold_robot("claw", URDFS / "claw" / "claw.urdf", parent=tmp_path)
    assert made.hulls["palm"].volume == pytest.approx(0.08 * 0.08 * 0.04, rel=1e-3)
    assert made.robot.joints == ("left_knuckle", "right_knuckle")


def test_tree_of_fixed_joints() -> None:
    """Turned fixed joints put every mass where the chain of rotations puts it."""
    robot = build_robot(direct("stack"))
    assert robot.joints == ()
    assert robot.links == ("base", "mast", "head", "eye")
    # roll by 90 degrees turns the mast's z into -y of the base: its mass at y = -0.1, the head's
    # at y = -0.2
    expected = (0.5 * np.array([0.0, -0.1, 0.05]) + 0.25 * np.array([0.0, -0.2, 0.05])) / 1.75
    assert FloatingBody(robot).gravity_centre == pytest.approx(expected, abs=1e-12)
    assert not remarks(check_robot(direct("stack")), Verdict.FAIL)
    stays_whole(robot)


def test_missing_inertials_are_refused() -> None:
    """A URDF drawn for pictures is refused with the link that needs a mass."""
    with pytest.raises(RobotError, match="base link 'base' has no mass") as caught:
        build_robot(direct("bare"))
    assert "<inertial>" in str(caught.value)


def test_odd_order_and_odd_numbers() -> None:
    """Joints before links, E notation, an axis of length two, file:// and ASCII STL are read."""
    settings = direct("crane")
    robot = build_robot(settings)
    assert robot.links == ("tower", "jib", "hook")
    assert robot.joints == ("slew", "lift")
    assert robot.tree.prismatic == (False, True)
    assert robot.tree.axis[1] == pytest.approx([0.0, 0.0, 1.0])
    assert (robot.lower[1], robot.upper[1]) == (-0.25, 0.0)
    # 0.6 kg at 0.15 m and 0.2 kg at 0.3 m along x
    assert FloatingBody(robot).gravity_centre[0] == pytest.approx((0.09 + 0.06) / 4.8)
    stays_whole(robot)


def test_xacro_without_the_package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A xacro file names the missing package, and nothing is left behind."""
    monkeypatch.setitem(sys.modules, "xacro", None)
    with pytest.raises(MissingExtra, match="pip install xacro"):
        scaffold_robot("block", XACRO, parent=tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(importlib.util.find_spec("xacro") is None, reason="xacro is not installed")
def test_xacro_with_the_package(tmp_path: Path) -> None:
    """A xacro file becomes a robot with the numbers that its macros compute."""
    made = scaffold_robot("block", XACRO, parent=tmp_path)
    assert made.robot.mass == pytest.approx([1.0])
    # a cube of 0.2 m and 1 kg: m a^2 / 6
    assert np.diag(made.robot.inertia[0]) == pytest.approx(np.full(3, 0.04 / 6.0))


def test_xacro_that_cannot_be_expanded(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What xacro says is handed on, with what to do."""
    xacro = pytest.importorskip("xacro", reason="xacro is not installed")
    broken = tmp_path / "broken.urdf.xacro"
    broken.write_text(XACRO.read_text(encoding="utf-8").replace("${size}", "${length}"))
    monkeypatch.setattr(xacro, "print_location", lambda *_: None, raising=False)
    with pytest.raises(RobotError, match="xacro cannot expand it"):
        scaffold_robot("block", broken, parent=tmp_path)
