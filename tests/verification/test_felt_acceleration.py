"""What an accelerometer reads is the acceleration of the step: of one force, impacts and arms."""

from __future__ import annotations

import contextlib
import dataclasses
from typing import Any

import numpy as np
import pytest

from seals.api import make
from seals.frames import matrix_of
from seals.plugins.actuators.thrusters import Thrusters
from seals.plugins.backends.free import BackendFree
from seals.plugins.backends.mujoco import BackendMujoco
from seals.plugins.backends.pybullet import BackendPybullet
from seals.plugins.sensors.imu import SensorImu
from seals.run import build_world
from seals.world import World

ENGINES = ("pybullet", "mujoco")
STEP = 0.004
QUIET = {
    f"{side}_{kind}": 0.0
    for side in ("accelerometer", "gyroscope")
    for kind in ("noise", "walk", "step")
} | {"accelerometer_range": 1e5, "rate": 1.0 / STEP}
WORDS = [f"sensors.imu.{key}={value}" for key, value in QUIET.items()]


def needs(engine: str, compiled: str = "false") -> None:
    """Skip where the engine or the compiler is missing."""
    pytest.importorskip(engine)
    if compiled == "true":
        pytest.importorskip("llvmlite")


def backends() -> list[Any]:
    """Every engine, with and without compiled laws."""
    found: list[Any] = [pytest.param(BackendFree, "false", id="free")]
    for engine, kind in (("pybullet", BackendPybullet), ("mujoco", BackendMujoco)):
        found += [pytest.param(kind, how, id=f"{engine}-{how}") for how in ("false", "true")]
    return found


def force_of(world: World) -> np.ndarray:
    """Specific force that was read last."""
    reading: Any = world.actors["robot"].readings["imu"]
    return reading["specific_force"]


@pytest.mark.parametrize(("kind", "compiled"), backends())
def test_a_force_of_one_step_is_read_once(bench: Any, kind: Any, compiled: str) -> None:
    """6 N on 2 kg reads 3 m/s^2 in its step and nothing after it, on a body that turns."""
    if kind is not BackendFree:
        needs(kind.__name__.removeprefix("Backend").lower(), compiled)
    backend = BackendFree(passable=True) if kind is BackendFree else kind(compiled=compiled)
    settings = bench.settings(
        bench.body(2.0, [0.01, 0.01, 0.01]),
        {"push": Thrusters(position=[[0.0, 0.0, 0.0]], time_constant=[0.0])},
        step=STEP,
        duration=0.1,
        sensors={"imu": SensorImu(**QUIET)},
        position=[0.0, 0.0, 5.0],
        angular_velocity=[3.0, 1.0, 0.0],
    )
    with contextlib.closing(build_world(dataclasses.replace(settings, backend=backend))) as world:
        actor, seen = world.actors["robot"], []
        for k in range(12):
            actor.command = np.array([[6.0 if k in (0, 5) else 0.0]])
            world.step()
            seen.append(force_of(world))
    expected = np.zeros((12, 3))
    expected[[0, 5], 2] = 3.0
    np.testing.assert_allclose(seen, expected, rtol=0.0, atol=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("compiled", ["false", "true"])
@pytest.mark.parametrize("engine", ENGINES)
def test_through_impacts_the_integral_is_the_change_of_velocity(engine: str, compiled: str) -> None:
    """Of a cube that tumbles over the ground: of the mean velocity of its origin over a step.

    The first step counts by half: its mean velocity stands half a step after the start.
    """
    needs(engine, compiled)
    words = ["robot=cube", "water=none", "environment.ground_level=0", "environment.tank_bottom=-1"]
    words += ["initial.position=[0,0,0.2]", "initial.velocity=[1,0.5,-1]"]
    words += ["initial.angular_velocity=[8,-5,3]", f"backend={engine}"]
    with_imu = ["+sensor@sensors.imu=imu", *WORDS]
    with contextlib.closing(make([*words, *with_imu, f"backend.compiled={compiled}"])) as world:
        body, step = world.actors["robot"].body, world.step_size
        before = body.read()
        total, touched, start = np.zeros(3), 0, before.velocity.copy()
        for k in range(400):
            place, turn = before.position.copy(), matrix_of(before.quaternion[None])[0]
            world.step()
            change = turn @ force_of(world) - [0.0, 0.0, world.environment.gravity]
            total += step * change * (0.5 if k == 0 else 1.0)
            before = body.read()
            touched += bool(body.contact_normals().any())
            moved = (before.position - place) / step - start
            np.testing.assert_allclose(total, moved, rtol=0.0, atol=1e-12)
    assert touched > 50


@pytest.mark.parametrize("compiled", ["false", "true"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_moving_link_feels_how_its_own_origin_moves(engine: str, compiled: str) -> None:
    """The second difference of its places, in its axes at the middle of the three."""
    needs(engine, compiled)
    words = ["robot=free_arm", "sensors.imu.link=fore", "initial.position=[0,0,20]", *WORDS]
    words += ["initial.joint_velocity=[6,-5]", "initial.angular_velocity=[0.3,0.5,0.2]"]
    words += [f"backend={engine}", f"backend.compiled={compiled}"]
    with contextlib.closing(make(words)) as world:
        actor, step = world.actors["robot"], world.step_size
        link = actor.robot.links.index("fore")
        poses, read = [actor.body.poses()], []
        for _ in range(40):
            world.step()
            poses.append(actor.body.poses())
            read.append(force_of(world))
    places = np.array([p.origins[0, link] for p in poses])
    turns = np.array([p.rotations[0, link] for p in poses])
    expected = np.diff(places, 2, axis=0) / step**2 + [0.0, 0.0, world.environment.gravity]
    found = np.einsum("kij,kj->ki", turns[1:-1], np.array(read)[1:])
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("compiled", ["false", "true"])
@pytest.mark.parametrize("engine", ENGINES)
def test_readings_after_a_snapshot_are_the_same_bit_for_bit(engine: str, compiled: str) -> None:
    """The first reading after it needs the mean velocity of the step before."""
    needs(engine, compiled)
    words = ["robot=ball", "water=fossen", "initial.position=[0,0,0.08]", *WORDS]
    words += ["initial.velocity=[0.4,0,-4]", f"backend={engine}", f"backend.compiled={compiled}"]
    with contextlib.closing(make(words)) as world:
        for _ in range(6):
            world.step()
        kept, runs = world.snapshot(), []
        for _ in range(2):
            world.restore(kept)
            rows = []
            for _ in range(10):
                world.step()
                rows.append(force_of(world))
            runs.append(rows)
    assert np.array_equal(*runs)


@pytest.mark.parametrize("engine", [*ENGINES, "free"])
def test_an_entry_is_felt_as_the_place_tells_it(engine: str) -> None:
    """A ball that strikes water reads the second difference of its own heights at every step."""
    if engine != "free":
        needs(engine)
    words = ["robot=ball", "water=fossen", "effects.slamming.coefficient=5", *WORDS]
    words += ["initial.position=[0,0,0.08]", "initial.velocity=[0,0,-4]", f"backend={engine}"]
    with contextlib.closing(make(words)) as world:
        body = world.actors["robot"].body
        heights, read = [body.read().position[2]], []
        for _ in range(14):
            world.step()
            heights.append(body.read().position[2])
            read.append(force_of(world)[2])
    expected = np.diff(heights, 2) / world.step_size**2 + world.environment.gravity
    assert expected.max() > 200.0
    np.testing.assert_allclose(read[1:], expected, rtol=0.0, atol=1e-8)


def through(words: list[str], steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sum of the specific force, change of the mean velocity of a step, and the readings."""
    with_imu = [] if any("robot=ball" in word for word in words) else ["+sensor@sensors.imu=imu"]
    with contextlib.closing(make([*words, *with_imu, *WORDS])) as world:
        body, step = world.actors["robot"].body, world.step_size
        before = body.read()
        total, start, rows, moved = np.zeros(3), before.velocity.copy(), [], np.zeros(3)
        worst = np.zeros(3)
        for k in range(steps):
            place, turn = before.position.copy(), matrix_of(before.quaternion[None])[0]
            world.step()
            rows.append(force_of(world))
            change = turn @ rows[-1] - [0.0, 0.0, world.environment.gravity]
            total = total + step * change * (0.5 if k == 0 else 1.0)
            before = body.read()
            moved = (before.position - place) / step - start
            worst = np.maximum(worst, np.abs(total - moved))
    return worst, moved, np.array(rows)


@pytest.mark.parametrize("entry", ["waterline", "submerged_share"])
@pytest.mark.parametrize("engine", [*ENGINES, "free"])
def test_through_an_entry_the_integral_is_the_change_of_velocity(engine: str, entry: str) -> None:
    """Of a ball that enters aslant and turns: to 1e-12, by either course of its added mass."""
    if engine != "free":
        needs(engine)
    words = ["robot=ball", "water=fossen", f"backend={engine}", "initial.position=[0,0,0.15]"]
    words += ["initial.velocity=[1,0.4,-4]", "initial.angular_velocity=[3,-2,5]"]
    worst, moved, rows = through([*words, f"effects.added_mass.entry={entry}"], 200)
    print(f"{engine}, {entry}: {worst.max():.1e} of {np.abs(moved).max():.2f} m/s")
    assert np.abs(rows).max() > 50.0
    assert np.linalg.norm(moved) > 1.0
    assert worst.max() < 1e-12


@pytest.mark.slow
def test_through_particle_water_the_integral_is_the_change_of_velocity() -> None:
    """Of a ball that strikes particles: to 1e-12."""
    words = ["robot=ball", "water=particles", "backend=free", "initial.position=[0,0,0.15]"]
    words += ["initial.velocity=[0.5,0,-2]", "initial.angular_velocity=[3,-2,5]"]
    words += ["fluid.spacing=0.04", "fluid.size=[0.8,0.8,0.5]", "environment.tank_bottom=-0.5"]
    worst, moved, rows = through([*words, "fluid.settle=0.05", "fluid.threads=1"], 60)
    print(f"{worst.max():.1e} of {np.abs(moved).max():.2f} m/s")
    assert np.abs(rows).max() > 20.0
    assert worst.max() < 1e-12
