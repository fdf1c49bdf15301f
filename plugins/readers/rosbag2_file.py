"""Parser of rosbag2 recordings in SQLite or MCAP files."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path, PurePath
from typing import Any

from seals.errors import LogError
from seals.plugins.readers.mcap_file import MOST_BYTES
from seals.plugins.readers.mcap_file import messages as mcap_messages
from seals.plugins.readers.ros_streams import Message
from seals.untrusted_io import read_yaml, regular_file

Wants = Callable[[str, str, str], bool]
_MAGIC = b"SQLite format 3\0"
_STORAGES = (".db3", ".mcap")
_MOST_MESSAGE = 1 << 22
_MOST_FILES = 1000
# steps of SQLite's machine between two looks, and looks before a query is given up
_STEPS, _LOOKS = 1_000_000, 200
_TABLES = {
    "topics": {"id", "name", "type", "serialization_format"},
    "messages": {"topic_id", "timestamp", "data"},
}


def _storages(place: Path) -> list[Path]:
    """Return the files of a recording: those that its ``metadata.yaml`` names, or the one given.

    Raises:
        LogError: there is none, one lies elsewhere, or they are packed.
    """
    if not place.is_dir():
        if place.suffix not in _STORAGES:
            raise LogError(
                f"'{regular_file(place, most=MOST_BYTES)}' is not a rosbag2.\n"
                "Give its folder (with metadata.yaml), or a file .db3 or .mcap"
            )
        return [place]
    content = read_yaml(place / "metadata.yaml").get("rosbag2_bagfile_information")
    if not isinstance(content, dict):
        raise LogError(f"'{place / 'metadata.yaml'}' describes no rosbag2.")
    if str(content.get("compression_mode") or "none").lower() != "none":
        raise LogError(f"'{place}' is packed.\nUnpack it: ros2 bag convert")
    names = content.get("relative_file_paths")
    if not isinstance(names, list) or not names or len(names) > _MOST_FILES:
        raise LogError(f"'{place / 'metadata.yaml'}' names no files.")
    # early versions wrote paths from elsewhere: the last part is the file beside metadata.yaml
    files = [place / PurePath(str(name)).name for name in names]
    for file in files:
        if file.suffix not in _STORAGES or not file.resolve().is_relative_to(place.resolve()):
            raise LogError(
                f"'{place}': '{file.name}' is not a .db3 or .mcap file inside the folder."
            )
    return files


def messages(place: Path, wants: Wants, present: dict[str, str]) -> Iterator[Message]:
    """Yield the wanted messages of a rosbag2.

    Args:
        place: folder, or one file of it.
        wants: whether a topic counts, of its name, type and encoding.
        present: receives every topic and its type.

    Raises:
        LogError: a file is absent, damaged, or larger than allowed.
    """
    for file in _storages(place):
        if file.suffix == ".mcap":
            yield from mcap_messages(file, wants, present)
        else:
            yield from _database(regular_file(file, most=MOST_BYTES), wants, present)


def _database(file: Path, wants: Wants, present: dict[str, str]) -> Iterator[Message]:
    with file.open("rb") as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise LogError(f"'{file}' is not a rosbag2 file: it lacks the file signature.")
    try:
        with closing(_opened(file)) as base:
            _check_tables(base, file)
            topics: dict[int, tuple[str, str, str]] = {}
            for number, *words in base.execute(
                "SELECT id, name, type, serialization_format FROM topics LIMIT 4096"
            ):
                if not isinstance(number, int) or not all(isinstance(one, str) for one in words):
                    raise LogError(f"'{file}' is damaged: its table of topics holds no names.")
                topics[number] = (words[0], words[1], words[2])
                present[words[0]] = words[1]
            for number in [number for number, topic in topics.items() if wants(*topic)]:
                yield from _topic(base, number, topics[number], file)
    except (sqlite3.Error, UnicodeDecodeError, OverflowError) as error:
        raise LogError(
            f"'{file}' is not a valid rosbag2 file ({error}).\nCopy it again, or: ros2 bag reindex"
        ) from error


def _opened(file: Path) -> sqlite3.Connection:
    base = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
    base.text_factory = lambda raw: raw.decode("utf-8", errors="replace")
    looks = iter(range(_LOOKS))
    base.set_progress_handler(lambda: int(next(looks, None) is None), _STEPS)
    base.execute("PRAGMA trusted_schema = OFF")
    return base


def _check_tables(base: sqlite3.Connection, file: Path) -> None:
    """Refuse views and virtual tables in place of tables: a query of a view may never end."""
    kinds = dict(base.execute("SELECT name, type || ' ' || substr(sql, 1, 14) FROM sqlite_master"))
    for table, wanted in _TABLES.items():
        if not str(kinds.get(table, "")).upper().startswith("TABLE CREATE TABLE"):
            raise LogError(f"'{file}' holds no table '{table}': it is not a rosbag2.")
        columns: list[Any] = list(base.execute(f"PRAGMA table_xinfo({table})"))
        # the last number tells columns that are computed
        plain = {row[1] for row in columns if row[6] == 0}
        if not wanted <= plain:
            raise LogError(
                f"'{file}': the table '{table}' lacks {', '.join(sorted(wanted - plain))}."
            )


def _topic(
    base: sqlite3.Connection, number: int, topic: tuple[str, str, str], file: Path
) -> Iterator[Message]:
    query = (
        "SELECT timestamp, length(data), CASE WHEN length(data) <= ? THEN data END "
        "FROM messages WHERE topic_id = ?"
    )
    for stamp, size, data in base.execute(query, (_MOST_MESSAGE, number)):
        if not isinstance(stamp, int) or not isinstance(data, bytes):
            raise LogError(
                f"'{file}': a message of '{topic[0]}' has {size} bytes or no stamp, allowed are "
                f"{_MOST_MESSAGE:,} bytes."
            )
        yield Message(*topic, stamp, data)
