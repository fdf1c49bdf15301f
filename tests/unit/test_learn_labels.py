"""Demonstrations that an expert gives to what another policy does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seals.cli.main import main
from seals.learn.demonstrations.folder import read

pytest.importorskip("torch", reason="the extra learn is not installed")
pytest.importorskip("tensordict", reason="the extra learn is not installed")

WORLD = ("task.duration=0.4", "keep=all")


def test_labels_are_what_the_expert_would_have_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is seen follows what was done, what is kept is what the expert said to it."""
    monkeypatch.chdir(tmp_path)
    for name, words in {
        "done": ["policy=still"],
        "said": ["policy=still", "labels=scripted"],
        "shown": ["policy=scripted"],
    }.items():
        assert main(["record", *WORLD, *words, "episodes=2", f"out={name}"]) == 0
    still, labelled, scripted = (read(tmp_path / name) for name in ("done", "said", "shown"))
    assert labelled.origin.by == "scripted"
    for done, said, shown in zip(still.episodes, labelled.episodes, scripted.episodes, strict=True):
        np.testing.assert_array_equal(done.observation, said.observation)
        assert not np.array_equal(shown.observation, said.observation)
        # both stand at the same start; later on the expert has gone on, and the other has not
        np.testing.assert_array_equal(shown.action[0], said.action[0])
        assert not np.array_equal(shown.action[-1], said.action[-1])
        assert not done.action.any()
        assert said.action.any()


def test_labels_come_after_what_was_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Earlier demonstrations of the same world come first; those of another are refused."""
    monkeypatch.chdir(tmp_path)
    assert main(["record", *WORLD, "episodes=2", "out=shown"]) == 0
    more = ["record", *WORLD, "policy=still", "labels=scripted", "episodes=1", "first=50"]
    assert main([*more, "after=shown", "out=both"]) == 0
    shown, both = read(tmp_path / "shown"), read(tmp_path / "both")
    assert [episode.seed for episode in both.episodes] == [0, 1, 50]
    assert both.origin.tried == 3
    for one, two in zip(shown.episodes, both.episodes[:2], strict=True):
        np.testing.assert_array_equal(one.action, two.action)
        np.testing.assert_array_equal(one.observation, two.observation)
    assert main([*more, "after=shown", "out=third", "task.speed=0.5"]) == 2
    assert "recorded in another world" in capsys.readouterr().err
    assert not (tmp_path / "third").exists()


def test_an_expert_that_is_not_there_is_refused_by_its_own_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mistyped name is told as that of the labels, with the nearest one."""
    monkeypatch.chdir(tmp_path)
    assert main(["record", *WORLD, "policy=still", "labels=scriptd", "out=none"]) == 2
    told = capsys.readouterr().err
    assert "labels=scriptd: there is no such folder" in told
    assert "scripted" in told
    assert not (tmp_path / "none").exists()
