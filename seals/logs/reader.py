"""Protocol of readers: configured objects that turn files into logs."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol, runtime_checkable

from seals.logs.log import Log


@runtime_checkable
class Reader(Protocol):
    """Interface of a reader of one kind of file, which converts to SI, ENU and FLU."""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the logs of a source.

        Args:
            source: file or folder; None takes the reader's own ``path``, and for a published data
                set with no path, the published files.

        Raises:
            seals.errors.LogError: the source cannot be used.
        """
        ...
