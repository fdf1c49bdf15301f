"""Protocol of readers, and choice of a reader by the content of a file or folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol, runtime_checkable

from seals import registry
from seals.errors import BrokenPlugin, ConfigError, SealsError
from seals.file_names import RECORDINGS
from seals.logs.content import reader_by_content
from seals.logs.log import Log
from seals.logs.native import TABLES


@runtime_checkable
class Reader(Protocol):
    """Interface of a reader of one kind of file, which converts to SI, ENU and FLU.

    A reader of another package may have a static method ``recognises(start) -> bool`` as well,
    which tells by the first 4,096 bytes of a file, unpacked, whether it is of its kind: the file is
    then read without ``reader=``.
    """

    def read(self, source: str | Path | None = None) -> list[Log]:
        """Return the logs of a source.

        Args:
            source: file or folder; None takes the reader's own ``path``, and for a published data
                set with no path, the published files.

        Raises:
            seals.errors.LogError: the source cannot be used.
        """


def logs_by(reader: Reader, source: str | Path | None) -> list[Log]:
    """Return what a reader reads from a source.

    Raises:
        LogError: the source cannot be used.
        BrokenPlugin: the reader returns anything but logs.
    """
    found = reader.read(source)
    odd = [one for one in found if not isinstance(one, Log)] if isinstance(found, list) else [found]
    if odd:
        own = type(reader)
        raise BrokenPlugin(
            f"reader {own.__module__}:{own.__qualname__} returns a {type(odd[0]).__name__}, not "
            "logs.\nIts read() must return a list of seals.logs.Log: use another reader."
        )
    return found


def foreign_reader_of(place: Path) -> str | None:
    """Return the reader for a log of another program, by its content; None where it does not tell.

    Raises:
        LogError: it is of a kind that no reader takes; the next step is said.
    """
    if place.is_dir():
        return "rosbag2" if (place / "metadata.yaml").is_file() else None
    suffix = Path(place.stem).suffix if place.suffix == ".gz" else place.suffix
    # a damaged file goes by its ending
    return reader_by_content(place, _recognising()) or RECORDINGS.get(suffix.lower())


def _recognising() -> dict[str, Callable[[bytes], bool]]:
    """Return the tests of first bytes by which readers of other packages know their files."""
    readers, found = registry.plugins("reader"), {}
    for name, plugin in readers.items():
        if plugin.distribution == readers["native"].distribution:
            continue
        try:
            reader = plugin.load()
        except SealsError:
            # a broken package hinders no other reader; seals doctor tells it
            continue
        if hasattr(reader, "recognises"):
            found[name] = reader.recognises
    return found


def reader_of(place: Path) -> str:
    """Return the reader for a path: ``native`` for folders and log tables, else by content.

    Raises:
        ConfigError: the content does not tell how to read it.
        LogError: it is of a kind that no reader takes; the next step is said.
    """
    native = place.name in TABLES or (place.is_dir() and not (place / "metadata.yaml").is_file())
    found = "native" if native else foreign_reader_of(place)
    if found is None:
        raise ConfigError(
            f"'{place}': its content does not show which reader to use.\n"
            "Name the reader, for instance reader='csv'. See: seals list reader"
        )
    return found
