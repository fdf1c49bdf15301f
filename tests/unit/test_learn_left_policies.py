"""What a training leaves in its folder: policies, the best of them, a checkpoint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seals.errors import ConfigError
from seals.learn.policy import load_policy
from seals.learn.training.checkpoint import FILE, read_checkpoint
from seals.learn.training.loop import STOP, Training, take_up
from seals.learn.training.schedule import TrainingSchedule
from seals.learn.training.scoring import Scores
from seals.plugins.learners.sac import SAC
from tests.unit.test_learn_training import LEARNERS, SMALL, table, training_of


def test_policies_of_all_evaluations_stay_where_it_is_said(tmp_path: Path) -> None:
    """One policy a look, of that step; the last is the policy. By default there is only that."""
    course = TrainingSchedule(steps=400, look_every=200, episodes=2, keep=True)
    training_of(SAC(**SMALL), tmp_path / "a", course=course).run()
    names = ["policy", "policy_0", "policy_200", "policy_400"]
    assert sorted(p.name for p in (tmp_path / "a").glob("policy*")) == names
    tables = [(tmp_path / "a" / name / "policy.safetensors").read_bytes() for name in names]
    assert tables[0] == tables[3]
    assert len(set(tables)) == 3
    assert [load_policy(tmp_path / "a" / name).metadata["step"] for name in names[1:]] == [
        0,
        200,
        400,
    ]
    training_of(SAC(**SMALL), tmp_path / "b").run()
    assert [p.name for p in (tmp_path / "b").glob("policy*")] == ["policy"]


@pytest.mark.slow
def test_the_best_policy_of_all_evaluations_is_left(tmp_path: Path) -> None:
    """It is the one with the most successes and the greatest return, across a resumption too."""
    last = 0
    for seed in range(4):
        course = TrainingSchedule(steps=200, look_every=40, episodes=4, keep=True, best=True)
        folder = tmp_path / str(seed)
        first = training_of(SAC(**SMALL), folder, course=course, seed=seed)
        first.run()
        first.write()
        course.steps = 400
        second = training_of(SAC(**SMALL), folder, course=course, seed=seed)
        second.resume(read_checkpoint(folder, device="cpu"))
        outcome = second.run()
        rows = table(folder / "evaluation.csv")
        best = max(rows, key=lambda row: (float(row["success"]), float(row["return"])))
        left = [
            folder / name / "policy.safetensors" for name in ("policy", f"policy_{best['step']}")
        ]
        assert left[0].read_bytes() == left[1].read_bytes()
        assert outcome.success == float(best["success"])
        last += best is rows[-1]
    assert last < 4


@pytest.mark.parametrize(("begun", "left"), [(False, "policy_80"), (True, "policy_40")])
def test_the_best_may_be_asked_for_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begun: bool, left: str
) -> None:
    """What stands in the folder then has to be surpassed, too; a return that is no number loses."""
    wins = iter(((0, -9.0), (3, -1.0), (2, -1.0), (1, -1.0), (2, float("nan")), (2, -2.0)))

    def scored(*_: Any) -> Scores:
        won, gain = next(wins)
        success, rows = np.arange(4) < won, np.arange(4)
        return Scores(rows, success, np.full(4, gain), np.ones(4, dtype=np.int64), {})

    monkeypatch.setattr(Training, "_scores", scored)
    course = TrainingSchedule(steps=80, look_every=40, episodes=4, keep=True, best=begun)
    first = training_of(SAC(**SMALL), tmp_path, course=course)
    first.run(over=False)
    first.write()
    course.steps, course.best = 200, True
    second = training_of(SAC(**SMALL), tmp_path, course=course)
    second.resume(read_checkpoint(tmp_path, device="cpu"))
    assert second.run().success == {"policy_40": 0.75, "policy_80": 0.5}[left]
    one, other = (tmp_path / name / "policy.safetensors" for name in ("policy", left))
    assert one.read_bytes() == other.read_bytes()


def test_a_training_that_is_not_over_keeps_its_checkpoint(tmp_path: Path) -> None:
    """What comes after a part of it, and is cut off, begins there and not from nothing."""
    training = training_of(LEARNERS["sac"], tmp_path)
    training.write()
    training.run(over=False)
    assert (tmp_path / FILE).is_file()
    training.run()
    assert not (tmp_path / FILE).exists()


def test_processes_of_one_policy_stop_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another's wish to stop is one's own; a signal that comes while they agree counts later."""
    training, told = training_of(LEARNERS["sac"], tmp_path), []

    def agreed(number: int) -> int:
        told.append(number)
        # the signal comes in the third call, when this process has already said that it goes on
        training.stop = len(told) >= 3
        return STOP if len(told) == 5 else number if number < STOP else 0

    monkeypatch.setattr("seals.learn.training.loop.largest_of_all", agreed)
    training.course.checkpoint = 1e6
    with pytest.raises(KeyboardInterrupt):
        training.run()
    assert told == [0, 0, 0, STOP, STOP]
    state = read_checkpoint(tmp_path, device="cpu")
    assert state["place"]["step"] == training.step
    monkeypatch.setattr("seals.learn.training.loop.alike_in_all", lambda _: False)
    with pytest.raises(ConfigError, match=r"interrupted at different steps, this one at \d+\.\n"):
        take_up(training_of(LEARNERS["sac"], tmp_path), device="cpu")
