"""Walking: forces, momentum and energy add up, and the time step does not matter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.experiments.crab_gaits.walks import walked
from seals.plugins.controllers.walking.anatomy import anatomy_of
from seals.run.assembly import ROBOT
from seals.world import World

LAND, SEABED = "experiment=crab_walk", "experiment=crab_seabed"


def world_of(*overrides: str) -> tuple[World, Any]:
    """Return a world and its robot."""
    world = make(list(overrides))
    return world, world.actors[ROBOT]


@pytest.mark.thorough
@pytest.mark.parametrize("recipe", [LAND, "experiment=sea_spider_seabed"])
def test_foot_forces_at_rest_carry_weight_less_buoyancy(recipe: str) -> None:
    """The normal forces of a standing animal add up to m g - rho g V within 1 %, on all feet."""
    world, actor = world_of(recipe, "guide.speed=0")
    for _ in range(600):
        world.step()
    robot, wet = actor.robot, "seabed" in recipe
    volume = sum(hull.volume for hull in robot.hulls if hull is not None) if wet else 0.0
    # 998.2 kg/m^3: fresh water of 20 degrees
    weight = 9.81 * (float(robot.mass.sum()) - 998.2 * volume)
    forces = actor.body.contact_normals()
    world.close()
    feet = [leg.foot for leg in robot.legs.values()]
    assert forces.sum() == pytest.approx(weight, rel=0.01)
    assert forces[feet].sum() == pytest.approx(weight, rel=0.01)
    assert (forces[feet] > 0.02 * weight).all()


def centre_of(actor: Any) -> np.ndarray:
    """Return the centre of mass of all links in the world [m]."""
    poses, robot = actor.body.poses(), actor.robot
    origins, turns = poses.origins[0], poses.rotations[0]
    places = origins + np.einsum("lij,lj->li", turns, robot.centre)
    return robot.mass @ places / robot.mass.sum()


def drift_of(step: float) -> float:
    """Return how far the centre of mass of a crab comes that kicks in free space for 1.2 s [m]."""
    world, actor = world_of(
        LAND,
        "environment.gravity=0",
        "environment.ground_level=null",
        "initial.position=[0,0,1]",
        "effects.air_drag.coefficient_x=0",
        "effects.air_drag.coefficient_y=0",
        "effects.air_drag.coefficient_z=0",
        "guide.delay=0",
        f"time.step={step}",
    )
    start, farthest = centre_of(actor), 0.0
    for _ in range(round(1.2 / step)):
        world.step()
        farthest = max(farthest, float(np.linalg.norm(centre_of(actor) - start)))
    world.close()
    return farthest


@pytest.mark.thorough
def test_legs_that_kick_in_free_space_move_no_centre_of_mass() -> None:
    """Without gravity and ground, all that moves the whole is the error of the step, and it goes.

    Three legs of 4 g with strokes of 36 mm would move it by 3 mm, were they not answered.
    """
    coarse, fine = drift_of(0.004), drift_of(0.001)
    assert coarse < 4e-4
    # of first order or better: a quarter at a quarter of the step
    assert fine < 0.25 * coarse


def test_work_of_the_legs_lifts_the_body() -> None:
    """Rising slowly by 8 mm, the joints do the work m g h within 2 %, and sinking gives it back."""
    world, actor = world_of(LAND, "guide.speed=0")
    actor.pilot = None
    legs = anatomy_of(actor.robot)
    columns = legs.joints.astype(int)
    work = {1.0: 0.0, -1.0: 0.0}
    heights: list[float] = []
    for k in range(2000):
        # still, up within 1 s, still, down within 1 s
        share = float(np.clip(0.004 * (k - 250), 0.0, 4.0))
        lift = 0.008 * (share if share <= 1.0 else max(0.0, min(1.0, 3.0 - share)))
        toes = legs.toe.copy()
        toes[:, 2] += 0.004 - lift
        command = np.zeros((1, actor.robot.tree.joints))
        command[0, columns] = legs.angles(toes)
        actor.joint_command = command
        before = actor.body.read().joint_velocity
        world.step()
        # a force held over a step does its work at the mean rate
        rates = 0.5 * (before + actor.body.read().joint_velocity)
        sense = 1.0 if k < 750 else -1.0
        power = float(actor.body.joint_forces() @ rates)
        work[sense] += power * world.step_size if k >= 200 else 0.0
        heights.append(float(centre_of(actor)[2]))
    world.close()
    weight = 9.81 * float(actor.robot.mass.sum())
    up, down = heights[749] - heights[199], heights[-1] - heights[749]
    assert up > 0.006
    assert work[1.0] == pytest.approx(weight * up, rel=0.02)
    assert work[-1.0] == pytest.approx(weight * down, rel=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("recipe", "least"), [pytest.param(LAND, 2.0, marks=pytest.mark.slow), (SEABED, 0.5)]
)
def test_walks_upright_and_as_fast_at_half_the_step(recipe: str, least: float) -> None:
    """A tripod keeps upright, its joints within their limits, its speed within 5 % at 2 ms."""
    whole = walked([recipe, "time.duration=5"], seed=1)
    half = walked([recipe, "time.duration=5"], seed=1, step=0.002)
    for walk in (whole, half):
        assert walk.lengths >= least
        assert walk.upright > 0.99
        assert walk.beyond < 0.0
        # feet really leave the ground
        assert 0.3 < walk.stands.mean() < 0.8
    assert half.speed == pytest.approx(whole.speed, rel=0.05)


@pytest.mark.slow
def test_a_sea_spider_walks() -> None:
    """Eight legs carry it at the speed that is asked, upright."""
    walk = walked(["experiment=sea_spider_seabed", "time.duration=8"])
    assert walk.speed == pytest.approx(0.03, rel=0.15)
    assert walk.upright > 0.99
    assert walk.beyond < 0.0


def test_a_walk_goes_on_from_a_snapshot() -> None:
    """Put back in the middle of a step, a crab walks on bit for bit; also one in another world."""
    world, actor = world_of(SEABED, "guide.delay=0")
    for _ in range(150):
        world.step()
    kept = world.snapshot()
    runs = []
    for _ in range(2):
        for _ in range(60):
            world.step()
        runs.append(np.concatenate([*actor.body.read()]))
        world.restore(kept)
    world.close()
    assert runs[0].tobytes() == runs[1].tobytes()


def test_light_legs_do_not_swing_the_body_up() -> None:
    """Dropped by some millimetres on legs of a gram, the body comes to rest and stays there."""
    world, actor = world_of(LAND, "guide.speed=0", "initial.position=[0,0,0.035]")
    speeds = []
    for k in range(500):
        world.step()
        if k > 250:
            speeds.append(float(np.abs(actor.body.read().joint_velocity).max()))
    world.close()
    # predicted with the contact forces of the last step, they reach 10 rad/s
    assert max(speeds) < 0.1
