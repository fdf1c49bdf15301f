"""Recorder of contact times, which a diagnosis excludes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from seals.run.recorder import Moment, Recorder
from seals.state_records import fits
from seals.world.actor import Actor

GAP = 0.1
"""Time without contact below which two contacts count as one [s]: shorter than any use of it."""


class Contacts(Recorder):
    """Recorder of the times at which a robot touches ground or other bodies.

    Args:
        actor: the robot in its world.

    Attributes:
        spans: begin and end of every contact [s], in order.
    """

    def __init__(self, actor: Actor) -> None:
        """Start with no contact."""
        self._body = actor.body
        self.spans: list[tuple[float, float]] = []

    def record(self, moment: Moment) -> None:
        """Record whether anything was touched since the row before."""
        before, time = moment.before, moment.world.time
        if time <= before or not (self._body.contact_normals() > 0.0).any():
            return
        begin = before
        if self.spans and before - self.spans[-1][1] < GAP:
            begin = self.spans.pop()[0]
        self.spans.append((begin, time))

    def snapshot(self) -> list[tuple[float, float]]:
        """Return the contacts so far."""
        return list(self.spans)

    def restore(self, kept: Sequence[tuple[float, float]], rows: int, folder: Path) -> None:
        """Continue after the contacts of a snapshot."""
        if not fits(kept, list[tuple[float, float]]):
            raise ValueError("its contacts are no list of begins and ends")
        self.spans = list(kept)

    def described(self) -> dict[str, Any]:
        """Return the entry of ``meta.yaml``; empty without contacts."""
        return {"contacts": [list(span) for span in self.spans]} if self.spans else {}
