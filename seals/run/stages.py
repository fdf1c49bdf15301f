"""Recorder of the stages of a guide, and of its outcome."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.control.protocols import Goal
from seals.run.recorder import Moment, Recorder
from seals.state_records import fits
from seals.world.pilot import Pilot


class Stages(Recorder):
    """Recorder of the stages of a run by their start times.

    Args:
        pilot: guide and controller of the robot, or None.

    Attributes:
        starts: time [s] and name of every stage, in order.
    """

    def __init__(self, pilot: Pilot | None) -> None:
        """Start with no stage."""
        self._pilot = pilot
        self.starts: list[tuple[float, str]] = []

    def record(self, moment: Moment) -> None:
        """Record the present stage."""
        stage = "" if self._pilot is None else self._pilot.stage
        if stage and (not self.starts or self.starts[-1][1] != stage):
            self.starts.append((moment.world.time, stage))

    def snapshot(self) -> list[tuple[float, str]]:
        """Return the stages so far."""
        return list(self.starts)

    def restore(self, kept: Sequence[tuple[float, str]], rows: int, folder: Path) -> None:
        """Continue after the stages of a snapshot."""
        if not fits(kept, list[tuple[float, str]]):
            raise ValueError("its stages are no list of times and names")
        self.starts = list(kept)

    @property
    def outcome(self) -> bool | None:
        """Return True when the guide is done, False when it gave up, None otherwise."""
        return None if self._pilot is None else self._pilot.finished

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Places that the guide is to reach; empty without a guide."""
        return () if self._pilot is None else self._pilot.goals

    def described(self) -> dict[str, Any]:
        """Return the entry of ``meta.yaml``; empty without a guide."""
        if not self.starts:
            return {}
        rows = [{"time": time, "name": name} for time, name in self.starts]
        return {"guide": {"stages": rows, "outcome": self.outcome}}
