"""Figures of a training in trackers: what they hold is what the CSV files say."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from seals.cli.main import main

torch = pytest.importorskip("torch", reason="learning needs torch: pip install 'aam-seals[learn]'")

TINY = ["task.duration=0.2", "count=4", "course.steps=8", "course.episodes=2"]
TINY += ["course.look_every=4", "learner.hidden=[8]", "learner.random_steps=8"]


def trained(folder: Path, tracker: str) -> list[dict[str, str]]:
    """Train for two steps and return the rows of the evaluations."""
    words = ["train", "env=hover", *TINY, f"track={tracker}", f"hydra.run.dir={folder}"]
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


def test_wandb_stays_offline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One offline run with its figures below the training's folder, for wandb sync."""
    pytest.importorskip("wandb", reason="needs aam-seals[track]")
    monkeypatch.delenv("WANDB_MODE", raising=False)
    trained(tmp_path / "run", "wandb")
    folders = list((tmp_path / "run" / "wandb").glob("offline-run-*"))
    assert len(folders) == 1
    (file,) = folders[0].glob("*.wandb")
    content = file.read_bytes()
    assert b"evaluation/return" in content
    assert b"config_hash" in content


@pytest.mark.filterwarnings("ignore:The ``noload`` loader strategy")  # of MLflow's own tables
def test_mlflow_holds_the_evaluations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The curve of returns is that of evaluation.csv, and the run has ended."""
    tracking: Any = pytest.importorskip("mlflow.tracking", reason="needs aam-seals[track]")
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    rows = trained(tmp_path / "run", "mlflow")
    client = tracking.MlflowClient(tracking_uri=f"sqlite:///{tmp_path / 'run' / 'mlflow.db'}")
    found = client.get_experiment_by_name("seals")
    (run,) = client.search_runs([found.experiment_id])
    curve = client.get_metric_history(run.info.run_id, "evaluation/return")
    assert [e.step for e in curve] == [int(row["step"]) for row in rows]
    assert run.info.status == "FINISHED"
    assert run.data.params["learner"] == "sac"


def test_another_tracker_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two lines with the nearest name; no training begins."""
    words = ["train", "env=hover", *TINY, "track=wanddb", f"hydra.run.dir={tmp_path / 'r'}"]
    assert main(words) == 2
    assert "Did you mean 'wandb'?" in capsys.readouterr().err
    assert not (tmp_path / "r").exists() or "evaluation.csv" not in json.dumps(
        [path.name for path in (tmp_path / "r").iterdir()]
    )
