"""Restoring of a recorder's rows from a checkpoint."""

from __future__ import annotations

from typing import Any

import numpy as np

from seals.arrays import Floats


def refill(table: Floats, kept: Any, rows: int) -> None:
    """Copy the first rows of a table from a checkpoint.

    Args:
        table: reserved for the run, shape (steps + 1, ...), or (0, ...) when nothing is recorded.
        kept: shape (rows, ...), or (0, ...).
        rows: recorded so far.

    Raises:
        ValueError: the rows are not of this table.

    Example:
        >>> table = np.zeros((3, 2))
        >>> refill(table, np.ones((2, 2)), 2)
        >>> table[:, 0].tolist()
        [1.0, 1.0, 0.0]
    """
    wanted = (min(rows, len(table)), *table.shape[1:])
    if not isinstance(kept, np.ndarray) or kept.shape != wanted or kept.dtype != table.dtype:
        shape = getattr(kept, "shape", type(kept).__name__)
        raise ValueError(f"recorded rows of shape {shape}; this run has {wanted}")
    table[: wanted[0]] = kept


def row_count(kept: Any, most: int) -> int:
    """Return a number of rows, checked against the length of the run.

    Raises:
        ValueError: it is none.
    """
    if type(kept) is not int or not 1 <= kept <= most:
        raise ValueError(f"{str(kept)[:40]} recorded rows; this run has 1 to {most}")
    return kept
