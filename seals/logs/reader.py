"""Protocol of readers, and choice of a reader by the name of a file or content of a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol, runtime_checkable

from seals.errors import ConfigError
from seals.logs.log import Log
from seals.logs.native import TABLES

BY_SUFFIX: Mapping[str, str] = {".ulg": "ulog", ".mcap": "mcap", ".db3": "rosbag2"}
"""Reader by suffix of a file; ``.gz`` after it is ignored."""


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


def foreign_reader_of(place: Path) -> str | None:
    """Return the reader for a file of another program; None where its name does not decide."""
    suffix = Path(place.stem).suffix if place.suffix == ".gz" else place.suffix
    if (place / "metadata.yaml").is_file():
        return "rosbag2"
    return BY_SUFFIX.get(suffix)


def reader_of(place: Path) -> str:
    """Return the reader for a path: by suffix, else ``native`` for folders and log tables.

    Raises:
        ConfigError: the name of the file does not tell how to read it.
    """
    found = foreign_reader_of(place)
    if found is None and (place.is_dir() or place.name in TABLES):
        found = "native"
    if found is None:
        raise ConfigError(
            f"'{place}': its name does not show which reader to use.\n"
            "Name the reader, for instance reader='csv'. See: seals list reader"
        )
    return found
