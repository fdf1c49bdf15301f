"""Random numbers of an agent: one generator for its draws, one seed for its first weights."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Generator, Tensor


def generator_of(seed: int, device: str) -> Generator:
    """Return a generator on a device, seeded."""
    import torch

    return torch.Generator(device=device).manual_seed(seed)


@contextlib.contextmanager
def first_weights(seed: int) -> Iterator[None]:
    """Make networks inside the block from a seed, and leave the global generator as it was.

    They are made on the CPU and moved afterwards, so that a seed means the same on every device.
    """
    import torch

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        yield


def kept(generator: Generator) -> Tensor:
    """Return the state of a generator."""
    return generator.get_state().clone()


def put_back(generator: Generator, state: Tensor) -> None:
    """Set the state of a generator; it lies on the CPU whatever the device."""
    generator.set_state(state.cpu())
