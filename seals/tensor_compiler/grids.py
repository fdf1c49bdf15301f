"""Grid of the entries of a tensor, each a column over the batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from torch import dtype

MOST = 256
"""Entries of the largest grid: a larger tensor stays whole."""
LONGEST = 15
"""Entries along the longest index of a grid: a loop over a longer one, such as the strips of a hull
or the points of a face, compiles in a third of the time of its entries and runs as fast."""


class Grid(NamedTuple):
    """Entries of a tensor.

    Args:
        entries: nodes of tensors of shape (B,) or without an index, or numbers that are the same in
            the whole batch; the index along the batch counts blocks of B rows.
        axis: index that runs along the batch; None where no one does.
        kind: type of the entries.
    """

    entries: NDArray[Any]
    axis: int | None
    kind: dtype

    def shape(self, batch: int) -> tuple[int, ...]:
        """Return the shape of the tensor."""
        return tuple(n * batch if k == self.axis else n for k, n in enumerate(self.entries.shape))


def along(shape: tuple[int, ...], batch: int) -> int | None:
    """Return the axis of a shape that runs along the batch, or None.

    Example:
        >>> along((3, 128), 64), along((3, 4), 64)
        (1, None)
    """
    return next((k for k, n in enumerate(shape) if n and n % batch == 0), None)


def blocks(shape: tuple[int, ...], axis: int | None, batch: int) -> tuple[int, ...]:
    """Return the shape of the grid of a tensor."""
    return tuple(n // batch if k == axis else n for k, n in enumerate(shape))


def splits(form: tuple[int, ...]) -> bool:
    """Return whether a tensor whose grid has this shape is taken apart.

    Example:
        >>> splits((1, 6, 6)), splits((1, 48, 3)), splits((17, 17))
        (True, False, False)
    """
    return int(np.prod(form)) <= MOST and max(form, default=0) <= LONGEST


def reshaped(grid: Grid, shape: tuple[int, ...], batch: int) -> Grid | None:
    """Return the grid reshaped; None where batch rows would mix.

    Example:
        >>> import numpy as np
        >>> grid = Grid(np.arange(6.0).reshape(1, 2, 3), 0, None)
        >>> reshaped(grid, (64, 6), 64).entries.tolist()
        [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]]
        >>> reshaped(grid, (128, 3), 64) is None
        True
    """
    if grid.axis is None:
        axis = along(shape, batch)
        return None if axis is not None else Grid(grid.entries.reshape(shape), None, grid.kind)
    before = int(np.prod(grid.entries.shape[: grid.axis + 1]))
    for axis, n in enumerate(shape):
        if n and n % batch == 0 and int(np.prod(shape[:axis])) * (n // batch) == before:
            return Grid(grid.entries.reshape(blocks(shape, axis, batch)), axis, grid.kind)
    return None


def broadcast(grids: list[Grid]) -> tuple[list[NDArray[Any]], int | None] | None:
    """Broadcast grids; return their entries side by side, and the batch axis.

    None where two run along the batch by different indices.
    """
    most = max(grid.entries.ndim for grid in grids)
    axes = {g.axis + most - g.entries.ndim for g in grids if g.axis is not None}
    if len(axes) > 1:
        return None
    return list(np.broadcast_arrays(*(g.entries for g in grids))), next(iter(axes), None)


def filled_with(shape: tuple[int, ...], make: Any) -> NDArray[Any]:
    """Return an array filled by a function of the index."""
    out = np.empty(shape, dtype=object)
    for index in np.ndindex(shape):
        out[index] = make(index)
    return out


def is_node(entry: Any) -> bool:
    """Return whether an entry may vary within the batch."""
    return not isinstance(entry, bool | int | float)
