"""A fluid in the world: bodies, hand-over, ledger, owners, snapshots."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seals.backend import Configuration
from seals.effects.binding import bind_effects
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.fluid import Fluid, Surrounding
from seals.frames import quaternion_of_rpy
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.added_mass import AddedMass
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.gravity import Gravity
from seals.plugins.waves.still import WaveStill
from seals.robot.model import RobotModel
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.immersed import owners
from seals.testing.backend import momentum_of
from seals.testing.bodies import free_body, moving_arm
from seals.world import Actor, World
from tests.unit.still_water import StillWater

Floats = NDArray[np.float64]
STEP = 0.004
WATER = EnvironmentSettings(water_level=0.0, water_density=1000.0)


def start(robot: RobotModel, height: float, speed: float = 0.0) -> Configuration:
    """Return a robot at a height, tilted and, with a speed, moving and turning all over."""
    joints = robot.tree.joints
    return Configuration(
        np.array([0.1, -0.2, height]),
        quaternion_of_rpy(np.array([[0.4, -0.3, 0.7]]))[0],
        speed * np.array([0.5, -0.2, 0.3]),
        speed * np.array([1.0, 2.0, -1.5]),
        np.linspace(0.3, 0.6, joints),
        speed * np.linspace(2.0, -1.0, joints),
    )


def world_of(
    robot: RobotModel, effects: dict[str, Any], fluid: StillWater | None, begin: Configuration
) -> World:
    """Return a world with one robot in a fluid."""
    backend = BackendPybullet()
    backend.open(WATER, STEP)
    bound = bind_effects(effects, robot.links, owners(fluid))
    actor = Actor(robot, bound, {}, backend, WATER, waves=WaveStill(), steps=100, fluid=fluid)
    if fluid is not None:
        assert actor.immersion is not None
        fluid.open(
            Surrounding(WATER, WaveStill(), (), STEP), [g.body for g in actor.immersion.groups]
        )
    world = World(backend, {"it": actor}, WATER, step=STEP, seed=0, fluid=fluid)
    world.reset({"it": begin})
    return world


def test_it_is_a_fluid() -> None:
    """The fluid of these tests keeps the protocol."""
    assert isinstance(StillWater(), Fluid)


@pytest.mark.parametrize("make", [free_body, moving_arm])
def test_a_lift_by_the_fluid_is_that_of_the_effect(make: Any, tmp_path: Path) -> None:
    """Submerged, a fluid's lift moves body and arm as the buoyancy effect does, to rounding."""
    robot, ends = make(tmp_path), []
    for effects, fluid in (({}, StillWater()), ({"lift": Buoyancy(links=["*"])}, None)):
        with contextlib.closing(
            world_of(robot, {"weight": Gravity(), **effects}, fluid, start(robot, -5.0, 1.0))
        ) as world:
            for _ in range(100):
                world.step()
            ends.append(world.actors["it"].body.read())
    # the samples of a cylinder lie within a hair of its centroid
    for a, b in zip(*ends, strict=True):
        assert a == pytest.approx(b, abs=2e-6)


@pytest.mark.parametrize("make", [free_body, moving_arm])
def test_every_impulse_arrives(make: Any, tmp_path: Path) -> None:
    """The robot's momentum changes by the fluid's impulses, steps of half a kick accounted for."""
    robot, fluid = make(tmp_path), StillWater(push=300.0)
    with contextlib.closing(world_of(robot, {}, fluid, start(robot, -5.0))) as world:
        actor, given, momenta = world.actors["it"], [], []
        for _ in range(20):
            world.step()
            row = actor.ledger.of("still_water")[-1]
            turn = actor._due[0].kinematics.rotations[0]  # type: ignore[index]
            given.append(np.einsum("lij,lj->i", turn, row[:, :3]) * STEP)
            momenta.append(momentum_of(robot, actor.body.poses())[0])
        # the first kick stands whole; later ones come at half steps, the last seen by half again
        expected = np.sum(given[1:], axis=0) + 0.5 * (given[-1] - given[0])
        scale = float(np.abs(expected).max())
        # at half steps links have turned a little: exact for one body alone
        allowed = 1e-9 if len(robot.links) == 1 else 2e-3
        assert momenta[-1] - momenta[0] == pytest.approx(expected, abs=allowed * scale)
        assert actor.ledger.effects == ("still_water",)


def test_a_free_body_moves_as_its_own_mass(tmp_path: Path) -> None:
    """One body's response to a push is its inverse mass and inertia; free fall is foreseen."""
    robot, fluid = free_body(tmp_path), StillWater()
    with contextlib.closing(
        world_of(robot, {"weight": Gravity()}, fluid, start(robot, 50.0, 1.0))
    ) as world:
        world.step()
        (seen,) = fluid.seen
        assert seen.inverse_mass == pytest.approx([1.0 / robot.mass[0]])
        turn = seen.rotation[0]
        inertia = turn @ robot.inertia[0] @ turn.T
        assert seen.inverse_inertia[0] == pytest.approx(np.linalg.inv(inertia), rel=1e-9)
        assert seen.acceleration[0] == pytest.approx([0.0, 0.0, -9.81], abs=1e-9)


def test_links_are_foreseen(tmp_path: Path) -> None:
    """The foreseen acceleration of every link is the one that the engine then makes."""
    robot = moving_arm(tmp_path)
    step = 1e-4
    backend, fluid = BackendPybullet(), StillWater(spacing=0.02)
    backend.open(WATER, step)
    bound = bind_effects({"weight": Gravity()}, robot.links)
    actor = Actor(robot, bound, {}, backend, WATER, waves=WaveStill(), steps=9, fluid=fluid)
    assert actor.immersion is not None
    bodies = [g.body for g in actor.immersion.groups]
    fluid.open(Surrounding(WATER, WaveStill(), (), step), bodies)
    world = World(backend, {"it": actor}, WATER, step=step, seed=0, fluid=fluid)
    world.reset({"it": start(robot, 50.0, 1.0)})
    for _ in range(4):
        world.step()
    one, two, three = fluid.seen[1:4]
    assert len(bodies) == 3
    measured = (three.velocity - one.velocity) / (2.0 * step)
    assert two.acceleration == pytest.approx(measured, rel=2e-3, abs=2e-2)
    world.close()


def test_a_body_on_the_ground_does_not_fall(tmp_path: Path) -> None:
    """Contact holds a body that rests on the bottom: the fluid is told that it stays."""
    environment = EnvironmentSettings(water_level=0.0, tank_bottom=-1.0)
    run = run_settings(["robot=cube", "water=none", "time.step=0.004"])
    run.environment, run.fluid = environment, StillWater()
    run.effects = {"weight": Gravity()}
    run.initial.position = [0.0, 0.0, -0.85]
    with contextlib.closing(build_world(run)) as world:
        for _ in range(200):
            world.step()
        seen = run.fluid.seen[-1]
        lift = 1000.0 * 9.81 * run.fluid.samples[0].volumes.sum() * seen.inverse_mass[0]
        # what is left of weight and contact carries the fluid's lift
        assert seen.acceleration[0, 2] == pytest.approx(-lift, rel=0.05)


def test_fixed_links_are_one_body() -> None:
    """Links that no joint moves apart are one body for the fluid; the arm's are their own."""
    run = run_settings(["robot=aam", "water=none"])
    run.environment.water_level, run.fluid = 0.0, StillWater()
    run.effects = {"weight": Gravity()}
    run.initial.position = [0.0, 0.0, 3.0]
    world = build_world(run)
    immersion = world.actors["robot"].immersion
    assert immersion is not None
    names = [g.body.name for g in immersion.groups]
    fingers = [f"aam/finger_{k}" for k in (1, 2, 3)]
    assert names == ["aam/body", "aam/upper", "aam/fore", "aam/palm", *fingers]
    whole = world.actors["robot"].robot.mass.sum()
    assert sum(g.mass for g in immersion.groups) == pytest.approx(whole)
    volume = sum(s.volumes.sum() for s in run.fluid.samples)
    hulls = sum(h.volume for h in world.actors["robot"].robot.hulls if h is not None)
    assert volume == pytest.approx(hulls, rel=1e-9)
    world.step()
    (seen,) = run.fluid.seen
    assert seen.inverse_mass == pytest.approx([1.0 / g.mass for g in immersion.groups])
    # a finger does not spin about its length
    turns = 1.0 / np.linalg.eigvalsh(seen.inverse_inertia[4])
    assert turns[2] >= 0.249 * turns[0]
    assert seen.acceleration[0, 2] == pytest.approx(-9.81, rel=1e-3)
    world.close()


def test_two_owners_are_refused(tmp_path: Path) -> None:
    """An effect that owns what the fluid owns is refused by both names; a correction passes."""
    robot = free_body(tmp_path)
    with pytest.raises(ConfigError, match="'still_water' and 'extra' both account for added mass"):
        bind_effects({"extra": AddedMass(mass_x=1.0)}, robot.links, owners(StillWater()))
    bind_effects(
        {"extra": AddedMass(mass_x=1.0, correction=True)}, robot.links, owners(StillWater())
    )


def test_snapshots_hold_the_fluid(tmp_path: Path) -> None:
    """A world goes on from a snapshot bit for bit, its fluid included."""
    robot, fluid = moving_arm(tmp_path), StillWater(push=200.0)
    with contextlib.closing(
        world_of(robot, {"weight": Gravity()}, fluid, start(robot, -3.0, 1.0))
    ) as world:
        ends = []
        for _ in range(5):
            world.step()
        kept = world.snapshot()
        for _ in range(2):
            for _ in range(10):
                world.step()
            ends.append(world.actors["it"].body.read())
            world.restore(kept)
        assert fluid.calls == 5
        for a, b in zip(*ends, strict=True):
            assert a.tolist() == b.tolist()
    assert fluid.closed


def test_the_surface_is_that_of_the_fluid(tmp_path: Path) -> None:
    """Effects and sensors see the fluid's own surface."""
    robot = free_body(tmp_path)
    with contextlib.closing(world_of(robot, {}, StillWater(), start(robot, 0.0))) as world:
        actor = world.actors["it"]
        actor.begin(0.0, STEP)
        actor.load()
        sample = actor._due[0].found.sample  # type: ignore[index]
        assert float(sample.depth[0, 0]) == pytest.approx(0.01)
