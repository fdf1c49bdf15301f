"""Treat SIGTERM and SIGHUP like Ctrl-C, so that the results of a run so far are written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that end a command: of process managers, and of a terminal that is closed."""


@contextmanager
def stoppable() -> Iterator[None]:
    """Make the signals of `ENDING` raise KeyboardInterrupt inside the block; main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in ending()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ending() -> list[signal.Signals]:
    """Return the signals of `ENDING` that are not ignored, as ``nohup`` ignores SIGHUP."""
    return [number for number in ENDING if signal.getsignal(number) is not signal.SIG_IGN]
