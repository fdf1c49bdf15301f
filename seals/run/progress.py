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
def progress(
    label: str, total: int, note: Callable[[], str] = str
) -> Iterator[Callable[[int], None]]:
    """Yield a function that takes the number of steps done.

    Args:
        label: what is going on.
        total: number of steps.
        note: further words about the present.
    """
    bar = _Bar(label, total, note)
    try:
        yield bar.tell if sys.stderr.isatty() else _nothing
    finally:
        bar.close()


def _nothing(done: int) -> None:
    """Show nothing: nobody watches."""


class _Bar:
    """A bar that appears only when the run turns out to be long."""

    def __init__(self, label: str, total: int, note: Callable[[], str]) -> None:
        self.label, self.total, self.note = label, total, note
        self._start = self._told = time.perf_counter()
        self._bar: Any = None
        self._task: Any = None

    def tell(self, done: int) -> None:
        """Show how far the run is; cheap enough to be called every step."""
        now = time.perf_counter()
        # a step of many particles takes long: then every one is worth a look
        if done % _EVERY and done < self.total and now - self._told < QUIET_SECONDS:
            return
        self._told = now
        if self._bar is None:
            if now - self._start < QUIET_SECONDS:
                return
            self._open()
        words = f"{self.label}  {self.note()}".rstrip()
        self._bar.update(self._task, completed=done, description=words)

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
