"""Detection of a full disk, whichever library writes."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

from seals.errors import DiskFull, SealsError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""No space left, quota used up, file larger than the system allows."""
_NOTHING = 1 << 16
"""Room below which a writer that failed for no stated reason had none [byte]."""


@contextlib.contextmanager
def room(path: str | Path) -> Iterator[None]:
    """Convert errors of writers on a full disk inside the block to `DiskFull`.

    Some libraries raise an error without the system's number; the room left tells then.

    Raises:
        DiskFull: there was no room.
    """
    try:
        yield
    except SealsError:
        raise
    except Exception as cause:
        if told_full(cause) or _free(Path(path)) < _NOTHING:
            raise DiskFull(words(path)) from cause
        raise


def told_full(error: BaseException) -> bool:
    """Return whether an error, or one of its causes, reports a full disk."""
    link: BaseException | None = error
    while link is not None:
        if isinstance(link, OSError) and link.errno in FULL:
            return True
        link = link.__cause__ or link.__context__
    return False


def words(path: str | Path | None) -> str:
    """Return the text of the error.

    Args:
        path: what was being written, None where that is not known.
    """
    what = f" for {path}" if path else ""
    return (
        f"there is no space left on the disk{what}.\nFiles that were finished before are "
        "complete. Free some "
        "space, then continue: with resume=FOLDER if the command accepts it, otherwise with the "
        "same arguments."
    )


def _free(path: Path) -> int:
    """Disk space available to the user at a path [byte]."""
    place = path if path.is_dir() else path.parent
    try:
        found = os.statvfs(place)
    except (OSError, AttributeError):
        return _NOTHING  # no answer is no full disk
    return found.f_bavail * found.f_frsize
