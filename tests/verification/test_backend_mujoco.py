"""MuJoCo as engine: added mass with contacts, impacts, friction, stops, drives, repetition."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import PhysicsError
from seals.plugins.actuators.servos import Servos
from seals.plugins.backends.mujoco import BackendMujoco
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.added_mass import AddedMass
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.testing.backend import momentum_of
from seals.world import World
from tests.verification.conftest import Bench

pytest.importorskip("mujoco", reason="backend=mujoco needs the package mujoco")

STEP = 0.004
GRAVITY = 9.81


def cube(*overrides: str) -> RunSettings:
    """A cube of 0.1 kg with edges of 0.05 m on the ground or above it."""
    given = ["robot=cube", "backend=mujoco", "environment.ground_level=0"]
    return run_settings([*given, *overrides])


def stepped(world: World, seconds: float) -> list[Any]:
    """Step a world; return the robot's state after every step."""
    body, rows = world.actors["robot"].body, []
    for _ in range(round(seconds / STEP)):
        world.step()
        rows.append(body.read())
    return rows


def heavy(bench: Bench, **initial: Any) -> RunSettings:
    """A sphere under water that carries six times its mass of water, above a ground."""
    ball = '<sphere radius="0.1"/>'
    robot = bench.body(2.0, [0.008] * 3, hull="sphere", size=[0.1], collision=ball)
    water = AddedMass(mass_x=12.0, mass_y=12.0, mass_z=12.0)
    medium = {"water_level": 5.0, "ground_level": 0.0}
    found = bench.settings(robot, {"added_mass": water}, environment=medium, **initial)
    found.backend = BackendMujoco()
    return found


def test_a_body_with_six_times_its_mass_of_water_falls_and_rests(bench: Bench) -> None:
    """It falls with m g / (m + A), and presses on the ground with its weight alone."""
    with contextlib.closing(build_world(heavy(bench, position=[0, 0, 1.0]))) as world:
        rows = stepped(world, 0.4)
        falling = 2.0 * GRAVITY / 14.0
        assert rows[-1].velocity[2] == pytest.approx(-falling * 0.4, rel=1e-9)
        assert rows[-1].position[2] == pytest.approx(1.0 - 0.5 * falling * 0.16, rel=1e-9)
        stepped(world, 2.0)
        pressing = []
        for _ in range(50):
            world.step()
            pressing.append(world.actors["robot"].body.contact_normals()[0])
    np.testing.assert_allclose(pressing, 2.0 * GRAVITY, rtol=1e-6)


def test_an_impact_takes_the_momentum_of_body_and_water(bench: Bench) -> None:
    """The ground's impulse is that of the mass with its added mass."""
    settings = heavy(bench, position=[0, 0, 0.1003], velocity=[0, 0, -0.1])
    settings.effects.pop("gravity")
    with contextlib.closing(build_world(settings)) as world:
        body, impulse = world.actors["robot"].body, 0.0
        for _ in range(5):
            world.step()
            impulse += STEP * float(body.contact_normals()[0])
        speed = body.read().velocity[2]
    # it leaves with the share of the speed that takes a penetration back
    assert 0.0 <= speed < 0.011
    assert impulse == pytest.approx(14.0 * (0.1 + speed), rel=1e-6)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_a_ball_bounces_by_the_product_of_the_coefficients(
    bench: Bench, restitution: float
) -> None:
    """A falling ball comes back with e of its speed, a tenth more or less for the step."""
    robot = bench.body(1.0, [0.004] * 3, collision='<sphere radius="0.1"/>')
    urdf = Path(robot.folder) / robot.urdf
    stated = '<contact><restitution value="1"/></contact><inertial>'
    urdf.write_text(urdf.read_text().replace("<inertial>", stated))
    ground = {"ground_level": 0.0, "restitution": restitution}
    settings = bench.settings(robot, environment=ground, position=[0, 0, 0.5])
    settings.backend = BackendMujoco()
    with contextlib.closing(build_world(settings)) as world:
        speed = np.array([row.velocity[2] for row in stepped(world, 0.4)])
    assert -speed.min() == pytest.approx(math.sqrt(2.0 * GRAVITY * 0.4), rel=0.03)
    assert speed.max() / -speed.min() == pytest.approx(restitution, abs=0.1)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_friction_is_a_cone(angle: float) -> None:
    """A sliding cube loses mu g of speed whichever way it slides, does not rise, and then stays."""
    mu, speed = 0.4, 1.0
    way = np.array([math.cos(angle), math.sin(angle), 0.0])
    flying = f"initial.velocity=[{speed * way[0]},{speed * way[1]},0]"
    with contextlib.closing(
        build_world(cube(f"environment.friction={mu}", "initial.position=[0,0,0.025]", flying))
    ) as world:
        rows = stepped(world, 0.6)
    lost = speed - rows[round(0.2 / STEP) - 1].velocity @ way
    assert lost == pytest.approx(mu * GRAVITY * 0.2, rel=0.01)
    # the engine's own law would let it hop by millimetres
    assert max(row.position[2] for row in rows) < 0.0251
    assert np.linalg.norm(rows[-1].velocity) < 1e-3


def arm(bench: Bench, engine: Any, stop: float, effects: Any = None, **initial: Any) -> RunSettings:
    """Two links with a hinge between stops, free in space."""
    joint = (
        '<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/>'
        f'<origin xyz="0.1 0 0"/><axis xyz="0 1 0"/><limit lower="{-stop}" upper="{stop}" '
        'effort="10" velocity="100"/></joint>'
    )
    robot = bench.robot(
        bench.link("base", 1.0, [0.01, 0.01, 0.01], centre=(0.02, 0, 0)),
        bench.link("arm", 0.5, [0.001, 0.004, 0.004], centre=(0.1, 0, 0)),
        joint,
    )
    found = bench.settings(robot, effects, **initial)
    found.backend = engine()
    return found


def centre_of(world: World) -> tuple[float, float]:
    """Height of the centre of mass [m] and momentum along z [kg m/s] of the robot."""
    actor = world.actors["robot"]
    robot, poses = actor.robot, actor.body.poses()
    centres = poses.origins[0] + np.einsum("lij,lj->li", poses.rotations[0], robot.centre)
    height = float(robot.mass @ centres[:, 2] / robot.mass.sum())
    return height, float(momentum_of(robot, poses)[0][2])


@pytest.mark.parametrize("engine", [BackendPybullet, BackendMujoco])
def test_a_robot_at_its_stops_falls_like_any_other(bench: Bench, engine: Any) -> None:
    """The centre of mass falls by g t^2 / 2: a stop adds nothing, neither speed nor way."""
    with contextlib.closing(build_world(arm(bench, engine, 0.0))) as world:
        (height, momentum), time = centre_of(world), 1.0
        stepped(world, time)
        end, gained = centre_of(world)
    assert gained - momentum == pytest.approx(-1.5 * GRAVITY * time, rel=1e-9)
    # steps of first order would be h g t / 2 = 0.02 m too low
    assert end - height == pytest.approx(-0.5 * GRAVITY * time**2, abs=1e-6)


def test_a_swinging_joint_stops_at_its_limit(bench: Bench) -> None:
    """The arm passes its stop by no more than the way of one step, and stays inside after it."""
    with contextlib.closing(
        build_world(arm(bench, BackendMujoco, 0.5, joint_velocity=[3.0]))
    ) as world:
        height, momentum = centre_of(world)
        joints = np.array([row.joints[0] for row in stepped(world, 0.6)])
        end, gained = centre_of(world)
    assert 0.5 <= joints.max() < 0.5 + 3.0 * STEP
    assert np.abs(joints[-20:]).max() < 0.51
    assert gained - momentum == pytest.approx(-1.5 * GRAVITY * 0.6, rel=1e-3)
    assert end - height == pytest.approx(momentum / 1.5 * 0.6 - 0.5 * GRAVITY * 0.36, abs=1e-3)


def test_a_drive_keeps_its_limit(bench: Bench) -> None:
    """A servo far from its place pulls with its limit: the arm's acceleration is that of it."""
    servo = Servos(kp_each=[50.0], kd_each=[0.0], torque_limit_each=[0.02])
    settings = arm(bench, BackendMujoco, 3.0, {"servos": servo})
    settings.effects.pop("gravity")
    with contextlib.closing(build_world(settings)) as world:
        actor = world.actors["robot"]
        actor.joint_command = np.array([[2.0]])
        rows = stepped(world, 0.2)
        force = actor.body.joint_forces()
    assert force == pytest.approx([0.02], rel=1e-12)
    # about y: base and arm turn against each other, free in space
    lever, across = np.array([0.08, 0.1]), 1.0 * 0.5 / 1.5
    table = np.array(
        [
            [0.01 + across * lever[0] ** 2, across * lever[0] * lever[1]],
            [across * lever[0] * lever[1], 0.004 + across * lever[1] ** 2],
        ]
    )
    turned = np.linalg.solve(table, np.array([-0.02, 0.02]))
    expected = (turned[1] - turned[0]) * 0.2
    assert rows[-1].joint_velocity[0] == pytest.approx(expected, rel=0.02)


def scene(*overrides: str) -> RunSettings:
    """A manipulator under water whose hand closes on a cube on the ground."""
    return run_settings(
        [
            "robot=aam",
            "backend=mujoco",
            "water=fossen",
            "robot.fixed_base=true",
            "initial.position=[-0.07,0,0.452]",
            "initial.joint_position=[0,0,0,-0.5,-0.5,-0.5]",
            "environment.ground_level=0",
            "environment.water_level=1.5",
            "+objects.cube={robot: cube, position: [0,0,0.0255]}",
            *overrides,
        ]
    )


def gripping(world: World, steps: int) -> np.ndarray:
    """Close the hand; return joints of the hand and place of the cube over time."""
    rows = []
    for _ in range(steps):
        world.actors["robot"].joint_command = np.array([[0.3, 0.0, 0.0, 0.2, 0.2, 0.2]])
        world.step()
        hand, cube_ = (world.actors[name].body.read() for name in ("robot", "cube"))
        rows.append(np.concatenate((hand.joints, cube_.position, cube_.velocity)))
    return np.array(rows)


@pytest.mark.thorough
def test_a_grip_repeats_and_continues_bit_for_bit() -> None:
    """Two runs are equal to the last bit, and so is what follows a snapshot."""
    runs = []
    for _ in range(2):
        with contextlib.closing(build_world(scene())) as world:
            runs.append(gripping(world, 80))
            kept = world.snapshot()
            after = gripping(world, 40)
            touched = world.actors["robot"].body.contact_normals()
            world.restore(kept)
            assert np.array_equal(gripping(world, 40), after)
            assert np.array_equal(world.actors["robot"].body.contact_normals(), touched)
            runs.append(after)
    assert touched.any()
    assert np.array_equal(runs[0], runs[2])
    assert np.array_equal(runs[1], runs[3])


def test_a_state_of_another_scene_is_refused() -> None:
    """A stored state of a scene with fewer bodies is no state of this one."""
    worlds = [build_world(cube()), build_world(cube("+objects.top={robot: cube}"))]
    states = [world.backend.snapshot() for world in worlds]
    with pytest.raises(ValueError, match="is required"):
        worlds[1].backend.restore((states[0][0], states[1][1]))
    for world in worlds:
        world.close()


def test_the_surface_of_a_link_comes_from_its_urdf_or_from_the_run() -> None:
    """Friction of the URDF, or the run's in its place, times that of the ground."""
    for more, expected in (([], 0.5), (["+objects.top.friction=0.3"], 0.15)):
        run = cube("environment.friction=0.5", "+objects.top={robot: cube}", *more)
        with contextlib.closing(build_world(run)):
            model = run.backend._scene.model
            pairs = {
                (model.geom(int(a)).name, model.geom(int(b)).name): friction
                for a, b, friction in zip(
                    model.pair_geom1, model.pair_geom2, model.pair_friction, strict=True
                )
            }
        found = next(v for k, v in pairs.items() if k[0].startswith("/") and k[1].startswith("1/"))
        # rolling 0.0005 and spinning 0.002 of the cube by the ground's friction
        np.testing.assert_allclose(found, [expected, expected, 0.001, 0.00025, 0.00025])


def test_a_robot_that_comes_late_is_refused() -> None:
    """A scene that has been used takes no further robot."""
    with (
        contextlib.closing(build_world(cube())) as world,
        pytest.raises(PhysicsError, match="is added too late"),
    ):
        world.backend.add(world.actors["robot"].robot)
