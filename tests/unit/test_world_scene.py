"""Several robots in one scene."""

from __future__ import annotations

import numpy as np

from seals.backend import Configuration
from seals.run.assembly import build_model
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.world import Actor, World


def settings() -> RunSettings:
    """A ball without gravity, air or water."""
    quiet = [f"effects.air_drag.coefficient_{axis}=0" for axis in "xyz"]
    return run_settings(["robot=ball", "environment.gravity=0", *quiet])


def scene(names: list[str]) -> World:
    """Balls in one scene."""
    run = settings()
    run.backend.open(run.environment, 0.001)
    actors = {}
    for name in names:
        robot, effects = build_model(run)
        actors[name] = Actor(
            robot, effects, {}, run.backend, run.environment, waves=run.wave, steps=600
        )
    return World(run.backend, actors, run.environment, step=0.001, seed=0)


def at(x: float, speed: float) -> Configuration:
    """A ball on the x axis that moves along it."""
    still = np.zeros(3)
    return Configuration(
        np.array([x, 0.0, 0.0]),
        np.array([0.0, 0.0, 0.0, 1.0]),
        np.array([speed, 0.0, 0.0]),
        still,
        np.zeros(0),
        np.zeros(0),
    )


def test_two_robots_collide_and_keep_their_momentum() -> None:
    """A ball hits a resting one: they touch, none passes through, the momentum stays."""
    world = scene(["left", "right"])
    world.reset({"left": at(-0.3, 1.0), "right": at(0.0, 0.0)})
    for _ in range(600):
        world.step()
    left, right = (world.actors[name].body.read() for name in ("left", "right"))
    world.close()
    # radius 0.05 m each; equal masses: the velocities add up to what came in
    assert right.position[0] - left.position[0] > 0.095
    assert right.velocity[0] > 0.4
    np.testing.assert_allclose(left.velocity[0] + right.velocity[0], 1.0, atol=1e-6)


def test_robots_in_one_scene_keep_their_own_ledgers_and_snapshots() -> None:
    """A snapshot of a scene of two brings both back, and the continuation is the same."""
    world = scene(["left", "right"])
    world.reset({"left": at(-0.2, 1.0), "right": at(0.2, -0.5)})
    for _ in range(100):
        world.step()
    kept = world.snapshot()

    def onward() -> np.ndarray:
        for _ in range(100):
            world.step()
        return np.array([world.actors[n].body.read().velocity for n in ("left", "right")])

    first = onward()
    world.restore(kept)
    assert [world.actors[n].ledger.rows for n in ("left", "right")] == [100, 100]
    np.testing.assert_array_equal(onward(), first)
    world.close()
