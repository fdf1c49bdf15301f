"""Conversion of tensors in a state to array records, and back to a device."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.pytree import is_tensor
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


def tensors_of(state: Any, device: str) -> Any:
    """Return a state with stored arrays replaced by tensors.

    Args:
        state: that `stored` returned; its arrays are taken over.
        device: of the tensors.
    """
    import torch

    if isinstance(state, StoredTensor):
        return torch.from_numpy(np.asarray(state.values)).to(device)
    if isinstance(state, dict):
        return {key: tensors_of(part, device) for key, part in state.items()}
    if isinstance(state, list | tuple):
        return type(state)(tensors_of(part, device) for part in state)
    return state
