"""Reading of an untrusted file in a child process, which contains crashes and hangs of a library.

    python isolated_reading.py MODULE:FUNCTION FILE SECONDS BYTES CONTENT

Libraries in C for rich formats (HDF5, MATLAB) can crash or loop without end on a damaged file, and
not each time: what they do depends on what lies in the memory beside it. So they never see the file
in the process of the user, which takes the content from a file of arrays and JSON
(`seals.state_file`).
"""

from __future__ import annotations

import sys

if __name__ == "__main__" and sys.path and not getattr(sys.flags, "safe_path", False):
    # before Python 3.11 the folder of this file comes first, and its modules before the others
    del sys.path[0]

import contextlib
import importlib
import os
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import Any, NoReturn

SECONDS, BYTES_A_SECOND = 5, 1 << 24
"""Time that reading one file may compute [s], with one more for each so many bytes."""
MEMORY, UNPACKED = 1 << 30, 40
"""Memory that reading one file may take [byte], with so many bytes more for each of its own."""
_NO_MEMORY = 3
"""Exit code of a process whose memory did not suffice."""
PATIENCE = 12.0
"""Multiple of it, on the clock, at which the child is ended: other programs may be at work."""
MOST_BYTES = 1 << 32
"""Largest content that a child may hand over [byte]."""
_KIND = "content of a foreign file"
_NO_FILTERS = {"HDF5_PLUGIN_PRELOAD": "::"}
"""Else HDF5 loads every library of a folder for a packing that it does not know."""


def read_isolated(reader: str, path: str | Path) -> Any:
    """Return the content of a file, read in a child process.

    Args:
        reader: ``module:function`` of the program, which takes the path and returns plain data:
            arrays, numbers, text, lists and mappings (`seals.state_tree`).
        path: of a stranger's file.

    Raises:
        SealsError: as the reader raised it.
        LogError: the process crashed, took too long or too much memory, or its library raised.
    """
    from seals.child_process import command, environment
    from seals.state_file import StateError, read_state

    size = Path(path).stat().st_size
    seconds, memory = SECONDS + size // BYTES_A_SECOND, MEMORY + UNPACKED * size
    with tempfile.TemporaryDirectory(prefix="seals-") as private:
        content = Path(private, "content")
        words = (reader, str(Path(path).resolve()), str(seconds), str(memory), str(content))
        try:
            done = subprocess.run(
                command(__file__, *words),
                env={**environment(), **_NO_FILTERS},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=PATIENCE * seconds,
                check=False,
            )
        except subprocess.TimeoutExpired as cause:
            raise _refused(path, f"it takes longer than {PATIENCE * seconds:g} s") from cause
        if done.returncode == _NO_MEMORY:
            raise _refused(path, "it unpacks to more memory than a file of its size may take")
        if done.returncode:
            raise _refused(path, _ended(done.returncode, seconds))
        try:
            found = read_state(content, _KIND, most=MOST_BYTES)
        except StateError as cause:
            raise _refused(path, f"its reader handed over nothing ({cause})") from cause
    if "content" not in found:
        _raise(path, found["error"], found["message"])
    return found["content"]


def _raise(path: str | Path, name: str, message: str) -> NoReturn:
    """Raise what a reader raised in the child."""
    from seals import errors

    kind = getattr(errors, name, None)
    if isinstance(kind, type) and issubclass(kind, errors.SealsError):
        raise kind(message)
    raise _refused(path, f"its library says {name}: {message}")


def _ended(code: int, seconds: int) -> str:
    """Describe in words how a process ended."""
    if -code in (getattr(signal, "SIGXCPU", 0), signal.SIGKILL if os.name == "posix" else 0):
        return f"it takes longer than {seconds} s of computing"
    return f"its library crashes on it (code {code})"


def _refused(path: str | Path, why: str) -> Exception:
    from seals.errors import LogError

    return LogError(f"'{path}' cannot be read: {why}.\nThe file is damaged: take a sound copy.")


def _bound(seconds: int, memory: int) -> None:
    """Limit time and memory, and forbid writing while the library reads; POSIX only."""
    try:
        import resource
    except ImportError:
        return
    used = Path("/proc/self/statm")
    pages = int(used.read_text().split()[0]) if used.exists() else 0
    memory += pages * resource.getpagesize()
    for what, soft, hard in (
        (resource.RLIMIT_AS, memory, memory),
        (resource.RLIMIT_CPU, seconds, seconds),
        (resource.RLIMIT_FSIZE, 0, MOST_BYTES),
        (resource.RLIMIT_CORE, 0, 0),
    ):
        allowed = resource.getrlimit(what)[1]
        most = hard if allowed == resource.RLIM_INFINITY else min(hard, allowed)
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(what, (min(soft, most), most))


def _allow_writing() -> None:
    """Permit writing of the content once the library is done."""
    try:
        import resource
    except ImportError:
        return
    with contextlib.suppress(ValueError, OSError):
        hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))


def main(reader: str, path: str, seconds: str, memory: str, content: str) -> None:
    """Program of the child process: read one file, write its content or the reader's error."""
    module, _, name = reader.partition(":")
    read = getattr(importlib.import_module(module), name)
    from seals.state_file import write_state

    _bound(int(seconds), int(memory))
    try:
        found = {"content": read(Path(path))}
    except MemoryError:
        sys.exit(_NO_MEMORY)
    except Exception as error:  # libraries let errors of every kind through on damaged files
        found = {"error": type(error).__name__, "message": str(error)[:2000]}
    _allow_writing()
    write_state(Path(content), _KIND, found)


if __name__ == "__main__":
    main(*sys.argv[1:])
