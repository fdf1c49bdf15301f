"""Films of policies: what is filmed is the episode, and what cannot be filmed is said."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.cli.main import main
from seals.config.compose import compose
from seals.errors import ConfigError
from seals.learn.environments.simulator import EpisodeFrame
from seals.learn.starts import held_out_seeds

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")
av = pytest.importorskip("av", reason="a film needs PyAV: pip install 'aam-seals[render]'")

SHORT = ["env=reach", "task.duration=0.4"]
TINY = [*SHORT, "count=2", "learner.hidden=[8]", "learner.random_steps=4", "course.steps=8"]


def frames(path: Path) -> list[Any]:
    """All pictures of a film, each of shape (high, wide, 3)."""
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def episode(words: list[str], count: int) -> tuple[list[EpisodeFrame], list[float]]:
    """What was watched while the expert acted, and the heights that the environment told."""
    from seals.learn.environments import batched_of
    from seals.learn.evaluation.policies import PolicyScripted
    from seals.learn.film import episode_frames

    environment: Any = batched_of(compose(words, root="learn"), count=count)
    heights = []

    class Noting(PolicyScripted):
        def act(self, observation: Any) -> Any:
            now = environment.now
            heights.append(float(now.position[0, 2]))
            return super().act(observation)

    try:
        return episode_frames(environment, Noting(environment), 7), heights
    finally:
        environment.close()


def test_a_twin_is_watched_every_control_step_to_the_end_of_its_episode() -> None:
    """The first row is the start, the last one the end, not the start of the next episode."""
    rows, heights = episode(SHORT, 3)
    np.testing.assert_allclose([row.time for row in rows], 0.04 * np.arange(11), atol=1e-9)
    seen = [row.actors["robot"].position[2] for row in rows]
    np.testing.assert_allclose(seen[:-1], heights, atol=1e-12)
    # ten steps at most 0.04 s long: whoever began anew would stand elsewhere
    assert np.abs(np.diff(seen)).max() < 0.1
    assert np.ptp([row.target for row in rows], axis=0).max() == 0.0


def test_a_world_is_watched_at_every_step_of_its_engine() -> None:
    """Legs that step between two control steps are seen to step."""
    rows, heights = episode([*SHORT, "backend=free", "time.step=0.004"], 1)
    np.testing.assert_allclose([row.time for row in rows], 0.004 * np.arange(101), atol=1e-9)
    seen = [row.actors["robot"].position[2] for row in rows]
    np.testing.assert_allclose(seen[:-1:10], heights, atol=1e-12)


def test_the_film_of_an_evaluation_shows_its_first_start(tmp_path: Path) -> None:
    """Eleven frames, the red ball of the target in each, and a robot that moves."""
    words = [*SHORT, "policy=scripted", "beside=[]", "episodes=2", "film=true", f"out={tmp_path}"]
    assert main(["evaluate", *words, f"hydra.run.dir={tmp_path / 'job'}"]) == 0
    shown = np.array(frames(tmp_path / "policy.mp4"), dtype=float)
    assert shown.shape == (11, 300, 480, 3)
    red = (shown[..., 0] > 1.5 * shown[..., 1]) & (shown[..., 0] > 1.2 * shown[..., 2])
    assert red.sum(axis=(1, 2)).min() > 5
    assert np.abs(shown[0] - shown[-1]).max() > 30.0
    seeds = (tmp_path / "episodes.csv").read_text().splitlines()[1]
    assert str(held_out_seeds(1)[0]) in seeds


@pytest.mark.thorough
def test_a_training_leaves_a_film_only_where_it_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The film does not make another training: the hashes on the cards are equal."""
    hashes = []
    for wanted in ("false", "true"):
        folder = tmp_path / wanted
        assert main(["train", *TINY, f"film={wanted}", f"hydra.run.dir={folder}"]) == 0
        assert (folder / "policy.mp4").is_file() == (wanted == "true")
        metadata = json.loads((folder / "policy" / "card.json").read_text())
        hashes.append((metadata["config_hash"], metadata["world_hash"], metadata["overrides"]))
    assert hashes[0] == hashes[1]
    assert len(frames(folder / "policy.mp4")) == 11
    assert f"film: {folder / 'policy.mp4'} (0.4 s, start 1000000000)" in capsys.readouterr().out


def test_a_film_that_cannot_be_written_is_refused_before_the_training(
    tmp_path: Path, absent: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody waits an hour to learn that a package is missing."""
    absent("av")
    assert main(["train", *TINY, "film=true", f"hydra.run.dir={tmp_path}"]) == 2
    assert "aam-seals[render]" in capsys.readouterr().err
    assert not (tmp_path / "run.json").exists()


def test_a_viewer_that_draws_nothing_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A page for a browser is no film."""
    words = [*TINY, "film=true", "viewer=browser", f"hydra.run.dir={tmp_path}"]
    assert main(["train", *words]) == 2
    assert "renders no frames" in capsys.readouterr().err


def test_a_training_is_not_lost_with_its_film(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What goes wrong while it is drawn is told; policy and curves are there, all is well."""

    def broken(*_: Any, **__: Any) -> None:
        raise ConfigError("the disk is full of films.\nRemove some")

    monkeypatch.setattr("seals.learn.film.write_film", broken)
    assert main(["train", *TINY, "film=true", f"hydra.run.dir={tmp_path}"]) == 0
    assert "no film of the policy. the disk is full" in capsys.readouterr().err
    assert json.loads((tmp_path / "run.json").read_text())["state"] == "done"
    assert (tmp_path / "policy" / "card.json").is_file()
