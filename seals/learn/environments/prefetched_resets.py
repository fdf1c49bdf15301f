"""Prefetched resets: initial states drawn in advance, picked on the accelerator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from seals.arrays import Array
from seals.batch.piloted import Flight

if TYPE_CHECKING:
    from torch import Generator, Tensor

PREFETCHED = 1 << 16
"""Starts drawn ahead; an episode begins at any of them with equal chance."""


class Starts(NamedTuple):
    """Store of initial states, one row each, from which episodes are reset.

    Args:
        state: fields of the bodies that differ from start to start, by name.
        drive: states of the drives [rad/s or N].
        goal: of the task's draw.
    """

    state: dict[str, Array]
    drive: Array
    goal: Array

    def chances(self, count: int, generator: Generator) -> Tensor:
        """Return uniform random numbers, one for each start to draw."""
        import torch

        return torch.rand(count, generator=generator, device=self.goal.device)

    def picked(self, flight: Flight, chance: Array) -> tuple[Flight, Array]:
        """Return states and goals with randomly drawn starts.

        Args:
            flight: at any start; what does not differ is taken from it.
            chance: from 0 to 1, 1 excluded, one for each row of the flight.
        """
        rows = (chance * self.goal.shape[0]).long()
        state = flight.state._replace(**{name: x[rows] for name, x in self.state.items()})
        return flight._replace(state=state, drive=self.drive[rows]), self.goal[rows]


def joined(parts: list[tuple[Any, Array, Array]], names: tuple[str, ...]) -> Starts:
    """Concatenate the starts of several batches.

    Args:
        parts: states, drives and goals.
        names: fields of the state that differ.
    """
    import torch

    state = {name: torch.cat([getattr(part[0], name) for part in parts]) for name in names}
    drive, goal = (torch.cat([part[k] for part in parts]) for k in (1, 2))
    return Starts(state, drive, goal)
