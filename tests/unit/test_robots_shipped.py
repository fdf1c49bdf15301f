"""The robots that ship: files that belong together, hands that hold, legs that carry."""

from __future__ import annotations

import importlib
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.check.floating import FloatingBody
from seals.check.robot import Verdict, check_robot
from seals.robot.build import build_robot
from seals.robots.workshop.files import write
from seals.robots.workshop.links import Machine
from seals.run import build_world, initial_configuration
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from tests.unit.texts import same_text

ROOT = Path(__file__).parents[2]
MADE = ("aam", "hexacopter", "aam_dual_arm", "auv")
ANIMALS = ("crab", "sea_spider")
FLYING = MADE[:3]
STOWED = {"aam": [1.55, 0.0, 0.0], "hexacopter": [1.55, 0.0, 0.0, 0.0]}
GRASP = np.array([0.0, 0.0, -0.107])
"""Centre of the grasp in the palm [m], as the README states it."""


def machine(name: str) -> Machine:
    """Return what the script of a robot or an animal makes."""
    script = f"animals.{name}.make_{name}" if name in ANIMALS else f"robots.{name}.make_meshes"
    return importlib.import_module(f"seals.{script}").machine()


def run_of(name: str, *more: str) -> RunSettings:
    """Return the settings of a run with a robot."""
    return run_settings([f"robot={name}", *more])


@pytest.fixture
def engine() -> Iterator[Any]:
    """Return a bare engine, without SEALS."""
    pybullet = pytest.importorskip("pybullet")
    from pybullet_utils.bullet_client import BulletClient

    # a client of its own: calls without one would go to whichever was opened first
    client = BulletClient(pybullet.DIRECT)
    yield client
    client.disconnect()


@pytest.mark.parametrize("name", MADE + ANIMALS)
def test_files_are_those_of_the_script(name: str, tmp_path: Path) -> None:
    """URDF and meshes in the folder are what the robot's script writes, and they are small."""
    alone = name in ("aam", *ANIMALS)
    write(machine(name), tmp_path, shared=None if alone else ROOT / "robots" / "aam")
    folder = ROOT / ("animals" if name in ANIMALS else "robots") / name
    new = {p.relative_to(tmp_path) for p in tmp_path.rglob("*") if p.is_file()}
    old = {p.relative_to(folder) for p in folder.rglob("*") if p.suffix in (".urdf", ".obj")}
    assert new == old
    for file in new:
        same_text((tmp_path / file).read_text(), (folder / file).read_text(), str(file))
    assert sum((folder / file).stat().st_size for file in new) < (
        150_000 if name in ANIMALS else 400_000
    )


@pytest.mark.parametrize("name", MADE + ANIMALS)
def test_hulls_belong_to_the_pieces(name: str) -> None:
    """Every link displaces in robot.yaml what its pieces displace."""
    robot = build_robot(run_of(name).robot)
    hulls = dict(zip(robot.links, robot.hulls, strict=True))
    for link in machine(name).links:
        hull = hulls[link.name]
        assert (0.0 if hull is None else hull.volume) == pytest.approx(link.volume, rel=1e-3)


@pytest.mark.parametrize("name", MADE)
def test_check_finds_nothing(name: str) -> None:
    """The robot's own check has neither a fault nor a remark."""
    settings = run_of(name)
    findings = check_robot(settings.robot, settings.actuators)
    assert [str(f) for f in findings if f.verdict is not Verdict.OK] == []


@pytest.mark.parametrize(("name", "share"), [*((name, -0.08) for name in FLYING), ("auv", 0.01)])
def test_buoyancy_is_the_stated_one(name: str, share: float) -> None:
    """Buoyancy in fresh water differs from the weight by the stated share of its mass, upright."""
    body = FloatingBody(build_robot(run_of(name).robot))
    assert 998.2 * body.volume / body.mass - 1.0 == pytest.approx(share, abs=1e-3)
    _, centre = body.wetted(np.array([0.0, 0.0, 1.0]), 10.0)
    offset = centre - body.gravity_centre
    assert offset[2] > 0.009
    assert np.abs(offset[:2]).max() < 3e-4


@pytest.mark.parametrize("name", FLYING)
def test_arm_does_not_tip_the_robot(name: str) -> None:
    """Wherever the arm is, buoyancy acts within a millimetre of the line of the weight."""
    robot = build_robot(run_of(name).robot)
    hulls = [hull for hull in robot.hulls if hull is not None]
    ratio = [
        robot.mass[k] / hull.volume
        for k, hull in enumerate(robot.hulls)
        if hull is not None and hull.volume > 1e-5
    ]
    assert len(hulls) >= 10
    # links of one density move both centres alike
    assert max(ratio) / min(ratio) < 1.01


def test_aam_hovers_at_half_its_thrust() -> None:
    """Mass and thrust of the manipulator are those of its README."""
    settings = run_of("aam")
    mass = float(build_robot(settings.robot).mass.sum())
    rotors: Any = settings.actuators["rotors"]
    full = float(np.sum(rotors.constants()["thrust_coefficient"] * rotors.limit**2))
    assert 2.0 <= mass <= 3.0
    assert 0.45 <= 9.81 * mass / full <= 0.60


def moving(engine: Any, body: int) -> dict[str, int]:
    """Return the engine's numbers of the movable joints by name."""
    info = [engine.getJointInfo(body, k) for k in range(engine.getNumJoints(body))]
    return {i[1].decode(): i[0] for i in info if i[2] != engine.JOINT_FIXED}


def test_arm_touches_nothing_between_its_limits(engine: Any) -> None:
    """At the corners of the joint ranges and between them, no link of the arm meets another."""
    body = engine.loadURDF(str(ROOT / "robots/aam/aam.urdf"))
    joints = moving(engine, body)
    links = {engine.getJointInfo(body, k)[12].decode(): k for k in range(engine.getNumJoints(body))}
    outer = [k for name, k in links.items() if name.startswith(("palm", "finger", "tip"))]
    pairs = [(-1, links["fore"]), *((a, b) for a in (-1, links["upper"]) for b in outer)]
    pairs += [(links["fore"], k) for k in outer if k != links["palm"]]
    limits = [engine.getJointInfo(body, k)[8:10] for k in joints.values()]
    rng = np.random.default_rng(0)
    corners = itertools.product(*limits)
    between = (rng.uniform(*np.transpose(limits)) for _ in range(200))
    for values in itertools.chain(corners, between):
        for joint, value in zip(joints.values(), values, strict=True):
            engine.resetJointState(body, joint, value)
        for a, b in pairs:
            assert not engine.getClosestPoints(body, body, 0.0, a, b), (values, a, b)


@pytest.mark.parametrize("shape", ["cube", "ball"])
def test_fingers_hold_by_friction(engine: Any, shape: str) -> None:
    """Three fingers with 0.3 N m each hold 0.1 kg of 5 cm by their pads alone."""
    engine.setTimeStep(0.002)
    flags = engine.URDF_USE_INERTIA_FROM_FILE
    body = engine.loadURDF(str(ROOT / "robots/aam/aam.urdf"), useFixedBase=True, flags=flags)
    joints = moving(engine, body)
    for name in ("shoulder", "elbow", "wrist"):
        engine.setJointMotorControl2(body, joints[name], engine.POSITION_CONTROL, 0.0, force=50.0)
    fingers = [joints[f"finger_{k}"] for k in (1, 2, 3)]
    for finger in fingers:
        engine.resetJointState(body, finger, -0.6)
    palm = engine.getLinkState(body, joints["wrist"])[4]
    kind = {"cube": engine.GEOM_BOX, "ball": engine.GEOM_SPHERE}[shape]
    made = engine.createCollisionShape(kind, radius=0.025, halfExtents=[0.025] * 3)
    # neither centred nor aligned
    place = (np.array(palm) + GRASP + [0.004, -0.003, 0.003]).tolist()
    thing = engine.createMultiBody(
        0.1, made, basePosition=place, baseOrientation=[0, 0, 0.1, 0.995]
    )
    engine.changeDynamics(thing, -1, lateralFriction=0.6)
    for k in range(1500):
        if k == 750:
            engine.setGravity(0.0, 0.0, -9.81)
            before = np.array(engine.getBasePositionAndOrientation(thing)[0])
        for finger in fingers:
            engine.setJointMotorControl2(
                body, finger, engine.POSITION_CONTROL, 0.26, force=0.3, maxVelocity=3.0
            )
        engine.stepSimulation()
    touched = {point[4] for point in engine.getContactPoints(thing, body)}
    assert touched == {finger + 1 for finger in fingers}
    after = np.array(engine.getBasePositionAndOrientation(thing)[0])
    assert np.linalg.norm(after - before) < 1e-3


@pytest.mark.parametrize("name", ["aam", "hexacopter"])
def test_stands_on_its_legs(name: str) -> None:
    """Dropped by a hand's breadth with the arm stowed, it comes to rest upright on its feet."""
    stowed = [*STOWED[name], 0.0, 0.0, 0.0]
    settings = run_of(
        name,
        "environment.ground_level=0.0",
        "initial.position=[0.0,0.0,0.2]",
        f"initial.joint_position={stowed}".replace(" ", ""),
    )
    world = build_world(settings)
    actor = world.actors["robot"]
    world.reset({"robot": initial_configuration(settings, actor.robot)})
    actor.joint_command = np.array([stowed])
    for _ in range(300):
        world.step()
    rest = actor.body.read()
    world.close()
    assert rest.position[2] == pytest.approx(0.174, abs=2e-3)
    assert np.linalg.norm(rest.velocity) < 2e-3
    assert np.abs(rest.quaternion[:2]).max() < 0.01
