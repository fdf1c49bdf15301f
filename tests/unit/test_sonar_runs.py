"""Sonar and lidar in a run: files next to the log, repeated bit for bit, forces untouched."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from seals.api import make
from seals.cli.main import main
from seals.logs.table import read_parquet
from seals.plugins.sensors.sonar import SensorSonar
from seals.run.build import run_settings
from seals.run.simulation import simulate

DIVE = [
    *("run", "robot=auv", "water=fossen", "guide=hover", "environment.tank_bottom=-4"),
    *("initial.position=[0,0,-2]", "time.duration=0.25"),
]
SONAR = ["+sonar=forward", "sensors.sonar.beams=32", "sensors.sonar.bins=40"]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)


def image(path: str) -> np.ndarray:
    """An image as integers."""
    return np.asarray(Image.open(path)).astype(int)


def test_a_run_keeps_its_pings_and_repeats_them() -> None:
    """Levels and picture of every ping, the index, bearings and units; the same by repeat=."""
    assert main([*DIVE, *SONAR, "hydra.run.dir=one"]) == 0
    assert main(["run", "repeat=one", "hydra.run.dir=two"]) == 0
    folder = "one/pictures/sonar"
    levels = image(f"{folder}/000001_level.png")
    assert levels.shape == (40, 32)
    about = json.loads(Path(folder, "camera.json").read_text(encoding="utf-8"))
    assert about["bearings"][0] == pytest.approx(0.5 * 2.269)
    # the noise level where nothing is: in the first bins, above the bottom
    assert levels[:3].mean() * about["level_unit"] == pytest.approx(57.5, abs=2.0)
    assert levels.max() * about["level_unit"] > 80.0
    np.testing.assert_allclose(read_parquet(Path(folder, "index.parquet"))["t"], [0.1, 0.2])
    for name in ("000000.png", "000001_level.png"):
        assert Path(folder, name).read_bytes() == Path(f"two/pictures/sonar/{name}").read_bytes()


def test_a_picture_shows_the_floor_beside_a_wall() -> None:
    """A wall 45 dB over the floor saturates; the floor is grey, its shadow dark."""
    sonar = SensorSonar(beams=64, bins=128)
    way = sonar.nearest + (np.arange(sonar.bins) + 0.5) * sonar.size
    level = np.full((64, 128), 90.0) - 30.0 * np.log10(way)
    level[:, :32] -= 60.0
    level[20:22, 80] += 45.0
    seen = sonar.shown(level)
    assert seen.max() == 255
    # the picture is black outside of the fan
    floor = seen[seen > 0]
    assert 100 < np.median(floor) <= 255
    assert np.unique(floor).size == 1


def log_of(words: list[str]) -> Any:
    """The record of a run without files."""
    record = simulate(run_settings(words))
    assert record.error is None
    return record


def test_a_sonar_changes_no_force() -> None:
    """The ledger of a run is that without it, bit for bit."""
    one, two = (log_of([*DIVE[1:], *words]).ledger.columns() for words in ([], SONAR))
    assert one.keys() == two.keys()
    assert all(np.array_equal(one[key], two[key], equal_nan=True) for key in one)


def test_a_multibeam_logs_the_depth_under_each_beam() -> None:
    """2 m above the bottom, 7 cm below the base: 1.93 m under the middle beam; none in the air."""
    words = ["+sonar=multibeam", "sensors.multibeam.beams=33", "sensors.multibeam.bins=1024"]
    log = log_of([*DIVE[1:], *words]).log.columns
    middle = log["sonar_range_17"]
    assert middle[np.isfinite(middle)] == pytest.approx(1.93, abs=0.06)
    log = log_of([*DIVE[1:], *words, "initial.position=[0,0,3]"]).log.columns
    assert not np.isfinite(log.get("sonar_range_17", np.array([np.nan]))).any()


def test_a_side_scan_sees_the_bottom_to_both_sides() -> None:
    """Silence down to the bottom 2 m below, then echoes."""
    world = make([*DIVE[1:], "+sonar=side_scan"])
    for _ in range(30):
        world.step()
    way = 0.2 + (np.arange(512) + 0.5) * 29.8 / 512
    for view in world.actors["robot"].sensor_suite.cameras.values():
        shot: Any = view.shot
        levels = shot.images["_level.png"][:, 0] * 0.01
        assert levels[(way > 2.5) & (way < 6.0)].mean() > levels[way < 1.5].mean() + 15.0
    world.close()


def test_a_lidar_sees_other_bodies() -> None:
    """An object in the air 3 m ahead is the nearest thing in its sector."""
    words = ["robot=ball", "initial.position=[0,0,2]", "time.duration=0.15"]
    words += ["+sensor@sensors.lidar=lidar", "+objects.cube={robot: cube, position: [3, 0, 2]}"]
    words += ["sensors.lidar.noise=0", "sensors.lidar.missed=0"]
    log = log_of(words).log.columns
    # the first ray of the right half looks straight ahead
    assert np.nanmin(log["lidar_range_5"]) == pytest.approx(2.98, abs=0.02)
    assert np.nanmin(log["lidar_range_2"]) == 100.0


def test_a_snapshot_holds_the_last_ping() -> None:
    """A world continued from a snapshot pings as before."""
    world = make([*DIVE[1:], *SONAR])
    for _ in range(30):
        world.step()
    view = world.actors["robot"].sensor_suite.cameras["sonar"]
    kept, shot = world.snapshot(), view.shot
    for _ in range(30):
        world.step()
    after = view.shot
    world.restore(kept)
    assert view.shot is shot
    for _ in range(30):
        world.step()
    assert view.shot is not None
    assert after is not None
    assert view.shot.files() == after.files()
    world.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["+sonar=forwards"], "forward"),
        (["+sonar=forward", "sensors.sonar.frequncy=1e5"], "frequency"),
        (["+sonar=forward", "sensors.sonar.nearest=11"], "nearest below farthest"),
        (["+sensor@sensors.a=lidar", "sensors.a.points=0"], "1 to 65536"),
    ],
)
def test_what_is_mistyped_is_refused(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two lines with what is allowed, exit code 2."""
    assert main([*DIVE, *words]) == 2
    assert said in capsys.readouterr().err
