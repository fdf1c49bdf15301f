"""The first policy: what ``seals train`` without words trains, shows and leaves."""

from __future__ import annotations

from pathlib import Path

import pytest

from seals.cli.main import main
from seals.cli.train import FIRST, _first_policy


def test_only_bare_words_train_the_first_policy() -> None:
    """A word that names an environment, a learner or a value of them asks for another training."""
    for words in ([], ["seed=3", "out=a"], ["course.steps=9", "threads=2"], ["-m", "seed=1,2"]):
        assert _first_policy(words)[: len(FIRST)] == list(FIRST)
    for word in ("env=reach", "learner=sac", "sac", "task.hold=1", "+model=windy", "--help"):
        assert _first_policy([word, "seed=3"]) == []


@pytest.mark.thorough
def test_the_first_policy_shows_its_curve_and_how_to_fly_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A row for each evaluation, and a command that runs as it stands."""
    pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    short = ["course.steps=128", "course.look_every=64", "course.episodes=1", "film=false"]
    assert main(["train", *short, "out=first"]) == 0
    told = capsys.readouterr()
    rows = [line for line in told.err.splitlines() if "|" in line]
    assert [row.split()[0] for row in rows] == ["0%", "50%", "100%"]
    words = told.out.splitlines()[-1].partition("seals ")[2].split()
    assert "env=hover_wind" in words
    assert "backend=mujoco" in words
    assert main([*words, "episodes=1", "task.duration=0.2", "out=flown"]) == 0
    assert (tmp_path / "flown" / "episodes.csv").is_file()
