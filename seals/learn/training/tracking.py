"""Experiment trackers: training metrics in TensorBoard, MLflow or Weights & Biases, by TorchRL."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from seals.errors import optional_import, refuse_unlisted

PROJECT = "seals"
"""Project, or experiment, under which trackers list trainings."""
_Loggers = tuple[Any, Callable[[], object]]
"""Logger of TorchRL, and what ends it."""


class Tracker:
    """Receiver of the figures of a training.

    Args:
        logger: of TorchRL.
        close: writes what is left.
    """

    def __init__(self, logger: Any, close: Callable[[], object]) -> None:
        self._logger, self.close = logger, close

    def add(self, values: Mapping[str, float], step: int) -> None:
        """Take the figures of a row by name, at a number of control steps."""
        for name, value in values.items():
            self._logger.log_scalar(name, value, step=step)


def _tensorboard(folder: Path, facts: Mapping[str, Any]) -> _Loggers:
    import torch.utils.tensorboard  # noqa: F401  TorchRL would not say what is missing
    from torchrl.record.loggers.tensorboard import TensorboardLogger

    found = TensorboardLogger("tensorboard", log_dir=str(folder))
    return found, found.experiment.close


def _wandb(folder: Path, facts: Mapping[str, Any]) -> _Loggers:
    """Offline unless ``WANDB_MODE`` says otherwise: nothing leaves the machine by itself."""
    import wandb
    from torchrl.record.loggers.wandb import WandbLogger

    found = WandbLogger(
        folder.name,
        save_dir=str(folder),
        project=PROJECT,
        log_env_packages=False,
        config=dict(facts),
        mode=os.environ.get("WANDB_MODE", "offline"),
        settings=wandb.Settings(console="off", silent=True),
    )
    return found, found.experiment.finish


def _mlflow(folder: Path, facts: Mapping[str, Any]) -> _Loggers:
    """In the training's folder unless ``MLFLOW_TRACKING_URI`` says otherwise."""
    import mlflow
    from torchrl.record.loggers.mlflow import MLFlowLogger

    whole = folder.resolve()
    place = os.environ.get("MLFLOW_TRACKING_URI") or f"sqlite:///{whole / 'mlflow.db'}"
    files = (whole / "mlruns").as_uri() if place.startswith("sqlite") else None
    found = MLFlowLogger(PROJECT, place, artifact_location=files)
    mlflow.set_tag("mlflow.runName", folder.name)
    mlflow.log_params({name: str(value)[:250] for name, value in facts.items()})
    return found, mlflow.end_run


_KINDS: Mapping[str, tuple[Callable[[Path, Mapping[str, Any]], _Loggers], str]] = {
    "tensorboard": (_tensorboard, "learn"),
    "wandb": (_wandb, "track"),
    "mlflow": (_mlflow, "track"),
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
    refuse_unlisted(name, _KINDS, f"track={name} is not known")
    kind, extra = _KINDS[name]
    with optional_import(
        f"track={name} needs a package",
        f"Install it: pip install 'aam-seals[{extra}]'; the CSV files contain the same data.",
    ):
        return Tracker(*kind(folder, facts))
