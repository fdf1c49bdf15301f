"""Devices of networks and batches: CPU or NVIDIA GPU, of one process or several of ``torchrun``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from seals.errors import ConfigError, suggestion

if TYPE_CHECKING:
    from torch import Tensor

DEVICES = ("cpu", "cuda")


def usable_device(name: str) -> str:
    """Return the requested device; refuse one that this machine lacks.

    Args:
        name: ``cpu`` or ``cuda``.

    Raises:
        ConfigError: it is none of these, or torch finds no card here.

    Example:
        >>> usable_device("cpu")
        'cpu'
    """
    import torch

    if name not in DEVICES:
        meant = "cuda" if "gpu" in name.lower() or name.startswith("cuda") else name
        hint = f"device={name} is not allowed.\n{suggestion(meant, DEVICES)}"
        which = "  The variable CUDA_VISIBLE_DEVICES selects the card." if ":" in name else ""
        raise ConfigError(hint + which)
    if name == "cuda" and not torch.cuda.is_available():
        raise ConfigError(
            "device=cuda: torch finds no CUDA device on this machine.\nWrite device=cpu"
        )
    if name == "cuda" and _processes() > 1:
        torch.cuda.set_device(int(os.environ["LOCAL_RANK"]))
    return name


def _processes() -> int:
    """Return how many processes learn together: those that ``torchrun`` began, else 1."""
    return int(os.environ.get("WORLD_SIZE", "1"))


def shared_gradients(loss: Any, device: str) -> Any:
    """Return a loss whose gradients are means over all processes, from the weights of the first.

    Args:
        loss: module that holds what is learned.
        device: where it lies.
    """
    if _processes() == 1:
        return loss
    from torch import distributed
    from torch.nn.parallel import DistributedDataParallel

    if not distributed.is_initialized():
        distributed.init_process_group("nccl" if device == "cuda" else "gloo")
    return DistributedDataParallel(loss)


def of_all_processes(rows: Tensor) -> Tensor:
    """Return the rows of all processes, as many of each, in the order of their ranks."""
    if _processes() == 1:
        return rows
    import torch
    from torch import distributed

    found = [torch.empty_like(rows) for _ in range(_processes())]
    distributed.all_gather(found, rows.contiguous())
    return torch.cat(found)


def largest_of_all(number: int) -> int:
    """Return the largest number that a process of those that learn one policy has."""
    return number if _processes() == 1 else int(_gathered([number]).max())


def alike_in_all(numbers: Sequence[int]) -> bool:
    """Return whether all processes that learn one policy have the same numbers."""
    rows = _gathered(numbers) if _processes() > 1 else None
    return rows is None or bool((rows == rows[0]).all())


def _gathered(numbers: Sequence[int]) -> Tensor:
    """Return a row of each process that learns the policy of this one, shape (processes, k)."""
    import torch
    from torch import distributed

    row = torch.tensor([list(numbers)])
    # other learners than those that share gradients learn a policy in each process
    if not distributed.is_initialized():
        return row
    return of_all_processes(row.cuda() if distributed.get_backend() == "nccl" else row)
