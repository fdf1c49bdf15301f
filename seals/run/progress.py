"""Progress display: a bar in a terminal, else one line per minute."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from seals.errors import printable
from seals.terminal import drawing

QUIET_SECONDS = 1.0
"""Runs shorter than this show no bar."""
LINE_SECONDS = 60.0
"""Time between two lines where no terminal is, in the log of a job for instance."""
WARM_UP = 1000
"""One in so many steps, the first ones, do not count for the pace."""
_EVERY = 32
"""Steps between two looks at the clock."""


@contextmanager
def progress(
    label: str, total: int, note: Callable[[], str] = str
) -> Iterator[Callable[[int], None]]:
    """Yield a function that takes the number of steps done."""
    bar = (_Bar if sys.stderr.isatty() else _Lines)(label, total, note)
    try:
        yield bar.tell
    finally:
        bar.close()


def spoken(seconds: float) -> str:
    """Format a duration in words.

    Example:
        >>> spoken(42.0), spoken(252.0), spoken(9000.0)
        ('42 s', '4.2 min', '2.5 h')
    """
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.1f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


class _Lines:
    """Progress lines at intervals, printed only for long runs."""

    def __init__(self, label: str, total: int, note: Callable[[], str]) -> None:
        self.label, self.total, self.note = label, total, note
        self._start = self._looked = self._told = time.perf_counter()
        self._first: int | None = None
        self._warm = 0

    def tell(self, done: int) -> None:
        """Report the number of steps done; cheap enough to be called every step."""
        now = time.perf_counter()
        if self._first is None:
            self._warm = done + self.total // WARM_UP
        if self._first is None or done <= self._warm:
            # neither what was done before nor first steps, which may compile, say the pace
            self._first, self._start = done, now
        if done % _EVERY and now - self._looked < QUIET_SECONDS:
            return
        self._looked = now
        fresh = done - self._first
        if now - self._told >= LINE_SECONDS and fresh > 0 and done < self.total:
            self._told = now
            left = (now - self._start) * (self.total - done) / fresh
            words = f"{self.label}: {done / self.total:.0%}, {spoken(left)} left  {self.note()}"
            print(words.rstrip(), file=sys.stderr, flush=True)

    def close(self) -> None:
        """Do nothing: printed lines stay."""


class _Bar:
    """Progress bar, shown only for long runs."""

    def __init__(self, label: str, total: int, note: Callable[[], str]) -> None:
        self.label, self.total, self.note = label, total, note
        self._start = self._told = time.perf_counter()
        self._bar: Any = None
        self._task: Any = None

    def tell(self, done: int) -> None:
        """Report the number of steps done; cheap enough to be called every step."""
        now = time.perf_counter()
        # a step of many particles takes long: then every one is worth a look
        if done % _EVERY and done < self.total and now - self._told < QUIET_SECONDS:
            return
        self._told = now
        if self._bar is None:
            if now - self._start < QUIET_SECONDS:
                return
            self._open()
        words = printable(f"{self.label}  {self.note()}".rstrip())
        self._bar.update(self._task, completed=done, description=words)

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeRemainingColumn,
        )

        console = Console(file=drawing(sys.stderr))
        left = TimeRemainingColumn()
        # it goes when the run is done: the last lines are the result
        self._bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            left,
            console=console,
            transient=True,
        )
        self._task = self._bar.add_task(printable(self.label), total=self.total)
        self._bar.start()

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.stop()
