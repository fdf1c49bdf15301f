"""Seeds of training, validation and held-out evaluation, which never overlap, and of an agent.

Training uses seeds below `TRAINING_END`. Evaluations during training, on which a run may stop
early, use the seeds of :func:`validation_seeds`; the figures that are published use those of
:func:`held_out_seeds`. An agent has one generator for its draws and one for its initial weights.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

from seals.errors import SealsError

if TYPE_CHECKING:
    from torch import Generator


def generator_of(seed: int, device: str) -> Generator:
    """Return a generator on a device, seeded."""
    import torch

    return torch.Generator(device=device).manual_seed(seed)


@contextlib.contextmanager
def first_weights(seed: int) -> Iterator[None]:
    """Seed the weights initialised inside the block, without changing the global generator.

    They are made on the CPU and moved afterwards, so that a seed means the same on every device.
    """
    import torch

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        yield


TRAINING_END = 1_000_000_000
_HELD_OUT = 2_000_000_000
_MOST = 100_000_000


def validation_seeds(count: int) -> list[int]:
    """Return the seeds of the evaluations during training.

    Example:
        >>> validation_seeds(2)
        [1000000000, 1000000001]
    """
    return _range(TRAINING_END, count)


def held_out_seeds(count: int) -> list[int]:
    """Return the seeds of the held-out starts, never used in training or selection.

    Example:
        >>> held_out_seeds(2)
        [2000000000, 2000000001]
    """
    return _range(_HELD_OUT, count)


def training_seed(seed: int) -> int:
    """Return a seed that training may use.

    Raises:
        SealsError: it belongs to the starts that judge.
    """
    if not 0 <= seed < TRAINING_END:
        raise SealsError(
            f"seed={seed} is reserved for the evaluation of policies.\n"
            f"Allowed for training: 0 to {TRAINING_END - 1}"
        )
    return seed


def _range(first: int, count: int) -> list[int]:
    if not 1 <= count <= _MOST:
        raise SealsError(f"{count} starts are requested.\nAllowed: 1 to {_MOST}")
    return list(range(first, first + count))
