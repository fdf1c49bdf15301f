"""A progress bar with the time left, for people at a terminal who wait longer than a second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

QUIET_SECONDS = 1.0
"""Runs shorter than this show no bar."""
_EVERY = 32
"""Steps between two looks at the clock."""


@contextmanager
def progress(label: str, total: int) -> Iterator[Callable[[int], None]]:
    """Yield a function that takes the number of steps done.

    Args:
        label: what is going on.
        total: number of steps.
    """
    bar = _Bar(label, total)
    try:
        yield bar.tell if sys.stderr.isatty() else _nothing
    finally:
        bar.close()


def _nothing(done: int) -> None:
    """Show nothing: nobody watches."""


class _Bar:
    """A bar that appears only when the run turns out to be long."""

    def __init__(self, label: str, total: int) -> None:
        self.label, self.total = label, total
        self._start = time.perf_counter()
        self._bar: Any = None
        self._task: Any = None

    def tell(self, done: int) -> None:
        """Show how far the run is; cheap enough to be called every step."""
        if done % _EVERY and done < self.total:
            return
        if self._bar is None:
            if time.perf_counter() - self._start < QUIET_SECONDS:
                return
            self._open()
        self._bar.update(self._task, completed=done)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TimeRemainingColumn

        console = Console(stderr=True)
        left = TimeRemainingColumn()
        # it goes when the run is done: the last lines are the result
        self._bar = Progress(
            "{task.description}",
            BarColumn(),
            TaskProgressColumn(),
            left,
            console=console,
            transient=True,
        )
        self._task = self._bar.add_task(self.label, total=self.total)
        self._bar.start()

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()
