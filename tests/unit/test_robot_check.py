"""The check of a robot: closed forms of floating, and each thing that is worth a remark."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from seals.check.floating import FloatingBody
from seals.check.robot import RobotFinding, Verdict, check_robot
from seals.cli.main import main
from seals.effects.joint_inertia import felt_inertia
from seals.environment.seawater import FRESH_WATER
from seals.plugins.actuators.servos import Servos
from seals.robot.build import build_robot
from seals.robot.settings import HullSettings, RobotSettings, ShapeSettings, ShapeType

LINK = """<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>
<inertia ixx="{i}" ixy="0" ixz="0" iyy="{i}" iyz="0" izz="{i}"/></inertial>
<collision><geometry><sphere radius="0.05"/></geometry></collision></link>"""

Maker = Callable[..., RobotSettings]


def link(name: str = "base", mass: float = 1.0, i: float = 1e-3, centre: str = "0 0 0") -> str:
    """Return a link element."""
    return LINK.format(name=name, mass=mass, i=i, centre=centre)


@pytest.fixture
def make(tmp_path: Path) -> Maker:
    """Build settings of a robot from URDF elements and hulls by link."""

    def build(elements: str, hulls: dict[str, ShapeSettings] | None = None) -> RobotSettings:
        (tmp_path / "r.urdf").write_text(f'<robot name="r">{elements}</robot>', encoding="utf-8")
        placed = {name: HullSettings(shapes=[shape]) for name, shape in (hulls or {}).items()}
        return RobotSettings(name="r", folder=str(tmp_path), urdf="r.urdf", hulls=placed)

    return build


def box(*size: float, position: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> ShapeSettings:
    """Return a box hull."""
    return ShapeSettings(type=ShapeType.box, size=list(size), position=list(position))


def only(findings: list[RobotFinding], subject: str) -> RobotFinding:
    """Return the one finding about a subject."""
    (found,) = [finding for finding in findings if finding.subject == subject]
    return found


def test_box_floats_as_its_closed_form_says(make: Maker) -> None:
    """Draught T = m / (rho L B); GM = T/2 + B^2 / (12 T) - KG for roll, with L for pitch."""
    length, breadth, height, mass = 0.3, 0.2, 0.1, 3.5
    body = FloatingBody(build_robot(make(link(mass=mass), {"base": box(length, breadth, height)})))
    volume = mass / FRESH_WATER
    draught = volume / (length * breadth)
    # the lowest point is found where the wet volume vanishes in rounding: good to a micrometre
    assert body.draught(volume) == pytest.approx(draught, abs=1e-6)
    # the second-order term of a half-degree tilt is a few millionths
    for axis, width in (((1, 0, 0), breadth), ((0, 1, 0), length)):
        expected = draught / 2 + width**2 / (12 * draught) - height / 2
        assert body.metacentric_height(axis, volume) == pytest.approx(expected, rel=1e-3)


def test_submerged_body_rights_itself_by_the_height_of_its_buoyancy(make: Maker) -> None:
    """Fully submerged, GM is the distance from the centre of gravity up to that of buoyancy."""
    hull = box(0.2, 0.2, 0.2, position=(0.0, 0.0, 0.03))
    body = FloatingBody(build_robot(make(link(mass=50.0, centre="0 0 -0.02"), {"base": hull})))
    assert body.metacentric_height((1, 0, 0), body.volume) == pytest.approx(0.05, rel=1e-4)


def test_hulls_of_a_turned_link_are_placed(make: Maker) -> None:
    """A hull on a child link counts where its joint puts it."""
    joint = """<joint name="j" type="fixed"><parent link="base"/><child link="arm"/>
    <origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/></joint>"""
    hull = box(0.1, 0.2, 0.4, position=(0.0, 0.0, 0.1))
    robot = build_robot(make(link() + link("arm") + joint, {"arm": hull}))
    body = FloatingBody(robot)
    up = np.array([0.0, 0.0, 1.0])
    volume, centre = body.wetted(up, 10.0)
    assert volume == pytest.approx(0.1 * 0.2 * 0.4)
    # turned by +90 deg about y, the link's z points along base x
    assert centre == pytest.approx([0.6, 0.0, 0.0], abs=1e-12)
    # the box now stands 0.1 m high: half of it is under a surface through its middle
    assert body.wetted(up, 0.0)[0] == pytest.approx(volume / 2)
    assert body.wetted(up, 0.05)[0] == pytest.approx(volume)


@pytest.mark.thorough
def test_installed_robots_have_no_fault() -> None:
    """No robot that comes along fails its own check."""
    from seals.config.source import robot_names
    from seals.run.build import run_settings

    for name in robot_names():
        findings = check_robot(run_settings([f"robot={name}"]).robot)
        assert [str(f) for f in findings if f.verdict is Verdict.FAIL] == []


def test_floating_sinking_and_neutral_are_told_apart(make: Maker) -> None:
    """The net buoyancy decides the words, its sign and its newtons are right."""
    litre = FRESH_WATER * 1e-3
    for mass, words, sign in (
        (0.5 * litre, "floats, 50% under water", "+"),
        (2.0 * litre, "sinks", "-"),
        (1.001 * litre, "neutral", "-"),
    ):
        found = only(
            check_robot(make(link(mass=mass), {"base": box(0.1, 0.1, 0.1)})), "net buoyancy"
        )
        assert words in found.found
        newton = abs(litre - mass) * 9.81
        assert found.found.startswith(f"{sign}{newton:.3g} N")


@pytest.mark.parametrize(
    ("elements", "hulls", "subject", "verdict", "words"),
    [
        (link(i=0.0), {}, "inertia", Verdict.FAIL, "zero"),
        (link(i=5.0), {"base": box(0.1, 0.1, 0.1)}, "inertia", Verdict.WARN, "radius of gyration"),
        (link(mass=2e6), {}, "mass", Verdict.WARN, "2e+06 kg"),
        (link(), {}, "hull", Verdict.WARN, "no link has one"),
        (
            link(mass=0.5),
            {"base": box(0.05, 0.05, 0.4)},
            "stability in roll",
            Verdict.WARN,
            "metacentric height -",
        ),
        (
            link(mass=3.0, centre="0 0.02 0"),
            {"base": box(0.3, 0.3, 0.1)},
            "stability in roll",
            Verdict.WARN,
            "floats with a list of about",
        ),
    ],
    ids=["zero inertia", "inertia unit", "mass unit", "no hull", "capsizes", "list"],
)
def test_each_oddity_is_found(
    make: Maker,
    elements: str,
    hulls: dict[str, ShapeSettings],
    subject: str,
    verdict: Verdict,
    words: str,
) -> None:
    """What does not fit gets a verdict, a number and an advice."""
    found = only(check_robot(make(elements, hulls)), subject)
    assert found.verdict is verdict
    assert words in found.found
    assert found.advice


def test_angle_of_the_list_is_that_of_the_offset(make: Maker) -> None:
    """A centre of gravity aside by y lists by atan(y / GM)."""
    settings = make(link(mass=3.0, centre="0 0.02 0"), {"base": box(0.3, 0.3, 0.1)})
    draught = 3.0 / FRESH_WATER / 0.09
    height = draught / 2 + 0.09 / (12 * draught) - 0.05
    angle = math.degrees(math.atan2(0.02, height))
    assert f"about {angle:.0f} deg" in only(check_robot(settings), "stability in roll").found


def test_joints_that_cannot_move_or_start_outside(make: Maker) -> None:
    """Limits without travel, and limits without zero, are named."""
    joints = ""
    for name, low, high in (("stuck", 0, 0), ("away", 1, 2), ("fine", -1, 1)):
        limit = f'<limit lower="{low}" upper="{high}" effort="1" velocity="1"/>'
        ends = f'<parent link="base"/><child link="{name}"/>'
        joints += f'{link(name)}<joint name="j_{name}" type="revolute">{ends}{limit}</joint>'
    words = [f.found for f in check_robot(make(link() + joints)) if f.subject == "joint limits"]
    assert words == ["no travel: j_stuck", "zero lies outside: j_away (1 to 2)"]


def test_moving_link_without_mass_is_a_fault(make: Maker) -> None:
    """A joint that moves nothing with mass has no equation of motion."""
    joint = '<joint name="j" type="continuous"><parent link="base"/><child link="tip"/></joint>'
    found = only(check_robot(make(link() + '<link name="tip"/>' + joint)), "moving mass")
    assert (found.verdict, found.found) == (Verdict.FAIL, "no link with mass is attached to j")


def _arm_with_a_massless_tip(make: Maker) -> RobotSettings:
    joint = '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>'
    joint += '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    arm = joint.format("shoulder", "base", "arm") + joint.format("wrist", "arm", "tip")
    return make(link(i=1e-3) + link("arm", i=3e-3) + '<link name="tip"/>' + arm)


def test_joint_that_moves_no_mass_feels_none(make: Maker) -> None:
    """Of two coaxial bodies a joint feels I1 I2 / (I1 + I2); a frame at the end changes nothing."""
    robot = build_robot(_arm_with_a_massless_tip(make))
    assert felt_inertia(robot) == pytest.approx([1e-3 * 3e-3 / 4e-3, 0.0])


@pytest.mark.parametrize(
    ("armature", "verdict", "words"),
    [([0.0, 1e-4], Verdict.OK, "stable"), ([0.0, 0.0], Verdict.FAIL, "'wrist' moves no mass")],
)
def test_servo_of_a_joint_without_mass_needs_an_armature(
    make: Maker, armature: list[float], verdict: Verdict, words: str
) -> None:
    """The inertia of its drive is all that such a joint has; without it, it is named."""
    servo = Servos(kp_each=[0.1, 0.1], kd_each=[0.01, 0.01], armature_each=armature)
    found = check_robot(_arm_with_a_massless_tip(make), {"servos": servo})
    bounds = only(found, "servo bounds")
    assert bounds.verdict is verdict
    assert words in bounds.found


def test_open_hull_mesh_is_remarked(make: Maker, tmp_path: Path) -> None:
    """A hull mesh with a hole is used, and said to be open."""
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    (tmp_path / "open.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\n", encoding="utf-8")
    settings = make(link(), {"base": ShapeSettings(type=ShapeType.mesh, file="open.obj")})
    assert "not watertight" in only(check_robot(settings), "hull of base").found


def test_command_prints_verdicts_and_counts(capsys: pytest.CaptureFixture[str]) -> None:
    """``seals check`` prints a line for each finding, then the count, and returns 0."""
    assert main(["check", "robot=cylinder"]) == 0
    out = capsys.readouterr().out
    assert "pass  mass" in out
    assert "warn  stability in roll" in out
    assert "capsizes" in out
    assert out.splitlines()[-1] == "cylinder: 5 passed, 2 with warnings, 0 failed."


def test_command_returns_one_for_a_fault(
    make: Maker, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A fault makes the exit code 1."""
    make(link(i=0.0))
    (tmp_path / "robot.yaml").write_text("urdf: r.urdf\n", encoding="utf-8")
    assert main(["check", f"robot={tmp_path}"]) == 1
    assert "fail  inertia" in capsys.readouterr().out
