"""The backend without contacts follows the engine where nothing touches, and refuses the ground."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from seals.errors import PhysicsError
from seals.plugins.backends.free import BackendFree
from seals.run import build_world, initial_configuration
from seals.run.build import run_settings
from seals.world import World
from tests.verification.conftest import Bench


def world_of(*words: str) -> World:
    """Return a world that stands at its start."""
    settings = run_settings(words)
    world = build_world(settings)
    robot = world.actors["robot"].robot
    world.reset({"robot": initial_configuration(settings, robot)})
    return world


def way(backend: str) -> tuple[np.ndarray, np.ndarray]:
    """Places and joints of a manipulator that swims while its servos turn the arm."""
    words = ["robot=aam", "water=fossen", "initial.position=[0,0,-2]", "time.step=0.004"]
    with contextlib.closing(world_of(f"backend={backend}", *words)) as world:
        actor, rows = world.actors["robot"], []
        actor.joint_command = np.array([[0.4, -0.3, 0.2, 0.0, 0.0, 0.0]])
        for _ in range(250):
            world.step()
            found = actor.body.read()
            rows.append(np.concatenate([found.position, found.joints]))
    table = np.array(rows)
    return table[:, :3], table[:, 3:]


@pytest.mark.thorough
def test_a_swimming_arm_moves_as_in_the_engine() -> None:
    """Same equations in two integrators of second order: a hundredth of the way, half a degree."""
    place, joints = way("free")
    engine_place, engine_joints = way("pybullet")
    travelled = np.abs(np.diff(engine_place, axis=0)).sum()
    assert travelled > 0.01
    assert np.abs(place - engine_place).max() < 0.01 * max(travelled, 0.1)
    assert np.ptp(engine_joints[:, 0]) > 0.1
    assert np.abs(joints - engine_joints).max() < 0.01


def fall(world: World, steps: int) -> None:
    """Take some steps."""
    for _ in range(steps):
        world.step()


@pytest.mark.parametrize("passable", [False, True])
def test_the_ground_is_refused_in_words_or_passed(passable: bool) -> None:
    """A ball falls from ten centimetres; without contacts it must not lie on the ground."""
    words = ["robot=ball", "backend=free", "environment.ground_level=0.0"]
    words += ["initial.position=[0,0,0.1]", f"backend.passable={str(passable).lower()}"]
    with contextlib.closing(world_of(*words)) as world:
        steps = round(0.3 / world.step_size)
        if passable:
            fall(world, steps)
            height = world.actors["robot"].body.read().position[2]
            assert height == pytest.approx(0.1 - 0.5 * 9.81 * 0.3**2, abs=0.02)
        else:
            with pytest.raises(PhysicsError, match="pybullet"):
                fall(world, steps)


def test_a_joint_beyond_its_limit_ends_the_run(bench: Bench) -> None:
    """Without stops a joint that leaves its range is refused in words, or let pass."""
    hinge = (
        '<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/>'
        '<axis xyz="0 1 0"/><limit lower="-0.5" upper="0.5" effort="1" velocity="9"/></joint>'
    )
    parts = (bench.link("base", 1.0, [0.01] * 3), bench.link("arm", 0.5, [0.004] * 3), hinge)
    settings = bench.settings(bench.robot(*parts), weight=False, joint_velocity=[2.0])
    for passable in (True, False):
        settings.backend = BackendFree(passable=passable)
        if passable:
            assert bench.run("world", settings).joints[-1, 0] > 1.0
        else:
            with pytest.raises(PhysicsError, match=r"'hinge'.*range of -0\.5 to 0\.5"):
                bench.run("world", settings)
