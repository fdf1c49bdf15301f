"""What the check says of rotors, thrusters and servos, against closed forms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.check.robot import RobotFinding, Verdict, check_robot
from seals.plugins.actuators.rotors import Rotors
from seals.plugins.actuators.servos import Servos
from seals.plugins.actuators.thrusters import Thrusters
from seals.robot.settings import RobotSettings

BODY = """<link name="body"><inertial><origin xyz="{centre}"/><mass value="2.0"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/></inertial>
<collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>"""
ARM = 0.2
FULL = 1e-5 * 1000.0**2
"""Full thrust of one rotor [N]."""
WEIGHT = 2.0 * 9.81


def settings(folder: Path, elements: str) -> RobotSettings:
    """Write a URDF and return its robot."""
    (folder / "r.urdf").write_text(f'<robot name="r">{elements}</robot>', encoding="utf-8")
    return RobotSettings(name="r", folder=str(folder), urdf="r.urdf")


def cross(direction: Sequence[float] = (1.0, -1.0, 1.0, -1.0), **values: Any) -> Rotors:
    """Return rotors in front, left, behind and right."""
    places = [[ARM, 0.0, 0.0], [0.0, ARM, 0.0], [-ARM, 0.0, 0.0], [0.0, -ARM, 0.0]]
    values = {"thrust_coefficient": [1e-5], "max_speed": [1000.0]} | values
    return Rotors(position=places, direction=list(direction), **values)


def looked(folder: Path, rotors: Any, centre: str = "0 0 0") -> dict[str, RobotFinding]:
    """Return the findings about a body with actuators, by subject."""
    found = check_robot(settings(folder, BODY.format(centre=centre)), {"drives": rotors})
    return {finding.subject: finding for finding in found}


def test_hover_takes_the_weight_by_the_full_thrust(tmp_path: Path) -> None:
    """Four rotors share the weight: m g / (4 k w^2), speed by its root, margin by its inverse."""
    share = WEIGHT / (4.0 * FULL)
    found = looked(tmp_path, cross())["hover in air"]
    assert found.verdict is Verdict.OK
    words = f"{share:.0%} of full thrust, {math.sqrt(share):.0%} of full speed"
    assert found.found.startswith(words)
    assert f"{1.0 / share:.2f} times" in found.found


def test_an_offset_centre_loads_the_rotors_near_it(tmp_path: Path) -> None:
    """With the centre forward by x the front rotor carries (1 + 2 x / a) of its quarter.

    Yaw balance keeps the side pair at half of the weight, so the other half is all that front and
    rear can divide.
    """
    offset = 0.06
    share = WEIGHT / (4.0 * FULL) * (1.0 + 2.0 * offset / ARM)
    found = looked(tmp_path, cross(), f"{offset} 0 0")["hover in air"]
    assert found.found.startswith(f"{share:.0%} of full thrust")


@pytest.mark.parametrize(
    ("rotors", "centre", "verdict", "words"),
    [
        (cross(max_speed=[600.0]), "0 0 0", Verdict.FAIL, "Too weak"),
        (cross(max_speed=[760.0]), "0 0 0", Verdict.WARN, "Little thrust remains"),
        (cross(thrust_coefficient=[1e-3]), "0 0 0", Verdict.WARN, "unit of thrust_coefficient"),
        (cross((1.0, 1.0, 1.0, 1.0)), "0 0 0", Verdict.FAIL, "lternate direction"),
        (cross(), "0.3 0 0", Verdict.FAIL, "centre of gravity"),
        (cross(axis=[[0.0, 0.0, -1.0]]), "0 0 0", Verdict.FAIL, "positions and axes"),
    ],
)
def test_what_cannot_hover_is_told_with_its_cause(
    tmp_path: Path, rotors: Rotors, centre: str, verdict: Verdict, words: str
) -> None:
    """Weak, mistaken in unit, spinning, tipping over: each has its own advice."""
    found = looked(tmp_path, rotors, centre)["hover in air"]
    assert found.verdict is verdict
    assert words in found.advice


def test_rank_and_condition_of_a_cross(tmp_path: Path) -> None:
    """Singular values of the cross are 2, sqrt 2, sqrt 2 and 2 c / a: c is reaction by thrust."""
    found = looked(tmp_path, cross(torque_coefficient=[2e-7]))["allocation"]
    # thrust 2 against yaw 2 * 0.02 / 0.2
    assert found.found == "4 drive(s), rank 4 of 4, condition number 10"


def test_a_direction_out_of_reach_is_named(tmp_path: Path) -> None:
    """Without reaction torque nothing commands yaw; all alike, yaw comes with lift only."""
    found = looked(tmp_path, cross(torque_coefficient=[0.0]))["allocation"]
    assert (found.verdict, found.found) == (
        Verdict.WARN,
        "4 drive(s), rank 3 of 4: yaw cannot be commanded",
    )
    assert "rank 3 of 4" in looked(tmp_path, cross((1.0,) * 4))["allocation"].found


def test_thrusters_in_all_directions_have_rank_six(tmp_path: Path) -> None:
    """Three pairs, each across its arm, command everything; one pair less does not."""
    places = np.kron(np.eye(3), [[ARM], [-ARM]])
    axes = np.kron(np.eye(3)[[1, 2, 0]], np.ones((2, 1)))
    full = Thrusters(position=places.tolist(), axis=axes.tolist(), max_force=[10.0])
    found = looked(tmp_path, full)
    assert "rank 6 of 6, condition number 1" in found["allocation"].found
    assert "hover in air" not in found
    fewer = Thrusters(position=places[:4].tolist(), axis=axes[:4].tolist(), max_force=[10.0])
    assert "rank 4 of 6" in looked(tmp_path, fewer)["allocation"].found


def test_authority_is_what_the_weight_leaves(tmp_path: Path) -> None:
    """Roll: one side rotor up, the other down by what is left, over the inertia."""
    found = looked(tmp_path, cross())["authority in hover"]
    # the side pair keeps half of the weight: 4.905 N each of 10 N, so +-4.905 on 0.2 m each side
    quarter = WEIGHT / 4.0
    roll = 2.0 * min(quarter, FULL - quarter) * ARM / 0.02
    assert f"roll {roll:.3g}, pitch {roll:.3g}" in found.found


JOINT = """<link name="{child}"><inertial><origin xyz="{x} 0 0"/><mass value="0.5"/>
<inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link>
<joint name="{child}_joint" type="revolute"><parent link="body"/><child link="{child}"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>"""


def served(folder: Path, servos: Servos) -> dict[str, RobotFinding]:
    """Return the findings about a body with one lever of 0.1 m."""
    elements = BODY.format(centre="0 0 0") + JOINT.format(child="lever", x=0.1)
    return {f.subject: f for f in check_robot(settings(folder, elements), {"servos": servos})}


def test_servo_figures_are_those_of_an_oscillator(tmp_path: Path) -> None:
    """sqrt(kp / I) / 2 pi, kd / 2 sqrt(kp I), and the torque limit by m g r."""
    inertia, kp, kd = 0.5 * 0.01 + 1e-4, 8.0, 0.3
    found = served(tmp_path, Servos(kp=kp, kd=kd, torque_limit=2.0))
    rate = math.sqrt(kp / inertia) / (2.0 * math.pi)
    ratio = kd / (2.0 * math.sqrt(kp * inertia))
    assert found["servo gains"].found == f"{rate:.3g} Hz, damping ratio {ratio:.3g}"
    times = 2.0 / (0.5 * 9.81 * 0.1)
    assert f"at least {times:.3g} times" in found["servo strength"].found
    assert found["servo bounds"].verdict is Verdict.OK


@pytest.mark.parametrize(
    ("servos", "subject", "verdict", "words"),
    [
        (Servos(kp=8.0, kd=0.01), "servo gains", Verdict.WARN, "raise kd"),
        (Servos(kp=2000.0, kd=10.0), "servo gains", Verdict.WARN, "faster than real servos"),
        (Servos(torque_limit=0.5), "servo strength", Verdict.WARN, "raise torque_limit"),
        (Servos(kp=1e5, kd=1e3), "servo bounds", Verdict.FAIL, "lower the gains"),
    ],
)
def test_odd_servos_are_remarked(
    tmp_path: Path, servos: Servos, subject: str, verdict: Verdict, words: str
) -> None:
    """Ringing, impossibly fast, weak, and beyond what a step can follow."""
    found = served(tmp_path, servos)[subject]
    assert found.verdict is verdict
    assert words in found.advice


def test_joints_without_servos_are_remarked(tmp_path: Path) -> None:
    """A joint that nothing drives swings freely, and it is said."""
    elements = BODY.format(centre="0 0 0") + JOINT.format(child="lever", x=0.1)
    found = {f.subject: f for f in check_robot(settings(tmp_path, elements))}
    assert "swing freely" in found["servos"].advice


def test_a_mesh_in_millimetres_is_remarked(tmp_path: Path) -> None:
    """A mesh of 300 m gets the scale to write; scaled, it gets no remark."""
    corners = "v 0 0 0\nv 300 0 0\nv 0 300 0\nv 0 0 300\n"
    faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "big.obj").write_text(corners + faces, encoding="utf-8")
    mesh = '<visual><geometry><mesh filename="big.obj"{}/></geometry></visual></link>'
    for scale, subject in (("", "mesh"), (' scale="0.001 0.001 0.001"', "meshes")):
        elements = BODY.format(centre="0 0 0").replace("</link>", mesh.format(scale))
        found = {f.subject: f for f in check_robot(settings(tmp_path, elements))}
        assert subject in found
    assert found["meshes"].found == "1 ok"
