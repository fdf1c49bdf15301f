"""Random number generators of an agent: its draws, and its initial weights."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

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
