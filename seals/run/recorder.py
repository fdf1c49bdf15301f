"""Interface of everything that records during a run, and the tables of those of the log."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from seals.arrays import Floats
from seals.world import World
from seals.world.history import History


class Moment(NamedTuple):
    """Instant of a run at which its recorders are called.

    Args:
        world: after a step, or at the start of the run.
        row: of the log that belongs to it, 0 at the start.
        before: time of the row before [s]; that of the start in row 0.
        snapshot: returns the rows of all recorders so far, for a checkpoint.
        history: of steps that were made at once, whose rows stand before this one; None for none.
    """

    world: World
    row: int
    before: float
    snapshot: Callable[[], Mapping[str, Any]]
    history: History | None = None

    @property
    def first(self) -> int:
        """Row of the first step since the last call: this one, without a history."""
        return self.row - (0 if self.history is None else len(self.history.times))


class Recorder(Protocol):
    """Interface of a recorder: rows of the log, pictures, meshes, checkpoints, a live view.

    A run calls ``restore`` when it resumes from a checkpoint, ``start`` before the first step,
    ``record`` after every step and ``close`` after the last one, however the run ended. Recorders
    of the log also record the start. A subclass needs ``record`` alone.

    Attributes:
        sparse: whether it may be called after several steps, the last one of them alone; else the
            run makes one step at a time.
    """

    sparse: ClassVar[bool] = False

    def start(self, world: World, folder: Path | None) -> None:
        """Prepare for the steps to come.

        Args:
            world: before its next step.
            folder: of the run; None if nothing is written to disk.

        Raises:
            SealsError: the run cannot start.
        """
        return None

    def record(self, moment: Moment) -> None:
        """Record an instant."""

    def snapshot(self) -> Any:
        """Return a copy or a view of what was recorded so far; None if nothing is kept."""
        return None

    def restore(self, kept: Any, rows: int, folder: Path) -> None:
        """Continue after a snapshot.

        Args:
            kept: what `snapshot` returned; None for recorders that are not part of a checkpoint.
            rows: of the log at that time.
            folder: of the run that took it.

        Raises:
            ValueError: the snapshot is of another run.
        """
        return None

    def close(self) -> None:
        """Write the files that are written once, at the end."""
        return None


class Rows:
    """Table of a recorder, reserved for a whole run.

    Args:
        names: of the columns.
        most: rows of the whole run; 0 where nothing is recorded.
        fill: value of entries that are not recorded.

    Attributes:
        values: shape (most, columns).
        count: rows so far.

    Example:
        >>> rows = Rows(["a", "b"], 3)
        >>> rows.values[0], rows.count = (1.0, 2.0), 1
        >>> rows.columns(1)["b"].tolist()
        [2.0]
    """

    def __init__(self, names: Sequence[str], most: int, *, fill: float = np.nan) -> None:
        self.names = list(names)
        self.values = np.full((most if self.names else 0, len(self.names)), fill)
        self.count = 0

    def snapshot(self) -> Floats:
        """Return the rows so far."""
        return self.values[: self.count]

    def restore(self, kept: Any, rows: int) -> None:
        """Continue after the rows of a snapshot.

        Raises:
            ValueError: they are of another run.
        """
        refill(self.values, kept, rows)
        self.count = rows

    def columns(self, rows: int) -> dict[str, Floats]:
        """Return the first ``rows`` rows as columns of a log; empty if nothing is recorded."""
        if not len(self.values):
            return {}
        table = self.values[:rows]
        return {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(self.names)}


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
        shape = kept.shape if isinstance(kept, np.ndarray) else type(kept).__name__
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
