"""Trial of a reader in a child process, to refuse files that crash or hang a library.

    python reading_trial.py MODULE:FUNCTION FILE SECONDS

Libraries in C for rich formats (HDF5, MATLAB) can crash or loop without end on a damaged file; an
exception handler is of no help there.
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
from pathlib import Path

SECONDS, BYTES_A_SECOND = 5, 1 << 24
"""Time that reading one file may compute [s], with one more for each so many bytes."""
PATIENCE = 12.0
"""Multiple of it, on the clock, at which the trial is ended: other programs may be at work."""


def try_reading(reader: str, path: str | Path) -> None:
    """Read a file in a child process; raise an error when that process crashes or hangs.

    What the reader itself raises is no concern of the trial: it raises it again where it is called.

    Args:
        reader: ``module:function`` of the program, which takes the path.
        path: of a stranger's file.

    Raises:
        LogError: the process crashed or was ended for taking too long.
    """
    from seals.child_process import command, environment

    seconds = SECONDS + Path(path).stat().st_size // BYTES_A_SECOND
    try:
        done = subprocess.run(
            command(__file__, reader, str(Path(path).resolve()), str(seconds)),
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=PATIENCE * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as cause:
        raise _refused(path, f"it takes longer than {PATIENCE * seconds:g} s") from cause
    if done.returncode:
        raise _refused(path, _ended(done.returncode, seconds))


def _ended(code: int, seconds: int) -> str:
    """Return in words how a process ended."""
    if -code in (getattr(signal, "SIGXCPU", 0), signal.SIGKILL if os.name == "posix" else 0):
        return f"it takes longer than {seconds} s of computing"
    return f"its library crashes on it (code {code})"


def _refused(path: str | Path, why: str) -> Exception:
    from seals.errors import LogError

    return LogError(f"'{path}' cannot be read: {why}.\nThe file is damaged: take a sound copy.")


def _bound(seconds: int) -> None:
    """Bound the time, and let nothing be written, where the system can."""
    try:
        import resource
    except ImportError:
        return
    for what, most in (
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(what, (most, most))


def main(reader: str, path: str, seconds: str) -> None:
    """Program of the child process: read one file; an exception of the reader is a normal end."""
    module, _, name = reader.partition(":")
    read = getattr(importlib.import_module(module), name)
    _bound(int(seconds))
    with contextlib.suppress(Exception):
        read(Path(path))


if __name__ == "__main__":
    main(*sys.argv[1:])
