"""Particles of a run: kept thinned when asked for, seen again in its folder, refused in words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.errors import ConfigError
from seals.run.particle_snapshots import MOST, Thinned, subsampled
from seals.run.recorder import Moment
from seals.run.replay_config import recalled
from seals.view import open_replay
from seals.view.instants import ParticleSnapshots
from seals.view.session import Session

pytestmark = pytest.mark.filterwarnings("ignore:.*getdefaultlocale:DeprecationWarning")


class Water:
    """More particles than are kept; all of them rise together."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def particles(self) -> Any:
        """Places and velocities."""
        places = np.arange(3.0 * (MOST + 1)).reshape(-1, 3)
        return places + np.array([0.0, 0.0, self._clock.time]), 0.0 * places


class Clock:
    """A world that only has time and water."""

    step_size = 0.04

    def __init__(self) -> None:
        self.time, self.fluid = 0.0, Water(self)


def test_a_thinned_set_comes_from_all_of_the_water() -> None:
    """Few particles stay as they are; of one too many every second is kept, the ends among them."""
    few = np.arange(30.0).reshape(-1, 3)
    assert np.array_equal(subsampled(few), few)
    assert len(subsampled(np.zeros((MOST, 3)))) == MOST
    many = np.arange(3.0 * (MOST + 1)).reshape(-1, 3)
    kept = subsampled(many)
    assert len(kept) == MOST // 2 + 1
    assert np.array_equal(kept[[0, 1, -1]], many[[0, 2, MOST]].astype(np.float32))


def test_one_set_for_every_interval_goes_by_its_time(tmp_path: Path) -> None:
    """Steps of 0.04 s and sets every 0.1 s; the set shown is the last one before a time."""
    world: Any = Clock()
    thinned = Thinned(0.1, world.fluid)
    thinned.start(world, tmp_path)
    for k in range(1, 11):
        world.time = k * world.step_size
        thinned.record(Moment(world, k, 0.0, dict))
    names = sorted(path.name for path in (tmp_path / "particles").iterdir())
    assert names == [f"t_{t:08.4f}.npy" for t in (0.12, 0.2, 0.32, 0.4)]
    drops = ParticleSnapshots(tmp_path)
    for time, written in ((0.0, 0.12), (0.199, 0.12), (0.2, 0.2), (9.0, 0.4)):
        places = drops.last(time)
        assert places is not None
        assert places[0] == pytest.approx([0.0, 1.0, 2.0 + written])
    assert ParticleSnapshots(None).last(0.0) is None
    assert ParticleSnapshots(tmp_path / "other").last(0.0) is None


@pytest.mark.parametrize(
    ("content", "words"), [(np.zeros(4), "no positions"), (np.full((2, 3), np.nan), "no positions")]
)
def test_what_is_no_set_of_places_is_refused(
    tmp_path: Path, content: np.ndarray[Any, Any], words: str
) -> None:
    """Numbers of another shape, numbers that are none, and a file cut short."""
    (tmp_path / "particles").mkdir()
    file = tmp_path / "particles" / "t_000.1000.npy"
    np.save(file, content)
    with pytest.raises(ConfigError, match=words):
        ParticleSnapshots(tmp_path).last(0.1)
    other = file.with_name("t_000.2000.npy")
    other.write_bytes(file.read_bytes()[:40])
    with pytest.raises(ConfigError, match="cannot be read"):
        ParticleSnapshots(tmp_path).last(0.2)
    file.rename(file.with_name("t_soon.npy"))
    with pytest.raises(ConfigError, match="no time in its name"):
        ParticleSnapshots(tmp_path)


@pytest.mark.thorough
def test_a_run_of_particles_shows_its_water_again(tmp_path: Path) -> None:
    """Water that rests stays where it was filled, from the floor to its level, in a replay, too."""
    folder = tmp_path / "tank"
    words = ["robot=ball", "water=particles", "fluid.spacing=0.05", "fluid.size=[0.6,0.6,0.4]"]
    words += ["initial.position=[0,0,0.3]", "time.duration=0.02", "particles=0.008"]
    assert main(["run", *words, f"hydra.run.dir={folder}"]) == 0
    assert len(list((folder / "particles").iterdir())) == 2
    replay = open_replay(folder)
    session = Session(recalled(folder), [], tmp_path / "looks")
    session.open(replay)
    seen = session.particles(0.02)
    assert seen is not None
    level = replay.stage.settings.environment.water_level
    assert level is not None
    assert len(seen) == pytest.approx(0.6 * 0.6 * 0.4 / 0.05**3, rel=0.15)
    assert seen[:, 2].max() == pytest.approx(level, abs=0.05)
    assert seen[:, 2].min() == pytest.approx(level - 0.4, abs=0.05)


def test_a_run_without_particles_keeps_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Asking for the particles of water by coefficients is refused, and a negative interval."""
    monkeypatch.chdir(tmp_path)
    assert main(["run", "robot=ball", "water=fossen", "particles=0.1"]) == 2
    assert "has no particle water" in capsys.readouterr().err
    assert main(["run", "robot=ball", "particles=-1"]) == 2
    assert "particles" in capsys.readouterr().err
