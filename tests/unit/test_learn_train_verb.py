"""``seals train``: settings, refusals, a small training and one that is taken up again."""

from __future__ import annotations

import csv
import json
import os
import signal
from pathlib import Path

import pytest

from seals.cli.main import main
from seals.config.build import build
from seals.config.compose import compose
from seals.errors import ConfigError, SealsError
from seals.learn.training.checkpoint import FILE, read_checkpoint, write_checkpoint
from seals.registry import names

TINY = [
    "task.duration=0.2",
    "count=2",
    "learner.hidden=[8]",
    "learner.batch=4",
    "learner.random_steps=4",
    "course.steps=12",
    "course.look_every=6",
    "course.log_every=4",
    "course.episodes=2",
]


def test_every_learner_composes_and_builds() -> None:
    """Each installed learner, and the paper's hyper-parameters, are options of the group."""
    for name in (*names("learner"), "sacfd_paper"):
        build(compose([f"learner={name}"], root="train").learner, where="learner")
    paper = compose(["learner=sacfd_paper"], root="train").learner
    assert (paper.batch, paper.steps, paper.learning_rate) == (2048, 10, 0.006)
    assert (paper.pretrain, paper.capacity, paper.random_steps) == (5000, 100_000, 10_000)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("learner=sacdf", "Did you mean 'sacfd'"),
        ("learner.gamma=1.5", "from 0 to 1"),
        ("learner.gama=0.9", "Did you mean 'gamma'"),
        ("course.step=3", "Did you mean 'steps'"),
    ],
)
def test_wrong_words_are_refused(override: str, words: str) -> None:
    """Unknown names and values out of bounds are refused with what is allowed."""
    with pytest.raises(SealsError, match=words):
        build(compose([override], root="train").learner, where="learner")


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("learner.batch=0", "learner.batch=0"),
        ("learner.reward_form=symlg", "Did you mean 'symlog'"),
        ("learner.demonstrations=yes", "none"),
        ("learner.hidden=many", "learner.hidden"),
    ],
)
def test_values_that_types_let_through_are_refused(override: str, words: str) -> None:
    """Sizes and words of a closed set are checked when the learner is built."""
    with pytest.raises(ConfigError, match=words):
        build(compose([override], root="train").learner, where="learner")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        (["learner=sacfd"], "needs demonstrations"),
        (["learner=ppo", "demonstrations=x"], "does not use them"),
        (["learner=visual_sac"], "needs pictures"),
        (["learner=ppo", "count=1", "learner.horizon=7"], "two steps or more in each minibatch"),
        (["course.steps=-1"], "course.steps=-1"),
        (["learner.hidden=[[8]]"], "hidden[0]=[8] is not allowed"),
        (["count=0"], "count=0"),
        (["device=gpu"], "Did you mean 'cuda'"),
        (["device=cuda:1"], "CUDA_VISIBLE_DEVICES"),
        (["resume=nowhere"], "no training in this folder"),
    ],
)
def test_trainings_that_cannot_be_are_refused(
    words: list[str],
    refusal: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What does not fit together is said in two lines, and no folder is left."""
    pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    assert main(["train", *words]) == 2
    said = capsys.readouterr().err
    assert refusal in said
    assert len(said.strip().splitlines()) == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", ["train", "evaluate", "record"])
def test_a_device_that_is_none_is_refused_by_every_verb(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the same words, before anything is computed or written."""
    pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    assert main([verb, "env=reach", "device=gpu"]) == 2
    said = capsys.readouterr().err
    assert said.splitlines() == [
        "ConfigError: device=gpu is not allowed.",
        "Did you mean 'cuda'?  Allowed: cpu, cuda",
    ]
    assert list(tmp_path.iterdir()) == []


def cut_off(monkeypatch: pytest.MonkeyPatch, words: list[str]) -> None:
    """Begin a training in the folder ``run`` and end it by SIGTERM after eight steps."""
    from seals.learn.training.loop import Training

    step = Training._log_evaluate_save

    def cut(self: Training) -> None:
        if self.step >= 8:
            os.kill(os.getpid(), signal.SIGTERM)
        step(self)

    with monkeypatch.context() as patch:
        patch.setattr(Training, "_log_evaluate_save", cut)
        assert main(["train", *words, "hydra.run.dir=run"]) == 130


@pytest.mark.thorough
def test_a_training_with_demonstrations_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its memory holds more than the demonstrations by then; one of other columns is refused."""
    pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    shown = ["learner=sacfd", "demonstrations=aam/reach", "shown=2", "learner.pretrain=2"]
    cut_off(monkeypatch, [*TINY, *shown])
    path = tmp_path / "run" / FILE
    state = read_checkpoint(path.parent, device="cpu")
    action = state["agent"]["memory"]["rows"]["action"]
    kept = path.read_bytes()
    state["agent"]["memory"]["rows"]["action"] = action[:, :-1].contiguous()
    write_checkpoint(path.parent, state)
    assert main(["train", "resume=run"]) == 2
    assert "rows.action" in capsys.readouterr().err
    path.write_bytes(kept)
    assert main(["train", "resume=run"]) == 0
    assert json.loads((tmp_path / "run" / "run.json").read_text())["step"] == 12


SHOWN = ["demonstrations=aam/reach", "shown=2"]
SHORT = [word for word in TINY if not word.startswith("learner.")]


@pytest.mark.thorough
@pytest.mark.parametrize(
    "words",
    [
        ["learner=ppo", "learner.hidden=[8]", "learner.horizon=3", "learner.minibatches=2"],
        ["learner=dagger", "learner.hidden=[8]", "learner.batch=4", "learner.led=2"],
        ["learner=rlpd", *(word for word in TINY if word.startswith("learner.")), *SHOWN],
        [
            *("learner=visual_sac", "env=reach_seen", "frames=1", "learner.channels=4"),
            *(f"sensors.{x}.{side}=24" for x in ("front", "belly") for side in ("width", "height")),
            *(word for word in TINY if word.startswith("learner.")),
        ],
        [
            *("learner=dagger_seen", "env=reach_current_seen", "learner.channels=4"),
            *("learner.hidden=[8]", "learner.batch=4", "learner.led=2", "learner.capacity=40"),
            *(f"sensors.{x}.{side}=24" for x in ("front", "belly") for side in ("width", "height")),
        ],
    ],
    ids=lambda words: words[0],
)
def test_what_other_learners_remember_has_grown_when_they_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    """The command line checks the form of a state that was written between two steps."""
    pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    cut_off(monkeypatch, [*SHORT, *words])
    assert main(["train", "resume=run"]) == 0
    facts = json.loads((tmp_path / "run" / "run.json").read_text())
    assert (facts["state"], facts["step"]) == ("done", 12)


def test_a_training_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Curves, policy and run.json are written; one that was cut off goes on, another is refused."""
    pytest.importorskip("torchrl")
    monkeypatch.chdir(tmp_path)
    cut_off(monkeypatch, TINY)
    run = tmp_path / "run"
    assert json.loads((run / "run.json").read_text())["state"] == "interrupted"
    assert (run / FILE).is_file()
    assert main(["train", "resume=run", "learner.gamma=0.9"]) == 2
    assert "would change the training" in capsys.readouterr().err
    assert main(["train", "resume=run"]) == 0
    facts = json.loads((run / "run.json").read_text())
    assert (facts["state"], facts["step"], facts["learner"], facts["seed"]) == (
        "done",
        12,
        "sac",
        0,
    )
    metadata = json.loads((run / "policy" / "card.json").read_text())
    assert (metadata["learner"], metadata["overrides"]) == ("sac", ["task.duration=0.2"])
    with (run / "evaluation.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["step"] for row in rows] == ["0", "6", "12"]
    best = max(rows, key=lambda row: (float(row["success"]), float(row["return"])))
    assert metadata["step"] == int(best["step"])
    assert not (run / FILE).exists()
