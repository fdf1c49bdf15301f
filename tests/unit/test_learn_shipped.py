"""The demonstrations that come with a robot: named, whole, and repeated by their own actions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.errors import ConfigError, LogError
from seals.learn.metadata import world_hash
from seals.learn.shipped import DEMONSTRATIONS, demonstrations_folder, shipped

pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

from tests.unit.played import replayed


def test_ten_episodes_of_the_script_come_with_the_manipulator() -> None:
    """All succeed, no hand was at it, and they are small."""
    from seals.learn.demonstrations.episode import Who
    from seals.learn.demonstrations.folder import read

    assert "aam/reach" in shipped(DEMONSTRATIONS)
    folder = demonstrations_folder("aam/reach")
    found = read(folder)
    assert len(found.episodes) == 10
    assert all(episode.success for episode in found.episodes)
    assert found.origin.who is Who.scripted
    assert '"human": false' in (folder / "card.json").read_text()
    assert sum(file.stat().st_size for file in folder.rglob("*")) < 1_000_000


def test_shipped_demonstrations_are_written_again_alike(tmp_path: Path) -> None:
    """Byte for byte; a card of another size is refused."""
    from seals.learn.demonstrations.folder import FILE, read, write

    place = demonstrations_folder("aam/reach")
    folder = write(read(place), tmp_path / "again")
    assert (folder / FILE).read_bytes() == (place / FILE).read_bytes()
    other = write(read(place).first(9), tmp_path / "nine")
    (other / FILE).replace(folder / FILE)
    with pytest.raises(LogError, match=rf"{FILE}: 'action' is[\s\S]*2000"):
        read(folder)


@pytest.mark.thorough
def test_they_are_of_the_environment_as_it_stands_and_repeat() -> None:
    """The same actions from the same seeds lead to the same numbers, in single precision."""
    from seals.learn.demonstrations.folder import read
    from seals.learn.environments import batched_of

    found = read(demonstrations_folder("aam/reach"))
    config = compose(["env=reach"], root="record")
    assert found.origin.config_hash == world_hash(config)
    episodes = [*found.episodes]
    with_same = replayed(batched_of(config, count=len(episodes)), episodes)
    for old, new in zip(episodes, with_same, strict=True):
        # another processor rounds the last digit otherwise; the way through the surface makes
        # some thousand times as much of it
        for here, there in ((new.observation, old.observation), (new.reward, old.reward)):
            np.testing.assert_allclose(here[:10], there[:10], rtol=1e-6, atol=1e-6)
            np.testing.assert_allclose(here, there, rtol=0.0, atol=1e-2)
        assert new.success


def test_a_name_that_nobody_ships_is_refused_with_the_nearest() -> None:
    """The words name what there is."""
    with pytest.raises(ConfigError, match=r"no such folder[\s\S]*aam/reach"):
        demonstrations_folder("aam/reech")


@pytest.mark.thorough
def test_a_learner_is_shown_them_by_name(tmp_path: Path) -> None:
    """Behaviour cloning needs nothing else."""
    words = ["train", "learner=bc", "demonstrations=aam/reach", "learner.updates=5"]
    course = ["course.steps=10", "course.episodes=2", f"hydra.run.dir={tmp_path}"]
    assert main([*words, *course]) == 0
    assert (tmp_path / "policy" / "policy.safetensors").is_file()


def test_machine_code_is_no_part_of_a_world() -> None:
    """A compiled world is the same; one of another water is not."""
    plain, compiled, other = (
        world_hash(compose(["env=reach", "backend=mujoco", *words], root="learn"))
        for words in ([], ["backend.compiled=true"], ["effects.water_drag.coefficient_x=20"])
    )
    assert plain == compiled
    assert plain != other
