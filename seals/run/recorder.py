"""Interface of everything that records during a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from seals.world import World


class Moment(NamedTuple):
    """Instant of a run at which its recorders are called.

    Args:
        world: after a step, or at the start of the run.
        row: of the log that belongs to it, 0 at the start.
        before: time of the row before [s]; that of the start in row 0.
        snapshot: returns the rows of all recorders so far, for a checkpoint.
    """

    world: World
    row: int
    before: float
    snapshot: Callable[[], Mapping[str, Any]]


class Recorder(Protocol):
    """Interface of a recorder: rows of the log, pictures, meshes, checkpoints, a live view.

    A run calls ``restore`` when it resumes from a checkpoint, ``start`` before the first step,
    ``record`` after every step and ``close`` after the last one, however the run ended. Recorders
    of the log also record the start. A subclass needs ``record`` alone.
    """

    def start(self, world: World, folder: Path | None) -> None:
        """Prepare for the steps to come.

        Args:
            world: before its next step.
            folder: of the run; None where nothing is written to disk.

        Raises:
            SealsError: the run cannot start.
        """
        return None

    def record(self, moment: Moment) -> None:
        """Record an instant."""
        ...

    def snapshot(self) -> Any:
        """Return a copy or a view of what was recorded so far; None where nothing is kept."""
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
        """Write what is written once, at the end."""
        return None
