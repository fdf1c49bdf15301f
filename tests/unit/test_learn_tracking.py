"""Figures of a training in trackers: what they hold is what the CSV files say."""

from __future__ import annotations

import csv
import json
import sqlite3
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from seals.cli.main import main

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

TINY = ["task.duration=0.2", "count=4", "course.steps=8", "course.episodes=2"]
TINY += ["course.look_every=4", "learner.hidden=[8]", "learner.random_steps=8"]


def trained(folder: Path, tracker: str, *, apart: bool = False) -> list[dict[str, str]]:
    """Train for two steps and return the rows of the evaluations.

    ``apart``: in a process of its own, where a tracker of 70 MB does not stay in this one.
    """
    words = ["train", "env=hover", *TINY, f"track={tracker}", f"hydra.run.dir={folder}"]
    if apart:
        program = "from seals.cli.main import main; raise SystemExit(main())"
        subprocess.run([sys.executable, "-P", "-c", program, *words], check=True)
    else:
        assert main(words) == 0
    with (folder / "evaluation.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_tensorboard_holds_the_evaluations(tmp_path: Path) -> None:
    """The curve of returns is that of evaluation.csv."""
    pytest.importorskip("tensorboard", reason="needs aam-seals[learn]")
    rows = trained(tmp_path / "run", "tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(tmp_path / "run" / "tensorboard"))
    found.Reload()
    curve = [(e.step, e.value) for e in found.Scalars("evaluation/return")]
    assert [step for step, _ in curve] == [int(row["step"]) for row in rows]
    assert [value for _, value in curve] == pytest.approx(
        [float(row["return"]) for row in rows], rel=1e-6
    )


@pytest.mark.thorough
def test_wandb_stays_offline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One offline run with its figures below the training's folder, for wandb sync."""
    pytest.importorskip("wandb", reason="needs aam-seals[track]")
    monkeypatch.delenv("WANDB_MODE", raising=False)
    trained(tmp_path / "run", "wandb")
    folders = list((tmp_path / "run" / "wandb").glob("offline-run-*"))
    assert len(folders) == 1
    (file,) = folders[0].glob("*.wandb")
    # a process of wandb's own writes it
    until = time.monotonic() + 60.0
    while b"evaluation/return" not in (content := file.read_bytes()) and time.monotonic() < until:
        time.sleep(0.1)
    assert b"evaluation/return" in content
    assert b"config_hash" in content


@pytest.mark.slow
@pytest.mark.skipif(find_spec("mlflow") is None, reason="needs aam-seals[track]")
def test_mlflow_holds_the_evaluations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The curve of returns is that of evaluation.csv, and the run has ended."""
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    rows = trained(tmp_path / "run", "mlflow", apart=True)
    tables = sqlite3.connect(tmp_path / "run" / "mlflow.db")
    curve = tables.execute(
        "select step, value from metrics where key = 'evaluation/return' order by step"
    ).fetchall()
    runs = tables.execute(
        "select status, experiments.name from runs join experiments using (experiment_id)"
    ).fetchall()
    learner = tables.execute("select value from params where key = 'learner'").fetchall()
    tables.close()
    assert [step for step, _ in curve] == [int(row["step"]) for row in rows]
    assert [value for _, value in curve] == pytest.approx(
        [float(row["return"]) for row in rows], rel=1e-6
    )
    assert runs == [("FINISHED", "seals")]
    assert learner == [("sac",)]


def test_another_tracker_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two lines with the nearest name; no training begins."""
    words = ["train", "env=hover", *TINY, "track=wanddb", f"hydra.run.dir={tmp_path / 'r'}"]
    assert main(words) == 2
    assert "Did you mean 'wandb'?" in capsys.readouterr().err
    assert not (tmp_path / "r").exists() or "evaluation.csv" not in json.dumps(
        [path.name for path in (tmp_path / "r").iterdir()]
    )
