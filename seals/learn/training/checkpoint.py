"""Checkpoints of a training: arrays and JSON, written atomically, read as data only."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.learn.training.tensor_state import stored, tensors_of
from seals.logs.atomic import atomic_path
from seals.state_file import StateError, read_state, write_state

FILE = "checkpoint.bin"
KIND = "training"


def write_checkpoint(folder: Path, state: dict[str, Any]) -> None:
    """Write a checkpoint of plain data and tensors, replacing an earlier one atomically.

    Args:
        folder: of the training.
        state: nested mappings and lists of tensors, numbers, text and None.

    Raises:
        ConfigError: a part of the state cannot be kept on disk.
        DiskFull: there is no room; the earlier one stands.
    """
    try:
        with atomic_path(folder / FILE) as beside:
            write_state(beside, KIND, stored(state))
    except TypeError as cause:
        raise ConfigError(
            f"the state of this training cannot be kept on disk: {cause}.\n"
            "Train without checkpoints: course.checkpoint=0"
        ) from cause


def read_checkpoint(folder: Path, *, device: str) -> dict[str, Any]:
    """Read a checkpoint; only plain data and tensors are accepted.

    Raises:
        ConfigError: there is none, or it cannot be used.
    """
    path = folder / FILE
    if not has_checkpoint(folder):
        raise ConfigError(
            f"resume={folder}: there is no {FILE} in this folder.\n"
            "A training that was completed keeps none; start again without resume."
        )
    try:
        state = read_state(
            path, KIND, most=os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
        )
        if not isinstance(state, dict):
            raise StateError(f"it holds a {type(state).__name__}")
        found: dict[str, Any] = tensors_of(state, device)
    except (StateError, TypeError) as cause:
        words = " ".join(str(cause).split())
        raise ConfigError(
            f"{path} cannot be resumed: {words[:200]}\n"
            "It is damaged, or was not written by seals train; start again without resume."
        ) from cause
    return found


def has_checkpoint(folder: Path) -> bool:
    """Return True if a training can be resumed."""
    return (folder / FILE).is_file()


def remove_checkpoint(folder: Path) -> None:
    """Remove the checkpoint of a training that is complete or restarted."""
    (folder / FILE).unlink(missing_ok=True)
