"""Experiment on learning from a diagnosis: worlds, arms, and what is told of them."""

from __future__ import annotations

import contextlib
import importlib
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from seals.config.compose import compose
from seals.errors import ConfigError, SealsError
from seals.experiments.learning_study import running
from seals.experiments.learning_study.arms import Training
from seals.experiments.posterior import judgements, main, share_of, shipped
from seals.experiments.posterior.outcome import difference, gather, kept, scores, tell
from seals.experiments.posterior.tasks import (
    ARMS,
    TASKS,
    stated_of,
    trainings,
    write_stated,
)
from seals.learn.environments.build import build_learning
from seals.learn.environments.posterior import posterior_of
from seals.learn.evaluation.page import EvaluationResult, write_results
from seals.logs.atomic import write_table
from seals.robot.build import build_robot

pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")


@pytest.mark.thorough
@pytest.mark.parametrize("name", TASKS)
def test_arms_differ_in_what_they_know_alone(name: str) -> None:
    """Same words but for the effects and their answer; the same seeds; the world is the judge's."""
    task, answers = TASKS[name], shipped(name)
    jobs = trainings(Path("out"), task, answers, seeds=2, device="cpu")
    assert [job.folder.as_posix() for job in jobs[:5]] == [
        *(f"out/{a}/0" for a in ARMS),
        "out/nominal/1",
    ]
    common = set(jobs[0].words) - {jobs[0].words[-1]}
    for arm, job in zip(ARMS, jobs, strict=False):
        extra = set(job.words) - common - {job.words[-1]}
        knows = {*task.effects, f"varied_from={answers / arm}", "varied=1"}
        assert extra == (set() if arm == "nominal" else knows)
        config = compose(list(job.words[1:]), root="train")
        assert config.course.steps == 5_500_000
        assert config.course.keep
    world = compose([*task.task, *task.real], root="evaluate")
    assert "interval" not in world.backend
    for instance, fields in task.truth.items():
        assert {k: world.effects[instance][k] for k in fields} == fields


@pytest.mark.parametrize("name", TASKS)
def test_what_each_arm_knows_is_read_as_it_is_stated(name: str, tmp_path: Path) -> None:
    """The answers that come along hold the stated numbers; that of the log is near the truth."""
    task = TASKS[name]
    settings = build_learning(compose([*task.task, *task.effects], root="train"))[0]
    root = build_robot(settings.robot).links[0]
    for arm, values in stated_of(task).items():
        write_stated(task, values, tmp_path / arm)
        for folder in (tmp_path, shipped(name)):
            found = posterior_of(folder / arm, settings.effects, root=root)
            stated = {f"{i}.{f}": one for i, fields in values.items() for f, one in fields.items()}
            assert set(found.estimates) == set(stated)
            for key, one in stated.items():
                assert found.estimates[key] == pytest.approx(one, abs=1e-12)
    known = posterior_of(shipped(name) / "posterior", settings.effects, root=root)
    wide = {f"{i}.{f}": one.sd for i, fs in task.tolerances.items() for f, one in fs.items()}
    for instance, fields in task.truth.items():
        for field, value in fields.items():
            one = known.estimates[f"{instance}.{field}"]
            # three standard deviations of what the log leaves open, and far less than without it
            assert abs(one.mean - value) < 3.0 * one.sd
            assert one.sd < 0.1 * wide[f"{instance}.{field}"]


def _judged(folder: Path, successes: int, away: float) -> None:
    """Ten episodes of a policy, of which some succeeded."""
    columns = {
        "seed": np.arange(10.0),
        "success": (np.arange(10) < successes).astype(float),
        "return": np.ones(10),
        "distance": np.full(10, away),
        "reached_after": np.where(np.arange(10) < successes, 1.5, np.nan),
    }
    judged = EvaluationResult(policy="policy", world="", columns=columns)
    write_results([judged], folder, facts={"env": "reach"})


def test_the_table_tells_paired_differences_of_the_last_policies(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three seeds, 9, 8 and 10 against 5, 5 and 5 of ten: 0.4 in the mean, by hand 0.15 to 0.65."""
    for arm, last in (("tolerances", (5, 5, 5)), ("posterior", (9, 8, 10))):
        for seed, count in enumerate(last):
            _judged(tmp_path / arm / str(seed) / "judged" / "0", 0, 2.0)
            _judged(tmp_path / arm / str(seed) / "judged" / "800", count, 0.01)
        # a policy that was not judged to its end does not count
        _judged(tmp_path / arm / "3" / "judged" / "0", 0, 2.0)
    # nor does one whose pair was not
    _judged(tmp_path / "posterior" / "3" / "judged" / "800", 0, 7.0)
    assert main(["current", "tell", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "| `posterior` | 0.900 | 0.90, 0.80, 1.00 | 0.010 |" in said
    # 4.303 times 0.1 / sqrt(3)
    assert "| `posterior` - `tolerances` | +0.400 (+0.152 to +0.648) | 3 | higher |" in said
    assert (tmp_path / "curves.png").stat().st_size > 0
    table = kept(tmp_path / "episodes.parquet")
    assert scores(table)["posterior"][1] == {0: 0.0, 800: 0.8}
    # the table alone tells the same again
    (tmp_path / "again").mkdir()
    assert tell(table, tmp_path / "again") in said
    write_table(tmp_path / "again" / "episodes.parquet", table)
    assert main(["current", "tell", "--out", str(tmp_path / "again")]) == 0
    assert capsys.readouterr().out == said
    (tmp_path / "again" / "episodes.parquet").unlink()
    with pytest.raises(SealsError, match="nothing was judged"):
        gather(tmp_path / "again")


@pytest.mark.parametrize("name", TASKS)
def test_the_page_has_the_tables_of_the_episodes_that_come_along(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Line by line, whole trainings of both tasks."""
    page = Path(__file__).parents[2] / "docs" / "learning_posterior.md"
    assert main([name, "tell", "--out", str(tmp_path)]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert len(told) == 2 + len(ARMS) + 2 + 3
    assert set(told) <= set(page.read_text(encoding="utf-8").splitlines())


def test_a_difference_takes_pairs_alone() -> None:
    """Seeds of one arm only are left out; one pair has no interval."""
    found = difference({0: 0.9, 1: 0.7, 5: 0.0}, {0: 0.5, 1: 0.5, 2: 1.0})
    assert found.seeds == 2
    assert found.mean == pytest.approx(0.3)
    assert found.verdict == "not shown"
    assert difference({0: 0.1, 1: 0.2}, {0: 0.9, 1: 1.0}).verdict == "lower"
    with pytest.raises(SealsError, match="at least two pairs"):
        difference({0: 0.9}, {0: 0.5, 1: 0.5})


def test_every_kept_policy_is_judged_in_the_real_world(tmp_path: Path) -> None:
    """Parts share the trainings without overlap; each kept policy has a judgement of its own."""
    task = TASKS["wind"]
    jobs = trainings(tmp_path, task, shipped("wind"), seeds=3, device="cpu")
    shares = [share_of(jobs, f"{k}/4") for k in (1, 2, 3, 4)]
    assert [job for share in shares for job in share] == sorted(
        jobs, key=lambda job: ARMS.index(job.folder.parent.name)
    )
    for step in (0, 800):
        (jobs[0].folder / f"policy_{step}").mkdir(parents=True)
    found = judgements(jobs, task, episodes=7)
    assert [job.folder.name for job in found] == ["0", "800"]
    assert {"episodes=7", f"policy={jobs[0].folder / 'policy_800'}", *task.real} <= set(
        found[1].words
    )
    for bad in ("5/4", "0/4", "2", "a/b"):
        with pytest.raises(ConfigError, match="is no part"):
            share_of(jobs, bad)


@pytest.mark.parametrize(("verb", "label"), [("train", "training"), ("evaluate", "judging")])
def test_the_display_says_what_is_going_on(
    verb: str, label: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its label follows the verb of the processes; here they do nothing but end."""
    said: list[str] = []

    @contextlib.contextmanager
    def display(label: str, total: int) -> Iterator[Callable[[int], None]]:
        said.append(f"{label} {total}")
        yield lambda done: None

    monkeypatch.setattr(running, "progress", display)
    monkeypatch.setattr(running, "SEALS", (sys.executable, "-c", "pass"))
    job = Training(tmp_path / "one", (verb,))
    assert running.run_all([job], at_once=1, limit=0.0) == 1
    assert said == [f"{label} 1"]


def test_a_wrong_task_is_refused() -> None:
    """The nearest name is told."""
    with pytest.raises(ConfigError, match="Did you mean 'current'"):
        main(["curent", "tell"])


WAITS = """
import pathlib, signal, sys, time

def stop(number, frame):
    pathlib.Path("stopped").touch()
    sys.exit(130)

signal.signal(signal.SIGTERM, stop)
pathlib.Path("began").touch()
time.sleep(60)
"""


def test_processes_end_with_what_began_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are asked to stop when it is interrupted, and write what they have by then."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(running, "SEALS", (sys.executable, "-c", WAITS))

    def pause(_: float) -> None:
        time.sleep(0.02)
        if (tmp_path / "began").exists():
            raise KeyboardInterrupt

    clock = SimpleNamespace(sleep=pause, monotonic=time.monotonic)
    monkeypatch.setattr(running, "time", clock)
    with pytest.raises(KeyboardInterrupt):
        running.run_all([Training(tmp_path / "one", ("train",))], at_once=1, limit=0.0)
    assert (tmp_path / "stopped").exists()


def test_a_verb_that_is_refused_ends_the_experiment_in_words(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its own words stand above; the diagnosis of a flight may end with the code of a finding."""
    monkeypatch.setattr(running, "SEALS", (sys.executable, "-c", "import sys; sys.exit(7)"))
    with pytest.raises(running.VerbFailed, match="seals record ended with exit code 7") as refusal:
        running.run_verb("record")
    assert refusal.value.code == 7


@pytest.mark.parametrize(
    "words",
    [("--jobs=0",), ("--limit=nan",), ("--limit=-1",), ("--seeds=-1",), ("--seeds=1e9",)],
)
@pytest.mark.parametrize("name", ["posterior", "five_seeds", "learning_study"])
def test_senseless_numbers_are_refused(name: str, words: tuple[str, ...], tmp_path: Path) -> None:
    """No process at a time would wait for ever; nothing is written."""
    task = {"posterior": ["wind", "train"], "five_seeds": ["reach"], "learning_study": []}[name]
    experiment = importlib.import_module(f"seals.experiments.{name}")
    with pytest.raises(ConfigError, match="Allowed"):
        experiment.main([*task, "--out", str(tmp_path / "out"), *words])
    assert list(tmp_path.iterdir()) == []
