"""Start of Python child processes that never import code from the working directory."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

SAFE = "PYTHONSAFEPATH"
"""Environment variable by which Python 3.11 and later leave the working directory out."""
PATH = "PYTHONPATH"


def command(file: str | Path, *words: str) -> list[str]:
    """Return the command line that runs a file of the package in a child process.

    A file, because ``python -c`` and ``python -m`` look for modules in the working directory
    first, where a stranger's ``numpy.py`` may lie. Before Python 3.11 the file's own folder comes
    first instead: the file begins by taking it away from ``sys.path``.

    Args:
        file: to run, of this program or a plug-in.
        words: its arguments.
    """
    flags = ["-P"] if sys.version_info >= (3, 11) else []
    return [sys.executable, *flags, str(file), *words]


def environment() -> dict[str, str]:
    """Return environment variables for a child, without empty entries in ``PYTHONPATH``.

    Example:
        >>> environment()["PYTHONSAFEPATH"]
        '1'
    """
    found = {**os.environ, SAFE: "1"}
    entries = [entry for entry in found.get(PATH, "").split(os.pathsep) if entry]
    if entries:
        found[PATH] = os.pathsep.join(entries)
    else:
        found.pop(PATH, None)
    return found


def tried(file: str | Path, *words: str, seconds: float) -> tuple[int | None, str]:
    """Run a file of the package to see whether what it needs works here.

    A driver that does not may end its process, hence a child.

    Args:
        file: to run, see `command`.
        words: its arguments.
        seconds: longest time that it may take [s].

    Returns:
        Exit code, None where it took longer, and the last line that it said.
    """
    try:
        done = subprocess.run(
            command(file, *words),
            env=environment(),
            capture_output=True,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None, ""
    said = (done.stderr + done.stdout).decode(errors="replace").splitlines()
    return done.returncode, next((line.strip() for line in reversed(said) if line.strip()), "")


def protect_children(words: Sequence[str] | None) -> None:
    """Keep the working directory off the import path of every child process.

    Args:
        words: of the command line as a caller gave them; None for those of the process itself,
            which is then the program's own, and its environment with it.
    """
    if words is None:
        os.environ.setdefault(SAFE, "1")
