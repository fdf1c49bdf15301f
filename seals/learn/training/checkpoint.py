"""Checkpoints of a training: arrays and JSON, written atomically, read as data only.

Tensors of a state become records of arrays, and come back to a device.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.errors import ConfigError
from seals.logs.atomic import atomic_path
from seals.pytree import is_tensor
from seals.state_file import StateError, read_state, write_state
from seals.state_records import state_record


@state_record
class StoredTensor(NamedTuple):
    """A tensor of PyTorch as a NumPy array."""

    values: NDArray[Any]


def stored(state: Any) -> Any:
    """Return a state with tensors replaced by arrays, for `seals.state_file.write_state`.

    Args:
        state: nested mappings, lists and tuples of tensors, numbers, text and None.

    Raises:
        TypeError: a tensor is of a kind that NumPy does not know.
    """
    if is_tensor(state):
        return StoredTensor(state.detach().cpu().numpy())
    if isinstance(state, Mapping):
        return {key: stored(part) for key, part in state.items()}
    if isinstance(state, list):
        return [stored(part) for part in state]
    if isinstance(state, tuple) and not hasattr(state, "_fields"):
        # the shape of a tensor is a tuple, too
        return tuple(stored(part) for part in state)
    return state


def _tensors_of(state: Any, device: str) -> Any:
    """Return a state with stored arrays replaced by tensors.

    Args:
        state: that `stored` returned; its arrays are taken over.
        device: of the tensors.
    """
    import torch

    if isinstance(state, StoredTensor):
        return torch.from_numpy(np.asarray(state.values)).to(device)
    if isinstance(state, dict):
        return {key: _tensors_of(part, device) for key, part in state.items()}
    if isinstance(state, list | tuple):
        return type(state)(_tensors_of(part, device) for part in state)
    return state


FILE = "checkpoint.bin"
KIND = "training"


def write_checkpoint(folder: Path, state: dict[str, Any]) -> None:
    """Write a checkpoint of plain data and tensors, replacing an earlier one atomically.

    Args:
        folder: of the training.
        state: nested mappings and lists of tensors, numbers, text and None.

    Raises:
        ConfigError: a part of the state cannot be saved.
        DiskFull: there is no room; the earlier one stands.
    """
    try:
        with atomic_path(folder / FILE) as beside:
            write_state(beside, KIND, stored(state))
    except TypeError as cause:
        raise ConfigError(
            f"the state of this training cannot be saved: {cause}.\n"
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
            "A completed training has no checkpoint; start again without resume."
        )
    try:
        state = read_state(
            path, KIND, most=os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
        )
        if not isinstance(state, dict):
            raise StateError(f"it holds a {type(state).__name__}")
        found: dict[str, Any] = _tensors_of(state, device)
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
