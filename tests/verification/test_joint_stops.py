"""Joint stops act between links: they make no momentum, and propel nothing in still water."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest

from seals.api import make
from seals.arrays import Floats
from seals.cli.main import main
from seals.multibody.kinematics import Kinematics
from seals.world.actor import Actor

ENGINES = ("pybullet", "mujoco")
LINK = """
  <link name="{name}">
    <inertial><origin xyz="{centre}"/><mass value="{mass}"/>
      <inertia ixx="{i[0]}" iyy="{i[1]}" izz="{i[2]}" ixy="0" ixz="0" iyz="0"/></inertial>
    {shape}
  </link>"""
HINGE = """
  <joint name="{child}_hinge" type="revolute"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{at}"/><axis xyz="{axis}"/>
    <limit lower="-{stop}" upper="{stop}" effort="0" velocity="0"/></joint>"""


def box(size: str, at: str = "0 0 0") -> str:
    """Shape of a link."""
    return f'<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>'


def folder(place: Path, parts: list[str]) -> Path:
    """A robot's URDF."""
    place.write_text(f'<?xml version="1.0"?><robot name="limbs">{"".join(parts)}</robot>')
    return place


def momentum(actor: Actor) -> Floats:
    """Linear and angular momentum about the world's origin, shape (6,)."""
    poses = actor.body.poses()
    links = Kinematics(actor.robot.tree, poses.origins, poses.rotations)
    total = np.zeros(6)
    for place, turn, inertia, twist in zip(
        poses.origins[0],
        poses.rotations[0],
        actor.robot.spatial_inertia,
        links.twists(poses.speed)[0],
        strict=True,
    ):
        own = inertia @ twist
        linear = turn @ own[:3]
        total += np.concatenate((linear, np.cross(place, linear) + turn @ own[3:]))
    return total


@pytest.mark.parametrize("compiled", ["false", "true"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_stop_leaves_the_momentum_as_it_is(tmp_path: Path, engine: str, compiled: str) -> None:
    """Of a tumbling arm whose two hinges hit their stops: to rounding, where 0.8 % appeared."""
    pytest.importorskip(engine)
    if compiled == "true":
        pytest.importorskip("llvmlite")
    parts = [
        LINK.format(
            name="hub", centre="0.01 -0.02 0.015", mass=1, i=(0.01, 0.012, 0.015), shape=""
        ),
        LINK.format(name="upper", centre="0 0 -0.06", mass=0.2, i=(3e-4, 3e-4, 4e-5), shape=""),
        LINK.format(name="fore", centre="0 0 -0.06", mass=0.15, i=(2e-4, 2e-4, 2e-5), shape=""),
        HINGE.format(parent="hub", child="upper", at="0.02 0 -0.06", axis="0 1 0", stop=0.8),
        HINGE.format(parent="upper", child="fore", at="0 0 -0.13", axis="1 0 0", stop=0.6),
    ]
    place = tmp_path / "arm"
    place.mkdir()
    folder(place / "arm.urdf", parts)
    (place / "robot.yaml").write_text("summary: arm with stops\nurdf: arm.urdf\n")
    words = [f"robot={place}", "water=none", "environment.gravity=0", f"backend={engine}"]
    words += ["initial.velocity=[0.3,-0.2,0.1]", "initial.angular_velocity=[1.5,2.0,-1.0]"]
    words += ["initial.joint_velocity=[4,-3]", f"backend.compiled={compiled}"]
    with contextlib.closing(make(words)) as world:
        actor = world.actors["robot"]
        lower, upper = actor.robot.lower + 1e-6, actor.robot.upper - 1e-6
        before, stood, hits = momentum(actor), False, 0
        for _ in range(1000):
            world.step()
            now, joints = momentum(actor), actor.body.read().joints
            stands = bool(((joints <= lower) | (joints >= upper)).any())
            if stands or stood:
                hits += stands and not stood
                change = now - before
                assert np.linalg.norm(change[:3]) < 1e-9 * np.linalg.norm(before[:3])
                assert np.linalg.norm(change[3:]) < 1e-9 * np.linalg.norm(before[3:])
            before, stood = now, stands
    assert hits >= 3


@pytest.mark.thorough
@pytest.mark.parametrize("engine", ["pybullet", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_limbs_at_their_stops_propel_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str
) -> None:
    """A float with a buoyant limb at its stop loses its way in still water, added mass or not.

    A load made from an acceleration that does not know the reaction of the stop pushes for ever.
    """
    pytest.importorskip(engine)
    parts = [
        LINK.format(name="float", centre="0 0 0", mass=50, i=(10, 10, 10), shape=box("0.6 2 0.25")),
        LINK.format(name="stalk", centre="0 0 0", mass=1, i=(0.1,) * 3, shape=""),
        LINK.format(name="sub", centre="0 0 0", mass=50, i=(10, 10, 10), shape=box("0.3 1.8 0.2")),
        HINGE.format(parent="float", child="stalk", at="0 0 -0.15", axis="0 1 0", stop=0.8),
        HINGE.format(parent="stalk", child="sub", at="0 0 -1.1", axis="0 1 0", stop=0.8),
    ]
    urdf = folder(tmp_path / "limbs.urdf", parts)
    monkeypatch.chdir(tmp_path)
    words = ["new", "robot", "limbs", "--urdf", str(urdf)]
    assert main(words) == 0
    start = [f"robot={tmp_path / 'limbs'}", "water=fossen", "initial.position=[0,0,-0.05]"]
    start += ["initial.joint_position=[-0.7,-0.7]", f"backend={engine}"]
    with contextlib.closing(make(start)) as world:
        body, places = world.actors["robot"].body, []
        for k in range(6000):
            world.step()
            if k % 1000 == 999:
                places.append(body.read().position[:2].copy())
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1) / 4.0
    assert ways[-1] < 0.02
    assert ways[-1] < 0.7 * ways[0]
