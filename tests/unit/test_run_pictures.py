"""Pictures of a run: taken when due, kept whole, the same again after a cut, free unless asked."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.logs.table import read_parquet
from seals.rendering import Cameras, Lens, Light, Picture, Poses, Scene
from seals.run import build_world
from seals.run.build import run_settings

POOL = [
    "run",
    "robot=aam",
    "water=fossen",
    "environment.tank_bottom=-1.5",
    "+cameras=aam",
    "sensors.front.width=32",
    "sensors.front.height=24",
    "sensors.belly.width=24",
    "sensors.belly.height=24",
    "sensors.belly.what=[rgb,depth,segmentation,normals]",
    "initial.position=[0,0,-0.5]",
    "water_type=coastal_1",
]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    """Every file of a run's pictures by its path."""
    found = sorted((folder / "pictures").rglob("*"))
    return {str(p.relative_to(folder)): p.read_bytes() for p in found if p.is_file()}


def test_a_run_keeps_its_pictures() -> None:
    """One file an image, an index with the times, the numbers in the log."""
    assert main([*POOL, "time.duration=0.4", "hydra.run.dir=run"]) == 0
    kept = files(Path("run"))
    for k in range(4):
        assert f"pictures/front/{k:06d}.png" in kept
        assert f"pictures/front/{k:06d}_depth.png" in kept
        for ending in ("", "_depth", "_parts", "_normals"):
            assert f"pictures/belly/{k:06d}{ending}.png" in kept
    assert not [name for name in kept if "000004" in name or name.startswith("pictures/.")]
    index = read_parquet(Path("run/pictures/belly/index.parquet"))
    np.testing.assert_allclose(index["t"], [0.1, 0.2, 0.3, 0.4], atol=1e-9)
    log = read_parquet(Path("run/log.parquet"))
    told = np.isfinite(log["belly_picture"])
    np.testing.assert_allclose(log["t"][told], index["t"])
    np.testing.assert_array_equal(log["belly_picture"][told], index["number"])
    about = json.loads(Path("run/pictures/belly/camera.json").read_text(encoding="utf-8"))
    assert about["link"] == "camera_belly"
    assert about["parts"][0] == "nothing"
    assert about["fx"] == pytest.approx(12.0 / np.tan(0.61))


@pytest.mark.thorough
def test_a_run_repeats_its_pictures_bit_for_bit() -> None:
    """Noise of optics and depth comes from the run's seed: repeat= gives the same files."""
    assert main([*POOL, "time.duration=0.2", "hydra.run.dir=one"]) == 0
    assert main(["run", "repeat=one", "hydra.run.dir=two"]) == 0
    one, two = files(Path("one")), files(Path("two"))
    assert one.keys() == two.keys()
    assert all(one[name] == two[name] for name in one)
    assert main([*POOL, "seed=1", "time.duration=0.2", "hydra.run.dir=three"]) == 0
    other = files(Path("three"))
    assert one["pictures/front/000001.png"] != other["pictures/front/000001.png"]


@pytest.mark.thorough
def test_a_run_that_was_cut_off_has_all_pictures_in_the_end(tmp_path: Path) -> None:
    """Killed and resumed: every picture is there and that of a run that was never cut off."""
    words = [*POOL, "time.duration=3", "time.step=0.002"]
    assert main([*words, "hydra.run.dir=whole"]) == 0
    code = "import sys; from seals.cli.main import main; sys.exit(main(sys.argv[1:]))"
    folder = Path("cut")
    child = subprocess.Popen(
        [sys.executable, "-c", code, *words, "checkpoint=0.05", "hydra.run.dir=cut"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ,
    )
    late = time.monotonic() + 60.0
    wanted = folder / "pictures" / "front" / "000006.png"
    while not (wanted.exists() and (folder / "checkpoint").exists()):
        assert child.poll() is None
        assert time.monotonic() < late
        time.sleep(0.005)
    time.sleep(0.1)
    child.send_signal(signal.SIGKILL)
    child.wait()
    assert main(["run", "resume=cut", "hydra.run.dir=rest"]) == 0
    whole, rest = files(Path("whole")), files(Path("rest"))
    assert whole.keys() == rest.keys()
    assert all(whole[name] == rest[name] for name in whole if name.endswith(".png"))


class Counting:
    """A renderer that counts what is asked of it."""

    def __init__(self) -> None:
        self.opened = self.rendered = self.closed = 0

    def open(self, scene: Scene, light: Light) -> None:
        """Count."""
        self.opened += 1

    def render(
        self, poses: Poses, cameras: Cameras, lens: Lens, *, normals: bool = False
    ) -> Picture:
        """Return a grey picture and count."""
        self.rendered += 1
        shape = (1, 1, lens.height, lens.width)
        depth = np.full(shape, 2.0, dtype=np.float32)
        return Picture(np.full((*shape, 3), 0.2, np.float32), depth, np.ones(shape, np.int32))

    def close(self) -> None:
        """Count."""
        self.closed += 1


def stepped(words: list[str], steps: int) -> tuple[Any, Counting]:
    """A world after some steps, with a renderer that counts."""
    settings = run_settings(words)
    settings.viewer = counting = Counting()
    world = build_world(settings)
    for _ in range(steps):
        world.step()
    return world, counting


def test_nothing_is_drawn_unless_a_picture_is_due() -> None:
    """100 steps of 4 ms with cameras of 10 Hz: eight pictures; without cameras not one scene."""
    world, counting = stepped(["robot=aam", "+cameras=aam"], 100)
    world.close()
    assert (counting.opened, counting.rendered, counting.closed) == (1, 8, 1)
    world, counting = stepped(["robot=aam"], 10)
    world.close()
    assert (counting.opened, counting.rendered) == (0, 0)


def test_latency_and_losses_are_those_of_every_sensor() -> None:
    """A late picture stands in the log when taken and arrives later; a lost one in neither."""
    words = ["robot=aam", "+sensor@sensors.eye=camera", "sensors.eye.latency=0.04"]
    world, _ = stepped([*words, "sensors.eye.rate=50"], 5)
    suite = world.actors["robot"].sensor_suite
    assert suite.readings["eye"]["picture"].tolist() == [0.0]
    assert [name for _, name, _ in suite.arrived if name == "eye"] == []
    for _ in range(10):
        world.step()
    assert [round(t, 6) for t, name, _ in suite.arrived if name == "eye"] == [0.02]
    world.close()
    world, _ = stepped([*words[:2], "sensors.eye.dropout=1.0", "sensors.eye.rate=250"], 10)
    assert world.actors["robot"].readings["eye"] is None
    world.close()


def test_a_snapshot_brings_the_picture_back() -> None:
    """After a restore the eye holds the picture of that time, and goes on with the same numbers."""
    world, _ = stepped(["robot=aam", "+sensor@sensors.eye=camera", "sensors.eye.rate=250"], 3)
    eye = world.actors["robot"].sensor_suite.cameras["eye"]
    kept, shot = world.snapshot(), eye.shot
    world.step()
    after = eye.shot
    world.restore(kept)
    assert eye.shot is shot
    world.step()
    assert eye.shot.number == after.number == 3
    np.testing.assert_array_equal(eye.shot.picture.colour, after.picture.colour)
    np.testing.assert_array_equal(eye.shot.picture.depth, after.picture.depth)
    world.close()


def test_water_colours_what_a_camera_sees() -> None:
    """Through water the cube before the camera loses red; in the air above it does not."""

    def red_share(height: float, water: str) -> float:
        words = ["robot=aam", "water=fossen", "+sensor@sensors.eye=camera", f"water_type={water}"]
        words += ["sensors.eye.rate=250", "optics.noise=false", "optics.caustics=false"]
        world, _ = stepped([*words, f"initial.position=[0,0,{height}]"], 1)
        shot = world.actors["robot"].sensor_suite.cameras["eye"].shot
        world.close()
        mean = shot.picture.colour.reshape(-1, 3).mean(axis=0)
        return float(mean[0] / mean[1])

    assert red_share(20.0, "coastal_5") == pytest.approx(1.0, abs=1e-3)
    assert red_share(-5.0, "none") == pytest.approx(1.0, abs=1e-3)
    assert red_share(-5.0, "oceanic_1") < 0.7
