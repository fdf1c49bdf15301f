"""Trial of native code in a forked process, which a crash may end."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable

PATIENCE = 20
"""Longest try [s]."""


def survived(attempt: Callable[[], object]) -> bool:
    """Return whether a call returns without crash or hang in a copy of this process.

    It keeps crashes and hangs of native code away from this process; it is no wall against code
    that was written to take over the copy. Where processes cannot be forked the answer is yes.

    Example:
        >>> survived(lambda: None), survived(lambda: os.kill(os.getpid(), signal.SIGSEGV))
        (True, False)
    """
    if not hasattr(os, "fork"):
        return True
    child = os.fork()
    if child == 0:
        code = 1
        try:
            _quiet()
            attempt()
            code = 0
        finally:
            # nothing of the parent's is closed, flushed or told
            os._exit(code)
    return os.waitpid(child, 0)[1] == 0


def _quiet() -> None:
    """Suppress output and core dumps, and limit the time."""
    import resource

    for name in (signal.SIGALRM, signal.SIGSEGV, signal.SIGABRT, signal.SIGTERM):
        signal.signal(name, signal.SIG_DFL)
    signal.alarm(PATIENCE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
