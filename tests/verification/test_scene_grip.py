"""A hand that is bolted to the world grips a cube, and holds it by friction alone."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest

from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.world import World

STEP = 0.004
HAND = np.array([0.07, 0.0, -0.427])
"""Middle between the finger-tips with the arm straight down, body axes [m]."""


def settings(*overrides: str, wet: bool = False) -> RunSettings:
    """The manipulator bolted above a cube that lies on the ground."""
    height = -HAND[2] + 0.025
    return run_settings(
        [
            "robot=aam",
            "robot.fixed_base=true",
            f"initial.position=[{-HAND[0]},0,{height}]",
            "initial.joint_position=[0,0,0,-0.5,-0.5,-0.5]",
            "environment.ground_level=0",
            "+objects.cube={robot: cube, position: [0,0,0.0255], rpy: [0,0,0]}",
            *(["water=fossen", "environment.water_level=1.5"] if wet else []),
            *overrides,
        ]
    )


def lifted(world: World) -> tuple[np.ndarray, np.ndarray]:
    """Close the hand, swing the arm up, and return cube and forces on the tips at the end."""
    actor, cube = world.actors["robot"], world.actors["cube"]
    for k in range(round(2.6 / STEP)):
        time = k * STEP
        grip = min(time / 0.5, 1.0)
        swing = 1.2 * 0.5 * (1.0 - math.cos(math.pi * min(max(time - 0.9, 0.0) / 1.2, 1.0)))
        finger = -0.5 + grip * 0.7
        actor.joint_command = np.array([[swing, 0.0, 0.0, finger, finger, finger]])
        world.step()
    tips = [actor.robot.links.index(f"tip_{n}") for n in (1, 2, 3)]
    return cube.body.read().position, actor.body.contact_normals()[tips]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("yaw", "wet"),
    [
        (0.8, True),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in [(0.35, False), (0.0, True)]),
    ],
)
def test_a_cube_is_lifted_whichever_way_it_lies(yaw: float, wet: bool) -> None:
    """Friction alone carries the cube through a swing of 1.2 rad, in air and under water."""
    with contextlib.closing(
        build_world(settings(f"objects.cube.rpy=[0,0,{yaw}]", wet=wet))
    ) as world:
        place, forces = lifted(world)
    # the shoulder is 0.08 m below the body's origin and 0.07 m ahead of it
    reach = -HAND[2] - 0.08
    expected = [-reach * math.sin(1.2), 0.0, -HAND[2] + 0.025 - 0.08 - reach * math.cos(1.2)]
    np.testing.assert_allclose(place, expected, atol=0.02)
    assert (forces > 0.3).sum() >= 2


def test_a_cube_without_friction_stays_on_the_ground() -> None:
    """Nothing but friction holds: a slippery cube is not lifted."""
    with contextlib.closing(build_world(settings("+objects.cube.friction=0"))) as world:
        place, _ = lifted(world)
    assert place[2] < 0.05


def test_a_grip_does_not_depend_on_the_speed_of_hand_and_cube() -> None:
    """Forces on the tips are the same at rest and at 1 m/s: the laws know no absolute velocity."""
    still = [f"effects.air_drag.coefficient_{axis}=0" for axis in "xyz"]
    free = "air_drag: {coefficient_x: 0, coefficient_y: 0, coefficient_z: 0}"
    found = []
    for speed in (0.0, 1.0):
        place = f"position: [{HAND[0]},0,{HAND[2]}], velocity: [0,0,{speed}]"
        run = run_settings(
            [
                "robot=aam",
                "environment.gravity=0",
                f"initial.velocity=[0,0,{speed}]",
                "initial.joint_position=[0,0,0,-0.3,-0.3,-0.3]",
                f"+objects.cube={{robot: cube, {place}, effects: {{{free}}}}}",
                *still,
            ]
        )
        with contextlib.closing(build_world(run)) as world:
            actor = world.actors["robot"]
            for k in range(300):
                finger = -0.3 + min(k * STEP / 0.5, 1.0) * 0.56
                actor.joint_command = np.array([[0.0, 0.0, 0.0, finger, finger, finger]])
                world.step()
            tips = [actor.robot.links.index(f"tip_{n}") for n in (1, 2, 3)]
            found.append(actor.body.contact_normals()[tips])
    assert found[0].min() > 1.0
    np.testing.assert_allclose(found[1], found[0], rtol=0.02)
