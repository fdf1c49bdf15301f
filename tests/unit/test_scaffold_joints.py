"""Joints of an imported robot: none vanishes, axes and limits keep their meaning."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
import yaml

from seals.api import make
from seals.errors import RobotError
from seals.multibody.tree import forward
from seals.run.assembly import ROBOT
from seals.scaffold.robot import NewRobot, scaffold_robot
from seals.world.world import World

MJCF = (
    '<mujoco model="rig"><worldbody><body name="carriage">{}<geom type="box" size=".2 .2 .1" '
    'density="500"/>{}</body></worldbody>{}</mujoco>'
)
HEAVE = '<joint name="heave" type="slide" axis="0 0 1" range="-1 1" limited="true" damping="3"/>'
PITCH = '<joint name="pitch" type="hinge" axis="0 1 0" pos="0.1 0 0"/>'
ARM = (
    '<body name="arm" pos="0.3 0 0"><joint name="elbow" axis="0 0 1" range="-1 1"/>'
    '<geom type="sphere" size="0.05" density="800"/></body>'
)
INERTIAL = (
    '<inertial><mass value="{}"/><inertia ixx=".2" iyy=".2" izz=".2" ixy="0" ixz="0" iyz="0"/>'
    "</inertial>"
)
BOX = '<collision><geometry><box size="0.4 0.4 0.2"/></geometry></collision>'
URDF = (
    '<robot name="r"><link name="{base}"/><link name="float">'
    + INERTIAL.format(16)
    + BOX
    + "</link>"
    '<joint name="heave" type="{kind}"><parent link="{base}"/><child link="float"/>'
    '<axis xyz="0 0 2"/><limit lower="{low}" upper="1" effort="{effort}" velocity="1"/></joint>'
    "{more}</robot>"
)
SDF = (
    "<sdf version='1.9'><model name='m'><link name='float'><inertial><mass>16</mass><inertia>"
    "<ixx>.2</ixx><iyy>.2</iyy><izz>.2</izz></inertia></inertial><collision name='c'><geometry>"
    "<box><size>0.4 0.4 0.2</size></box></geometry></collision></link><joint name='heave' "
    "type='{}'><parent>world</parent><child>float</child><axis><xyz>0 0 1</xyz><limit>"
    "<lower>{}</lower><upper>{}</upper><effort>{}</effort></limit></axis></joint></model></sdf>"
)


def urdf(
    base: str = "world", kind: str = "prismatic", low: str = "-1", effort: str = "9", more: str = ""
) -> str:
    """Return a float on one joint below a base without mass."""
    return URDF.format(base=base, kind=kind, low=low, effort=effort, more=more)


def taken(parent: Path, text: str, ending: str = "urdf") -> NewRobot:
    """Import a text."""
    (parent / f"it.{ending}").write_text(text, encoding="utf-8")
    return scaffold_robot("my", parent / f"it.{ending}", parent=parent)


def servos_of(made: NewRobot) -> dict[str, list[float]]:
    """Return the servos of a new robot."""
    text = (made.folder / "robot.yaml").read_text(encoding="utf-8")
    return yaml.safe_load(text)["actuators"]["servos"]


def joints_of(world: World) -> np.ndarray:
    """Return the joint values of the robot in a world [rad or m]."""
    return np.asarray(world.actors[ROBOT].body.read().joints)


def test_mjcf_joints_of_the_base_stay(tmp_path: Path) -> None:
    """As many degrees of freedom as MuJoCo's own model, axes and places at a bent pose too."""
    import mujoco

    text = MJCF.format(HEAVE + PITCH, ARM, "")
    made = taken(tmp_path, text, "xml")
    theirs = mujoco.MjModel.from_xml_string(text)
    assert made.robot.tree.joints == theirs.nv == 3
    assert made.robot.tree.fixed_base
    data = mujoco.MjData(theirs)
    data.qpos[:] = [0.2, 0.4, -0.3]
    mujoco.mj_kinematics(theirs, data)
    values = np.array([[data.qpos[theirs.joint(n).qposadr[0]] for n in made.robot.joints]])
    origins, turns = forward(made.robot.tree, np.zeros((1, 3)), np.eye(3)[None], values)
    for name in ("carriage", "arm"):
        k = made.robot.links.index(name)
        place = origins[0, k] + turns[0, k] @ made.robot.centre[k]
        assert place == pytest.approx(data.xipos[theirs.body(name).id], abs=1e-9)


def test_a_ball_between_world_and_base_is_refused(tmp_path: Path) -> None:
    """It was dropped, and the robot bolted to the world."""
    with pytest.raises(RobotError, match="a ball joint"):
        taken(tmp_path, MJCF.format('<joint type="ball"/>', "", ""), "xml")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("text", "ending"),
    [
        (MJCF.format(HEAVE, "", ""), "xml"),
        (urdf(), "urdf"),
        (SDF.format("prismatic", -1, 1, 9), "sdf"),
    ],
)
def test_a_rig_bobs(tmp_path: Path, text: str, ending: str) -> None:
    """A float on a slide against the world comes to half its height under water."""
    made = taken(tmp_path, text, ending)
    assert made.robot.joints == ("heave",)
    assert made.robot.tree.fixed_base
    assert any("they have no servos" in line for line in made.changes)
    assert servos_of(made)["kp_each"] == [0.0]
    words = [f"robot={made.folder}", "water=fossen", "environment.water_density=1000"]
    with contextlib.closing(make([*words, "backend=mujoco"])) as world:
        for _ in range(5000):
            world.step()
        depth = float(joints_of(world)[0])
    assert depth == pytest.approx(0.1 - 16.0 / (0.16 * 1000.0), abs=2e-3)


def test_driven_rig_keeps_its_servo(tmp_path: Path) -> None:
    """A transmission says that a motor moves the carriage."""
    more = "<transmission name='t'><joint name='heave'/></transmission>"
    made = taken(tmp_path, urdf(more=more))
    assert servos_of(made)["kp_each"][0] > 0.0


def test_another_frame_without_mass_is_no_world(tmp_path: Path) -> None:
    """Only a base named world stands for it."""
    with pytest.raises(RobotError, match="has no mass"):
        taken(tmp_path, urdf(base="frame"))


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
def test_axes_have_a_length_of_one(tmp_path: Path, kind: str) -> None:
    """In the file that engines read, too: one of them takes the length for a ratio."""
    import pybullet

    made = taken(tmp_path, urdf(kind=kind))
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(
            str(made.folder / "my.urdf"), useFixedBase=True, physicsClientId=client
        )
        axis = pybullet.getJointInfo(body, 0, physicsClientId=client)[13]
    finally:
        pybullet.disconnect(client)
    assert np.linalg.norm(axis) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("huge", ["1.79769e+308", "inf", "1e16", "1e308"])
def test_endless_limits(tmp_path: Path, huge: str) -> None:
    """Joints without limits, as each program writes them."""
    (tmp_path / "s").mkdir()
    made = taken(tmp_path / "s", SDF.format("revolute", f"-{huge}", huge, -1), "sdf")
    assert np.isinf(made.robot.upper[0])
    (tmp_path / "u").mkdir()
    more = urdf(kind="revolute", low=f"-{huge}").replace('upper="1"', f'upper="{huge}"')
    assert np.isinf(taken(tmp_path / "u", more).robot.upper[0])


@pytest.mark.parametrize(("effort", "limit"), [("-1", 1e6), ("9", 9.0), ("1e300", 1e6)])
def test_no_effort_limit_is_no_limit(tmp_path: Path, effort: str, limit: float) -> None:
    """Minus one is the word of SDF for none."""
    more = "<transmission name='t'><joint name='heave'/></transmission>"
    made = taken(tmp_path, urdf(effort=effort, more=more))
    assert servos_of(made)["torque_limit_each"] == [limit]


def test_bolted_block_runs_in_both_engines(tmp_path: Path) -> None:
    """A fixed base without joints has no coordinate, and no traceback."""
    made = taken(tmp_path, urdf().replace("prismatic", "fixed"))
    for backend in ("mujoco", "pybullet"):
        words = [f"robot={made.folder}", "water=fossen", f"backend={backend}"]
        with contextlib.closing(make(words)) as world:
            world.step()
            assert np.all(np.isfinite(joints_of(world)))


def test_drives_of_a_rig_are_refused(tmp_path: Path) -> None:
    """Their forces would act on the world."""
    more = (
        "<link name='thruster_1'/><joint name='t' type='fixed'><parent link='float'/>"
        "<child link='thruster_1'/></joint>"
    )
    with pytest.raises(RobotError, match="connected to the world"):
        taken(tmp_path, urdf(more=more))


def test_the_armature_of_mjcf_joints_is_that_of_their_servos(tmp_path: Path) -> None:
    """A light wrist behind a gear of 0.1 kg m^2 takes the file's gains, as it does in MuJoCo."""
    wrist = (
        '<body name="wrist" pos="0.3 0 0"><joint name="roll" axis="1 0 0" range="-3 3" '
        'armature="0.1"/><geom type="sphere" size="0.02" density="800"/></body>'
    )
    servo = '<actuator><position joint="roll" kp="500" kv="20"/></actuator>'
    made = taken(tmp_path, MJCF.format("<freejoint/>", wrist, servo), "xml")
    given = servos_of(made)
    assert given["armature_each"] == [0.1]
    assert (given["kp_each"], given["kd_each"]) == ([500.0], [20.0])
    words = [f"robot={made.folder}", "time.step=0.004"]
    with contextlib.closing(make(words)) as world:
        world.step()
    assert "joint@armature" not in (made.folder / "README.md").read_text(encoding="utf-8")
