"""Private cache folders for compiled code and tables.

What lies in such a folder is loaded and run: in a folder of a predictable name in the system's
temporary folder, another user of the machine may have put it there first.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import hashlib
import os
import shutil
import stat
import sys
import tempfile
from pathlib import Path

HOME = "XDG_CACHE_HOME"
TORCH = {"TORCHINDUCTOR_CACHE_DIR": "inductor", "TRITON_CACHE_DIR": "triton"}
"""Environment variables by which PyTorch's compiler is told where it keeps its results."""


_ROOM = 1 << 20
"""Room that a cache needs at least [byte]."""
MOST = 256 << 20
"""Room of the kept files of a folder; the ones unused for longest go first [byte]."""
_DIGEST = hashlib.sha256().digest_size


@functools.cache
def cache_folder(name: str) -> Path:
    """Return a cache folder that only the user can write to, creating it if needed.

    It lies in ``$XDG_CACHE_HOME/seals``, or ``~/.cache/seals``. Where that cannot be made, or is
    not the user's alone, a note says so and a fresh temporary folder takes its place, which goes
    with the process.

    Args:
        name: of the cache, a word.
    """
    try:
        return _private(_home() / "seals", name)
    except (OSError, RuntimeError) as cause:
        folder = tempfile.mkdtemp(prefix="seals-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        said = " ".join(str(cause).split())
        print(
            f"note: the cache '{name}' is used only by this process ({said}); "
            f"{HOME}=FOLDER names a folder for it",
            file=sys.stderr,
        )
        return Path(folder)


def use_private_compiler_cache() -> None:
    """Set PyTorch's compiler cache to a private folder, unless the user has set one.

    Called before a compiler starts: by default it takes ``/tmp/torchinductor_USER``.
    """
    for variable, name in TORCH.items():
        if not os.environ.get(variable):
            os.environ[variable] = str(cache_folder(name))


def kept(path: Path) -> bytes | None:
    """Return what `keep` wrote to a file; None if it is absent or changed.

    Code that a disk has damaged would be run: its SHA-256 stands before it.
    """
    try:
        if not path.is_file() or path.stat().st_size > MOST:
            return None
        found = path.read_bytes()
        os.utime(path)
    except OSError:
        return None
    digest, data = found[:_DIGEST], found[_DIGEST:]
    return data if hashlib.sha256(data).digest() == digest else None


def keep(path: Path, data: bytes) -> None:
    """Write a file that is whole or not there, and remove the oldest beside it beyond `MOST`.

    Raises:
        OSError: the disk takes nothing.
    """
    number, name = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(number, "wb") as file:
            file.write(hashlib.sha256(data).digest() + data)
        Path(name).replace(path)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise
    _make_room(path)


def _make_room(newest: Path) -> None:
    """Remove the files beside one that were unused for longest, until what is left fits."""
    found = []
    for file in newest.parent.iterdir():
        with contextlib.suppress(OSError):  # another process was faster
            facts = file.stat()
            found.append((facts.st_mtime, facts.st_size, file))
    room = MOST
    for _, size, file in sorted(found, reverse=True):
        room -= size
        if room < 0 and file != newest:
            with contextlib.suppress(OSError):
                file.unlink()


def _home() -> Path:
    given = os.environ.get(HOME, "")
    # the standard has relative paths ignored: they would lie in the working directory
    return Path(given) if os.path.isabs(given) else Path.home() / ".cache"


def _private(base: Path, name: str) -> Path:
    """Make a folder below another, each the user's alone.

    Raises:
        OSError: it cannot be made, is a link, or another's, or others could put something into it.
    """
    base.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    above = base.parent.stat().st_mode
    if above & stat.S_IWOTH and not above & stat.S_ISVTX:
        raise PermissionError(f"all users can rename files in {base.parent}")
    for folder in (base, base / name):
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if not stat.S_ISDIR(found.st_mode):
            raise NotADirectoryError(f"{folder} is a link or a file")
        if hasattr(os, "getuid") and found.st_uid != os.getuid():
            raise PermissionError(f"{folder} belongs to another user")
        if (
            found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
            and folder != base
            and any(folder.iterdir())
        ):
            raise PermissionError(f"other users could write to {folder}; remove it")
        if stat.S_IMODE(found.st_mode) & 0o077:
            folder.chmod(0o700)
    if not os.access(base / name, os.W_OK | os.X_OK):
        raise PermissionError(f"{base / name} cannot be written to")
    with tempfile.TemporaryFile(dir=base / name) as file:
        # a disk that is read-only or full says so here, and not to a compiler
        file.write(bytes(_ROOM))
    return base / name
