"""Live output: streams the state of a run to other programs."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from seals.run.recorder import Moment, Recorder
from seals.run.settings import RunSettings
from seals.world import World


class LiveOutput(Protocol):
    """Interface of a live output: a keyword-only dataclass, opened once for each run."""

    def open(self, settings: RunSettings, folder: Path) -> None:
        """Prepare for a run, before its world stands.

        Args:
            settings: of the run; guides and controllers with ``tell`` take commands.
            folder: of the run, to write files into.

        Raises:
            SealsError: an address cannot be had, or a package is missing.
        """

    def tick(self, world: World) -> None:
        """Send the state of the world after a step, and receive incoming messages."""

    def close(self) -> None:
        """Release connections and files."""


class Pace:
    """Limit of the speed of a simulation against the clock.

    Args:
        speed: simulated seconds per second of real time, 0 for no limit.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._began: float | None = None

    def wait(self, now: float) -> None:
        """Sleep until the clock has reached the simulated time ``now`` [s]."""
        if self._speed <= 0.0:
            return
        clock = time.perf_counter() - now / self._speed
        if self._began is None:
            self._began = clock
        if clock < self._began:
            time.sleep(self._began - clock)


class Beat:
    """Instants of a rate in simulated time.

    Args:
        rate: [Hz].
    """

    def __init__(self, rate: float) -> None:
        self._every, self._next = 1.0 / rate, 0.0

    def due(self, now: float) -> bool:
        """Return whether an instant has come since the last one that had."""
        if now < self._next - 1e-9:
            return False
        self._next = max(self._next + self._every, now)
        return True


class _Sent(Recorder):
    """Recorder that hands a run on to a live output."""

    def __init__(self, output: LiveOutput) -> None:
        self._output = output

    def record(self, moment: Moment) -> None:
        self._output.tick(moment.world)


@contextmanager
def opened(
    output: LiveOutput | None, settings: RunSettings, folder: Path
) -> Iterator[list[Recorder]]:
    """Open the live output of a run, if any, and yield it as a list of recorders."""
    if output is None:
        yield []
        return
    output.open(settings, folder)
    try:
        yield [_Sent(output)]
    finally:
        output.close()
