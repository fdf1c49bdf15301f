"""Snapshots: a world continues bit for bit, effects' and sensors' memory included."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from seals.arrays import Array, Floats
from seals.effects import Effect, MediumKind, bind_effects
from seals.effects.effect import Parameters
from seals.environment.settings import EnvironmentSettings
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.gravity import Gravity
from seals.plugins.sensors.imu import SensorImu
from seals.plugins.waves.still import WaveStill
from seals.schema import param
from seals.testing.bodies import moving_arm
from seals.testing.scenes import start_of
from seals.world import Actor, World


@dataclass(kw_only=True)
class DragLagging(Effect):
    """A drag that follows the velocity after a while: its memory is the velocity it believes in."""

    slope: float = param(2.0, "N s/m", bounds=(0.0, 100.0), tolerance=0.1, source="test")
    lag: float = param(0.1, "s", bounds=(0.01, 1.0), tolerance=0.1, source="test")
    medium: MediumKind = MediumKind.any
    memory_size: ClassVar[int] = 3

    @staticmethod
    def loads(
        motion: Motion, medium: Medium, inputs: Inputs, memory: Array, params: Parameters
    ) -> tuple[Wrench, Array]:
        """Return the late force, and the velocity believed in at the next step."""
        following = memory + (motion.velocity - memory) * (inputs.step / params["lag"])
        return Wrench(-params["slope"] * memory, None), following


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """An arm over the water with a lagging drag and a noisy, filtered sensor."""
    robot, environment = moving_arm(tmp_path), EnvironmentSettings(water_level=0.0)
    effects = bind_effects(
        {"gravity": Gravity(), "buoyancy": Buoyancy(), "late": DragLagging(links=["*"])},
        robot.links,
    )
    engine = BackendPybullet()
    engine.open(environment, 0.004)
    sensors = {"imu": SensorImu(link="fore", bandwidth=20.0)}
    actor = Actor(robot, effects, sensors, engine, environment, waves=WaveStill(), steps=10)
    out = World(engine, {"arm": actor}, environment, step=0.004, seed=3)
    out.reset({"arm": start_of(robot, "surface", 0)})
    yield out
    out.close()


def advance(world: World, steps: int) -> Floats:
    """State, memory and readings of every step as one table."""
    actor, rows = world.actors["arm"], []
    for _ in range(steps):
        world.step()
        reading: Any = actor.readings["imu"] or {}
        rows.append(
            np.concatenate(
                [*actor.body.read(), actor.memory["late"].ravel(), *reading.values(), [world.time]]
            )
        )
    return np.array(rows)


def test_a_snapshot_continues_bit_for_bit(world: World) -> None:
    """State, memory of effects, random numbers and readings repeat exactly after a restore."""
    advance(world, 60)
    kept = world.snapshot()
    first = advance(world, 80)
    world.restore(kept)
    np.testing.assert_array_equal(advance(world, 80), first)
    world.restore(kept)
    np.testing.assert_array_equal(advance(world, 80), first)


def test_the_memory_matters_here(world: World) -> None:
    """Without the memory of the effect the continuation would differ: the test above can fail."""
    advance(world, 60)
    kept = world.snapshot()
    first = advance(world, 20)
    world.restore(kept)
    world.actors["arm"].memory = {"late": np.zeros((3, 3))}
    assert np.abs(advance(world, 20) - first).max() > 1e-3


def test_a_restore_forgets_later_rows_of_the_ledger(world: World) -> None:
    """The ledger has one row a step again, equal to that of the first continuation."""
    ledger = world.actors["arm"].ledger
    advance(world, 5)
    kept = world.snapshot()
    advance(world, 25)
    assert ledger.rows == 30
    first = ledger.wrenches.copy()
    world.restore(kept)
    assert ledger.rows == 5
    np.testing.assert_array_equal(ledger.wrenches, first[:5])
    advance(world, 25)
    np.testing.assert_array_equal(ledger.wrenches, first)
    np.testing.assert_allclose(ledger.time, 0.004 * np.arange(30), atol=1e-15)


def test_reset_starts_anew(world: World) -> None:
    """After a reset the same record comes out again, from zero memory and time."""
    start = start_of(world.actors["arm"].robot, "surface", 0)
    world.reset({"arm": start})
    assert math.isclose(world.time, 0.0)
    first = advance(world, 30)
    world.reset({"arm": start})
    assert not world.actors["arm"].memory["late"].any()
    np.testing.assert_array_equal(advance(world, 30), first)
