"""Objects of a run: further bodies in the scene, with effects and records of their own."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.source import find_robot
from seals.errors import ConfigError
from seals.logs.native import read_native
from seals.logs.table import read_parquet
from seals.run.assembly import build_world
from seals.run.build import run_settings
from seals.run.folder import write_log
from seals.run.settings import RunSettings
from seals.run.simulation import simulate


def settings(*overrides: str) -> RunSettings:
    """A ball far from a cube, in calm water with a bottom."""
    base = ["robot=ball", "water=fossen", "environment.tank_bottom=-1", "initial.position=[5,0,1]"]
    return run_settings([*base, "+objects.cube.robot=cube", *overrides])


def test_a_cube_sinks_and_rests_on_the_bottom() -> None:
    """An object feels gravity, buoyancy and its own drag, and stops at the bottom."""
    run = settings("+objects.cube.position=[0,0,-0.5]", "time.duration=3")
    log = simulate(run).log
    z, speed = log.columns["object_cube_position_z"], log.columns["object_cube_velocity_z"]
    # terminal speed: (m - rho V) g = c v^2, with 998.2 kg/m^3 at 20 degC
    terminal = np.sqrt((0.1 - 998.2 * 8e-5) * 9.81 / 1.31)
    assert -speed.min() == pytest.approx(terminal, rel=0.02)
    assert z[-1] == pytest.approx(-0.975, abs=1e-3)
    assert abs(speed[-1]) < 1e-3


def test_a_run_keeps_the_objects_in_log_meta_and_ledger(tmp_path: Path) -> None:
    """The folder of a run holds where an object was, what it is, and what acted on it."""
    run = settings("+objects.cube.position=[0,0,0.5]", "time.duration=0.1")
    record = simulate(run)
    write_log(tmp_path, record, run)
    log = read_parquet(tmp_path / "log.parquet")
    ledger = read_parquet(tmp_path / "ledger.parquet")
    assert log["object_cube_position_z"][0] == 0.5
    assert record.log.meta["objects"]["cube"]["mass"] == pytest.approx(0.1)
    np.testing.assert_allclose(ledger["cube/gravity.base.force_z"], -0.981, rtol=1e-6)
    assert ledger["cube/gravity.base.force_z"].size == ledger["t"].size


def test_the_log_says_what_stands_in_the_scene(tmp_path: Path) -> None:
    """Shore and obstacles are part of the metadata, and the log is written and read with them."""
    ground = ["environment.ground_level=0.5", "environment.shore.slope=0.2"]
    block = "+environment.obstacles.block={size: [1, 1, 1], position: [9, 9, 0]}"
    run = settings(*ground, block, "time.duration=0.02")
    write_log(tmp_path, simulate(run), run)
    around = read_native(tmp_path).meta["environment"]
    assert around["shore"]["slope"] == 0.2
    assert around["obstacles"]["block"]["type"] == "box"


def test_mass_and_effects_of_an_object_can_be_set() -> None:
    """Mass scales the inertia with it, in the engine too; a value of an effect rules."""
    run = settings(
        "+objects.cube.mass=0.4",
        "+objects.cube.position=[0,0,2]",
        "+objects.cube.effects.air_drag.coefficient_z=0",
        "+objects.cube.angular_velocity=[0,0,3]",
        "environment.gravity=0",
        "+objects.other={robot: cube, position: [0,0,2.06], velocity: [0,0,-1]}",
    )
    with contextlib.closing(build_world(run)) as world:
        robot = world.actors["cube"].robot
        np.testing.assert_allclose(robot.inertia[0], 4 * 4.167e-5 * np.eye(3), rtol=1e-6)
        for _ in range(20):
            world.step()
        heavy, light = (world.actors[n].body.read().velocity[2] for n in ("cube", "other"))
    # drag of the light one takes less than a thousandth of its momentum in 80 ms
    assert heavy < -0.1
    assert 0.4 * heavy + 0.1 * light == pytest.approx(-0.1, rel=2e-3)


def test_wind_blows_on_objects_and_a_payload_stays_with_its_robot() -> None:
    """Effects of the surroundings act on objects, those of the robot do not."""
    run = settings(
        "+effect@effects.wind=wind", "+effect@effects.load=payload", "effects.wind.velocity_x=5"
    )
    with contextlib.closing(build_world(run)) as world:
        names = world.actors["cube"].effects.names
    assert {"gravity", "buoyancy", "wind", "air_drag"} <= set(names)
    assert "load" not in names
    assert "slamming" not in names


def test_snapshot_brings_objects_back() -> None:
    """A world with an object continues from a snapshot exactly as it did."""
    with contextlib.closing(build_world(settings("+objects.cube.position=[0,0,0.01]"))) as world:
        for _ in range(20):
            world.step()
        kept = world.snapshot()

        def onward() -> np.ndarray:
            for _ in range(30):
                world.step()
            return np.concatenate(world.actors["cube"].body.read())

        first = onward()
        world.restore(kept)
        np.testing.assert_array_equal(onward(), first)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("+objects.cube.rbot=ball", "Did you mean 'robot'"),
        ("+objects.cube.mass=-1", "objects.cube.mass=-1"),
        ("+objects.cube.effects.drga.coefficient_x=1", "has no effect 'drga'"),
        ("+objects.cube.joint_position=[1]", "has 1 values"),
        ("objects.cube.robot=cubus", "Did you mean 'cube'"),
        ("+objects.pose.position=[0,0,0]", "objects.pose.robot has no value"),
        ("+objects.a-b.robot=cube", "cannot name one of the objects"),
    ],
)
def test_a_wrong_object_is_refused_in_words(override: str, words: str) -> None:
    """Unknown keys, values out of bounds and missing robots name the object."""
    with pytest.raises(Exception, match=words) as refusal:
        build_world(settings(override))
    assert "objects" in str(refusal.value) or isinstance(refusal.value, ConfigError | LookupError)


def test_a_run_with_an_object_is_repeated_and_a_changed_object_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run folder brings its objects back bit for bit, and refuses when their files changed."""
    monkeypatch.chdir(tmp_path)
    thing = tmp_path / "thing"
    shutil.copytree(find_robot("cube").settings.folder, thing)
    line = ["run", "robot=ball", "+objects.cube.robot=thing", "time.duration=0.05"]
    assert main([*line, "hydra.run.dir=first"]) == 0
    assert main(["run", "repeat=first", "hydra.run.dir=second"]) == 0
    first, second = (read_parquet(tmp_path / f / "log.parquet") for f in ("first", "second"))
    assert all(np.array_equal(first[k], second[k], equal_nan=True) for k in first)
    (thing / "robot.yaml").write_text(
        (thing / "robot.yaml").read_text(encoding="utf-8").replace("1.31", "2.0"), encoding="utf-8"
    )
    assert main(["run", "repeat=first", "hydra.run.dir=third"]) == 2
