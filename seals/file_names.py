"""Names that become part of a path, of runs, manoeuvres, logs, instances; endings of recordings.

A name comes from a file of anybody. What is chosen by it is one entry of one folder, and never a
place elsewhere.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path

from seals.errors import ConfigError

RECORDINGS: Mapping[str, str] = {
    ".ulg": "ulog",
    ".mcap": "mcap",
    ".db3": "rosbag2",
    ".bag": "rosbag1",
    ".tlog": "tlog",
    ".mat": "matlab",
}
"""Endings that only recordings have, with their readers; ``.gz`` may follow."""
DIAGNOSIS, REPORT = "diagnosis.json", "report.html"
"""Answer of a diagnosis, and the page beside the results of a command."""
_STRANGE = re.compile(r"[^\w.-]+")
_REFUSED = frozenset('/\\:*?"<>|\0')
_MOST = 120
"""Longest name [sign]: a folder's name may have 255 bytes, and time and endings go with it."""


def file_name(text: str) -> str:
    """Return any text as a name in a folder: other signs than letters, digits and ``_.-`` go.

    Example:
        >>> file_name("x/../../VICTIM"), file_name("..")
        ('x_.._.._VICTIM', '_')
    """
    plain = _STRANGE.sub("_", text).lstrip(".")[:_MOST]
    return plain or "_"


def checked_name(text: str, *, key: str) -> str:
    """Return a name that can be part of a folder's name.

    Args:
        text: the name.
        key: that it is the value of, for the message.

    Raises:
        ConfigError: it is empty or too long, starts with a dot, or holds a sign that no name of a
            file has.

    Example:
        >>> checked_name("drop_test", key="name")
        'drop_test'
    """
    if (
        not text
        or len(text) > _MOST
        or _REFUSED & set(text)
        or text.startswith((".", "-"))
        or not text.isprintable()
    ):
        raise ConfigError(
            f"{key}={text:.80} cannot be part of a folder's name.\n"
            "Allowed: letters, digits, '_', '-' and '.'; it may not begin with '-' or '.'."
        )
    return text


def refuse_taken(place: str | Path, *, key: str = "", replace: bool | None = None) -> None:
    """Refuse to write over a file, folder or link that exists.

    Args:
        place: to be written.
        key: that it is the value of; empty where it is made of something else.
        replace: whether it may be written over; None where nothing can allow that.

    Raises:
        ConfigError: it exists and stays.
    """
    if os.path.lexists(place) and not replace:
        way = "move it away" if replace is None else "add replace=true"
        name = f"{key}={place}" if key else f"'{place}'"
        raise ConfigError(f"{name} exists already.\nChoose another name, or {way}.")


def short_path(path: Path) -> Path:
    """Return a path relative to the working directory, where it lies below it."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
