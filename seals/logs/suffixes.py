"""Choice of a reader from the name of a log file or the content of a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from seals.errors import ConfigError
from seals.logs.native import TABLES

BY_SUFFIX: Mapping[str, str] = {".ulg": "ulog", ".mcap": "mcap", ".db3": "rosbag2"}
"""Reader by suffix of a file; ``.gz`` after it is ignored."""


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
