"""The state of a training on disk, whole or not at all, and read without running any of it."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from seals.errors import ConfigError
from seals.logs.atomic import atomic_path

FILE = "checkpoint.pt"
FORM = 1
"""Version of the form of a checkpoint."""


def write_checkpoint(folder: Path, state: dict[str, Any]) -> None:
    """Write plain data and tensors; an earlier checkpoint gives way when this one is whole.

    Args:
        folder: of the training.
        state: nested mappings and lists of tensors, numbers, text and None.
    """
    import torch

    with atomic_path(folder / FILE) as beside:
        torch.save({"form": FORM, **state}, beside)


def read_checkpoint(folder: Path, *, device: str) -> dict[str, Any]:
    """Read what `write_checkpoint` wrote; nothing but plain data and tensors is taken.

    Raises:
        ConfigError: there is none, or it cannot be used.
    """
    import torch

    path = folder / FILE
    if not path.is_file():
        raise ConfigError(
            f"resume={folder}: there is no {FILE} in this folder.\n"
            "A training that came to its end keeps none; begin anew without resume."
        )
    try:
        with warnings.catch_warnings():
            # what is no checkpoint is refused below, in words of our own
            warnings.simplefilter("ignore")
            state: dict[str, Any] = torch.load(path, map_location=device, weights_only=True)
    except Exception as cause:  # torch lets errors of every kind through on damaged files
        words = " ".join(str(cause).split())
        raise ConfigError(
            f"{path} cannot be taken up: {words[:200]}\n"
            "It is damaged, or was not written by seals train; begin anew without resume."
        ) from cause
    if not isinstance(state, dict) or state.get("form") != FORM:
        raise ConfigError(
            f"{path} is of another version of seals.\nBegin the training anew without resume."
        )
    return state


def has_checkpoint(folder: Path) -> bool:
    """Return whether a training can be taken up."""
    return (folder / FILE).is_file()


def remove_checkpoint(folder: Path) -> None:
    """Remove the checkpoint of a training that is complete, or begins anew."""
    (folder / FILE).unlink(missing_ok=True)
