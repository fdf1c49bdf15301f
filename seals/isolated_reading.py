"""The one sandbox: a child process with limits, in which an untrusted file is read.

    python isolated_reading.py MODULE:FUNCTION FILE SECONDS BYTES CONTENT

Libraries in C for rich formats (HDF5, MATLAB) can crash or loop without end on a damaged file, and
not each time: what they do depends on what lies in the memory beside it. So they never see the file
in the process of the user, which takes the content from a file of arrays and JSON
(`seals.state_file`). Macros of robots run in a program of their own (`seals.robot.macros_child`)
with the same limits, see `run_bounded` and `bound`.
"""

from __future__ import annotations

import sys

if __name__ == "__main__" and sys.path and not getattr(sys.flags, "safe_path", False):
    # before Python 3.11 the folder of this file comes first, and its modules before the others
    del sys.path[0]

import contextlib
import functools
import importlib
import mmap
import os
import signal
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

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
    from seals.child_process import environment
    from seals.state_file import StateError, read_state

    size = Path(path).stat().st_size
    seconds, memory = SECONDS + size // BYTES_A_SECOND, MEMORY + UNPACKED * size
    with tempfile.TemporaryDirectory(prefix="seals-") as private:
        content = Path(private, "content")
        words = (reader, str(Path(path).resolve()), str(seconds), str(memory), str(content))
        done = run_bounded(
            __file__,
            words,
            env={**environment(), **_NO_FILTERS},
            patience=PATIENCE * seconds,
            refused=functools.partial(_refused, path),
        )
        if done.returncode == _NO_MEMORY:
            raise _refused(
                path, "it decompresses to more memory than is allowed for a file of its size"
            )
        if done.returncode:
            crash = f"its library crashes on it (code {done.returncode})"
            raise _refused(path, out_of_time(done.returncode, seconds) or crash)
        try:
            found = read_state(content, _KIND, most=MOST_BYTES)
        except StateError as cause:
            raise _refused(path, f"its reader returned nothing ({cause})") from cause
    if "content" not in found:
        # raise what a reader raised in the child
        from seals import errors

        kind = getattr(errors, found["error"], None)
        if isinstance(kind, type) and issubclass(kind, errors.SealsError):
            raise kind(found["message"])
        raise _refused(path, f"its library says {found['error']}: {found['message']}")
    return found["content"]


def run_bounded(
    program: str | Path,
    words: Sequence[str],
    *,
    env: Mapping[str, str],
    patience: float,
    refused: Callable[[str], Exception],
) -> subprocess.CompletedProcess[bytes]:
    """Run a program that bounds itself (`bound`), and return how it ended and what it printed.

    Args:
        program: file of Python.
        words: its arguments.
        env: its environment.
        patience: time on the clock at which it is ended [s].
        refused: makes the error of a program that took longer, of a reason in words.
    """
    from seals.child_process import command

    try:
        return subprocess.run(
            command(program, *words),
            env=dict(env),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=patience,
            check=False,
        )
    except subprocess.TimeoutExpired as cause:
        raise refused(f"it takes longer than {patience:g} s") from cause


def out_of_time(code: int, seconds: int) -> str:
    """Describe the end of a process by its limit of time; empty where it ended otherwise."""
    limit = (getattr(signal, "SIGXCPU", 0), signal.SIGKILL if os.name == "posix" else 0)
    return f"it takes longer than {seconds} s of processor time" if -code in limit else ""


def _refused(path: str | Path, why: str) -> Exception:
    from seals.errors import LogError

    return LogError(f"'{path}' cannot be read: {why}.\nThe file is damaged: use an intact copy.")


def bound(seconds: int, memory: int, *, written: int = 0) -> None:
    """Limit this process, and forbid writing; POSIX only.

    Args:
        seconds: of computing [s].
        memory: in all [byte].
        written: largest file that it may allow itself to write later [byte].
    """
    try:
        import resource
    except ImportError:
        return
    for what, soft, hard in (
        (resource.RLIMIT_AS, memory, memory),
        (resource.RLIMIT_CPU, seconds, seconds),
        (resource.RLIMIT_FSIZE, 0, written),
        (resource.RLIMIT_CORE, 0, 0),
    ):
        allowed = resource.getrlimit(what)[1]
        most = hard if allowed == resource.RLIM_INFINITY else min(hard, allowed)
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(what, (min(soft, most), most))


def _memory_in_use() -> int:
    """Return the size of this process [byte]; zero where the system does not tell."""
    used = Path("/proc/self/statm")
    return int(used.read_text().split()[0]) * mmap.PAGESIZE if used.exists() else 0


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

    bound(int(seconds), int(memory) + _memory_in_use(), written=MOST_BYTES)
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
