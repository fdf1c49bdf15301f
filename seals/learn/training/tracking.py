"""Experiment trackers: training metrics in TensorBoard, MLflow or Weights & Biases."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from seals.errors import ConfigError, optional_import, suggestion

PROJECT = "seals"
"""Project, or experiment, under which trackers list trainings."""


class Tracker(Protocol):
    """Receiver of the figures of a training."""

    def add(self, values: Mapping[str, float], step: int) -> None:
        """Take the figures of a row by name, at a number of control steps."""

    def close(self) -> None:
        """Write what is left."""


class _TensorBoard:
    def __init__(self, folder: Path, facts: Mapping[str, Any]) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._writer = SummaryWriter(str(folder / "tensorboard"))

    def add(self, values: Mapping[str, float], step: int) -> None:
        for name, value in values.items():
            self._writer.add_scalar(name, value, step)

    def close(self) -> None:
        self._writer.close()


class _Wandb:
    """Offline unless ``WANDB_MODE`` says otherwise: nothing leaves the machine by itself."""

    def __init__(self, folder: Path, facts: Mapping[str, Any]) -> None:
        import wandb

        mode: Any = os.environ.get("WANDB_MODE", "offline")
        self._run: Any = wandb.init(
            project=PROJECT,
            name=folder.name,
            dir=str(folder),
            config=dict(facts),
            mode=mode,
            settings=wandb.Settings(console="off", silent=True),
        )

    def add(self, values: Mapping[str, float], step: int) -> None:
        self._run.log(dict(values), step=step)

    def close(self) -> None:
        self._run.finish()


class _Mlflow:
    """In the training's folder unless ``MLFLOW_TRACKING_URI`` says otherwise."""

    def __init__(self, folder: Path, facts: Mapping[str, Any]) -> None:
        from mlflow.tracking import MlflowClient

        whole = folder.resolve()
        place = os.environ.get("MLFLOW_TRACKING_URI") or f"sqlite:///{whole / 'mlflow.db'}"
        self._client: Any = MlflowClient(tracking_uri=place)
        found = self._client.get_experiment_by_name(PROJECT)
        if found is None:
            files = (whole / "mlruns").as_uri() if place.startswith("sqlite") else None
            number = self._client.create_experiment(PROJECT, artifact_location=files)
        else:
            number = found.experiment_id
        self._id = self._client.create_run(number).info.run_id
        self._client.set_tag(self._id, "mlflow.runName", folder.name)
        for name, value in facts.items():
            self._client.log_param(self._id, name, str(value)[:250])

    def add(self, values: Mapping[str, float], step: int) -> None:
        for name, value in values.items():
            self._client.log_metric(self._id, name, value, step=step)

    def close(self) -> None:
        self._client.set_terminated(self._id)


_KINDS: Mapping[str, tuple[Callable[[Path, Mapping[str, Any]], Tracker], str]] = {
    "tensorboard": (_TensorBoard, "aam-seals[learn]"),
    "wandb": (_Wandb, "aam-seals[track]"),
    "mlflow": (_Mlflow, "aam-seals[track]"),
}


def tracker_of(name: str | None, folder: Path, facts: Mapping[str, Any]) -> Tracker | None:
    """Return the tracker of a training; None without a name.

    Args:
        name: ``tensorboard``, ``mlflow`` or ``wandb``.
        folder: of the training; what a tracker writes lies below it.
        facts: about the training: learner, seed, environment.

    Raises:
        ConfigError: there is no such tracker.
        MissingExtra: its package is not installed.
    """
    if name is None:
        return None
    if name not in _KINDS:
        raise ConfigError(f"track={name} is not known.\n{suggestion(name, _KINDS)}")
    kind, package = _KINDS[name]
    with optional_import(
        f"track={name} needs a package",
        f"Install it: pip install '{package}'; the CSV files say the same without it.",
    ):
        return kind(folder, facts)
