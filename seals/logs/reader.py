"""Protocol of readers: configured objects that turn files into logs."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol, runtime_checkable

from seals.logs.log import Log


@runtime_checkable
class Reader(Protocol):
    """Turns one kind of file into logs; conversion to SI, ENU and FLU happens here only."""

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the logs of a source.

        Args:
            source: file or folder; None takes the reader's own ``path``, and for a published data
                set with no path, the published files.

        Raises:
            seals.errors.LogError: the source cannot be used.
        """
        ...
