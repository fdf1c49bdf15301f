"""Treat SIGTERM and SIGHUP like Ctrl-C, so that the results of a run so far are written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that end a command: of process managers, and of a terminal that is closed."""


@contextmanager
def stoppable() -> Iterator[None]:
    """Make the signals of `ENDING` raise KeyboardInterrupt inside the block; main thread only."""

    def stop(number: int, frame: Any) -> None:
        raise KeyboardInterrupt

    with handled(stop, ending()):
        yield


@contextmanager
def handled(
    handler: Callable[[int, Any], None], numbers: Iterable[signal.Signals]
) -> Iterator[None]:
    """Give signals to a handler inside the block; main thread only, elsewhere nothing changes.

    Args:
        handler: takes the number of the signal and the frame.
        numbers: of the signals.
    """
    main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, handler) for number in numbers if main}
    try:
        yield
    finally:
        for number, former in before.items():
            signal.signal(number, former)


def ending() -> list[signal.Signals]:
    """Return the signals of `ENDING` that are not ignored, as ``nohup`` ignores SIGHUP."""
    return [number for number in ENDING if signal.getsignal(number) is not signal.SIG_IGN]
