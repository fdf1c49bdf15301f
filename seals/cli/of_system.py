"""Explanation of errors of the operating system: room, memory, rights, names, failing disks."""

from __future__ import annotations

import errno
import os

from seals.errors import BrokenPlugin, ConfigError, DiskFull, MissingExtra, OutOfMemory, SealsError

_NO_MEMORY = (
    "the memory of this machine, or the limit of this command, is exhausted.\n"
    "Nothing half-written was kept. Close other programs, or raise the limit (ulimit -v)."
)
_DENIED = {errno.EACCES, errno.EPERM, errno.EROFS}
_SHORT = (
    *("cannot allocate memory", "can't allocate memory", "failed to map segment", "bad_alloc"),
    *("can't start new thread", "unable to allocate", "not enough memory", "out of memory"),
)
"""What libraries say that have no error of their own for want of memory."""

_LOOP = "Symlink loop from "


def explained(error: BaseException) -> SealsError | None:
    """Return an error in words for one of the system; None for all others."""
    if isinstance(error, SealsError) and not isinstance(error, MissingExtra | BrokenPlugin):
        return None  # it has words of its own
    if _told_short(error):
        return OutOfMemory(_NO_MEMORY)
    try:
        # only here: it takes memory to import anything
        from seals.logs.room import told_full, words
    except (MemoryError, ImportError):  # the error came of that, whatever it says
        return OutOfMemory(_NO_MEMORY)

    if isinstance(error, OSError) and told_full(error):
        return DiskFull(words(error.filename))
    if isinstance(error, RuntimeError) and str(error).startswith(_LOOP):
        # looked up by `Path.resolve`, until Python 3.13
        name = str(error).removeprefix(_LOOP)
        return ConfigError(
            f"{name} is a link to itself.\nRemove the link, or name the file itself."
        )
    return _of_file(error) if isinstance(error, OSError) else None


def _of_file(error: OSError) -> ConfigError | None:
    """Explain an error about one file."""
    place = f"'{error.filename}'" if error.filename else "a file"
    if error.errno == errno.ENAMETOOLONG:
        return ConfigError(f"the name '{str(error.filename)[-80:]}' is too long for a file.")
    if error.filename and error.errno in _DENIED:
        return ConfigError(
            f"{place} cannot be read or written: {error.strerror}.\n"
            "Choose another place, or change the permissions."
        )
    if error.errno in (errno.EIO, None):  # libraries leave the number out
        why = os.strerror(errno.EIO) if error.errno else str(error).rstrip(".")
        return ConfigError(
            f"{place} could not be read or written: {why}.\n"
            "The disk or its connection fails. Check it or choose another one, then repeat the "
            "command."
        )
    return None


def _told_short(error: BaseException) -> bool:
    """Return whether an error, or one of its causes, reports a want of memory.

    Example:
        >>> _told_short(MemoryError()), _told_short(ImportError("a.so: failed to map segment"))
        (True, True)
        >>> _told_short(ValueError("negative mass"))
        False
    """
    link: BaseException | None = error
    while link is not None:
        text = str(link).lower()
        numbered = isinstance(link, OSError) and link.errno == errno.ENOMEM
        if numbered or isinstance(link, MemoryError):
            return True
        if isinstance(link, ImportError | OSError | RuntimeError) and any(
            w in text for w in _SHORT
        ):
            return True
        link = link.__cause__ or link.__context__
    return False
