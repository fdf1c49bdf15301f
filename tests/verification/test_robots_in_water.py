"""Robots in water, at rest and at terminal speed: closed forms of weight, buoyancy and drag."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seals.run import build_world, initial_configuration
from seals.run.build import run_settings
from seals.world import World

GRAVITY, WATER = 9.81, 998.2


def submerged(name: str, joints: list[float], *more: str) -> World:
    """Return a world with a robot at rest, five metres deep, its servos holding."""
    values = f"initial.joint_position={joints}".replace(" ", "")
    words = [f"robot={name}", "water=fossen", "initial.position=[0.0,0.0,-5.0]", values, *more]
    settings = run_settings(words)
    world = build_world(settings)
    actor = world.actors["robot"]
    world.reset({"robot": initial_configuration(settings, actor.robot)})
    if joints:
        actor.joint_command = np.array([joints])
    return world


def net_force(world: World) -> float:
    """Return buoyancy less weight [N]."""
    robot = world.actors["robot"].robot
    volume = sum(hull.volume for hull in robot.hulls if hull is not None)
    return GRAVITY * (WATER * volume - float(robot.mass.sum()))


def test_auv_rises_with_its_buoyancy_against_its_drag() -> None:
    """Its speed settles where d v + c v^2 equals the net buoyancy."""
    world = submerged("auv", [], "initial.velocity=[0.0,0.0,0.09]")
    force = net_force(world)
    for _ in range(1500):
        world.step()
    velocity = world.actors["robot"].body.read().velocity
    world.close()
    linear, square = 5.2, 37.0
    expected = (math.sqrt(linear**2 + 4.0 * square * force) - linear) / (2.0 * square)
    assert force == pytest.approx(0.91, abs=0.02)
    assert velocity[2] == pytest.approx(expected, rel=0.01)


def test_auv_does_not_fly() -> None:
    """Upright thrusters at 120 N together, more than its weight, take it up to the surface only."""
    world = submerged("auv", [], "initial.position=[0,0,-1]")
    actor, highest = world.actors["robot"], -1.0
    for _ in range(1500):
        actor.command = np.array([[40.0, 0.0, 40.0, 0.0, 40.0, 0.0]])
        world.step()
        highest = max(highest, float(actor.body.read().position[2]))
    weight = GRAVITY * float(actor.robot.mass.sum())
    world.close()
    assert weight < 100.0
    # it jumps once, as fast as 120 N drive it against its drag, and stays
    assert 0.0 < highest < 0.35


def test_aam_sinks_with_its_weight_against_its_drag() -> None:
    """With the arm stowed its speed settles where c v^2 equals the net weight, upright."""
    stowed = [1.5708, 0.0, 0.0, 0.0, 0.0, 0.0]
    world = submerged("aam", stowed, "initial.velocity=[0.0,0.0,-0.3]")
    force = -net_force(world)
    actor = world.actors["robot"]
    for _ in range(700):
        world.step()
    rest = actor.body.read()
    world.close()
    # the body's z, and across the arm at elbow and wrist: level links meet the water with their x
    expected = math.sqrt(force / (31.0 + 2.0 * 3.0))
    assert force == pytest.approx(2.07, abs=0.02)
    assert -rest.velocity[2] == pytest.approx(expected, rel=0.03)


def cross(v: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def test_auv_rights_itself() -> None:
    """Rolled and let go, it turns back as fast as weight, buoyancy, inertia and added mass say."""
    roll, step = 0.3, 0.001
    world = submerged("auv", [], f"initial.rpy=[{roll},0.0,0.0]", f"time.step={step}")
    actor = world.actors["robot"]
    robot = actor.robot
    world.step()
    spin = actor.body.read().angular_velocity
    world.close()
    mass, centre, hull = float(robot.mass[0]), robot.centre[0], robot.hulls[0]
    assert hull is not None
    # Newton-Euler about the body origin, body axes, plus the stated added mass
    s = cross(centre)
    matrix = np.block([[mass * np.eye(3), -mass * s], [mass * s, robot.inertia[0] - mass * s @ s]])
    matrix += np.diag([5.5, 12.7, 14.6, 0.12, 0.12, 0.12])
    up = np.array([0.0, math.sin(roll), math.cos(roll)])
    weight, lift = -GRAVITY * mass * up, GRAVITY * WATER * hull.volume * up
    torque = np.cross(centre, weight) + np.cross(np.asarray(hull.centroid), lift)
    expected = np.linalg.solve(matrix, np.concatenate([weight + lift, torque]))
    assert expected[3] < -1.0
    # the first step starts from rest: its drags are of second order in the step
    assert spin[0] == pytest.approx(expected[3] * step, rel=0.01)
