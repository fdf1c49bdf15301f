"""A world step by step: its ledger of loads, its scene, its snapshots."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from seals.api import make
from seals.arrays import Array, Floats
from seals.backend import Configuration, Dynamics
from seals.effects import Effect, MediumKind, bind_effects
from seals.effects.effect import Parameters
from seals.environment.settings import EnvironmentSettings
from seals.motion import Inputs, Medium, Motion, Wrench
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.effects.buoyancy import Buoyancy
from seals.plugins.effects.gravity import Gravity
from seals.plugins.sensors.imu import SensorImu
from seals.plugins.waves.still import WaveStill
from seals.run.assembly import build_model
from seals.run.build import run_settings
from seals.run.settings import RunSettings
from seals.schema import param
from seals.testing.bodies import moving_arm
from seals.testing.scenes import start_of
from seals.world import Actor, Ledger, World


def test_the_sum_is_what_the_backend_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """At every step the wrench handed to the backend is the sum over the effects in the ledger."""
    options = ["robot=free_arm", "water=fossen", "initial.position=[0,0,0.1]"]
    with contextlib.closing(make([*options, "initial.velocity=[0.3,0.1,-0.5]"])) as world:
        actor, given = world.actors["robot"], []
        apply = actor.body.apply

        def watched(dynamics: Dynamics, step: float) -> None:
            given.append(np.array(dynamics.wrench[0]))
            apply(dynamics, step)

        monkeypatch.setattr(actor.body, "apply", watched)
        for _ in range(60):
            world.step()
    np.testing.assert_allclose(actor.ledger.wrenches.sum(axis=1), given, atol=1e-13)
    assert {"gravity", "buoyancy", "water_drag", "added_mass"} <= set(actor.ledger.effects)


def test_the_sum_is_what_the_body_feels() -> None:
    """The force in the ledger over a step, times the step, is the gain of momentum."""
    still = [f"effects.added_mass.mass_{a}=0" for a in "xyz"]
    options = ["robot=ball", "water=fossen", "initial.position=[0,0,0.03]", "time.step=0.001"]
    moving = ["initial.velocity=[0.5,0,-1]", "effects.slamming.coefficient=0"]
    with contextlib.closing(make([*options, *moving, *still])) as world:
        actor, speeds = world.actors["robot"], []
        for _ in range(101):
            speeds.append(actor.body.read().velocity)
            world.step()
        force = actor.ledger.wrenches.sum(axis=1)[:, 0, :3]
    # the ball does not turn: link axes are world axes; trapezoidal rule over 0.1 s
    impulse = 0.001 * (force[:-1] + force[1:]).sum(axis=0) / 2.0
    np.testing.assert_allclose(0.3 * (speeds[-1] - speeds[0]), impulse, rtol=1e-4, atol=1e-6)


def test_weight_and_lift_are_told_apart() -> None:
    """At rest under water the ledger holds -m g and rho g V by their names."""
    with contextlib.closing(
        make(["robot=ball", "water=fossen", "initial.position=[0,0,-5]"])
    ) as world:
        world.step()
        ledger = world.actors["robot"].ledger
        weight, lift = ledger.of("gravity")[0, 0], ledger.of("buoyancy")[0, 0]
    volume = 4.0 / 3.0 * np.pi * 0.05**3
    # density of fresh water at 20 degC: 998.206 kg/m^3 (Millero and Poisson 1981)
    np.testing.assert_allclose(weight, [0, 0, -0.3 * 9.81, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(
        lift, [0, 0, 998.206 * 9.81 * volume, 0, 0, 0], rtol=1e-6, atol=1e-12
    )


@pytest.mark.parametrize("rows", [None, slice(1, 2), np.array([1])])
def test_rows_grow_and_rewind(rows: Any) -> None:
    """A full ledger grows without losing rows; rewinding leaves no trace of what came later."""
    ledger = Ledger(["a", "b"], ["x", "y"], steps=2)
    for k in range(5):
        row = ledger.open_row(0.1 * k)
        count = 2 if rows is None else 1
        ledger.write(row, "b", rows, Wrench(np.full((count, 3), k + 1.0), None))
    assert ledger.wrenches.shape == (5, 2, 2, 6)
    np.testing.assert_array_equal(ledger.of("b")[:, 1, 0], [1, 2, 3, 4, 5])
    assert not ledger.of("a").any()
    ledger.rewind(2)
    assert ledger.rows == 2
    row = ledger.open_row(0.2)
    assert not row.any()
    np.testing.assert_allclose(ledger.time, [0.0, 0.1, 0.2])


def test_columns_name_effect_link_and_component() -> None:
    """Columns that are zero throughout are left out."""
    ledger = Ledger(["a", "b"], ["x", "y"], steps=1)
    row = ledger.open_row(0.5)
    ledger.write(row, "b", slice(1, 2), Wrench(np.array([[0.0, 2.0, 0.0]]), None))
    assert {key: values.tolist() for key, values in ledger.columns().items()} == {
        "t": [0.5],
        "b.y.force_y": [2.0],
    }


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
