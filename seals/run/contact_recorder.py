"""Notes when a robot touches anything: what a diagnosis has no laws for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from seals.state_records import fits
from seals.world.actor import Actor

GAP = 0.1
"""Time without contact below which two contacts count as one [s]: shorter than any use of it."""


class Contacts:
    """Times during which a robot presses on ground or on other bodies.

    Args:
        actor: the robot in its world.

    Attributes:
        spans: begin and end of every contact [s], in order.
    """

    def __init__(self, actor: Actor) -> None:
        """Start with no contact."""
        self._body = actor.body
        self.spans: list[tuple[float, float]] = []

    def take(self, before: float, time: float) -> None:
        """Note whether anything was touched in the step from ``before`` to ``time`` [s]."""
        if time <= before or not (self._body.contact_normals() > 0.0).any():
            return
        begin = before
        if self.spans and before - self.spans[-1][1] < GAP:
            begin = self.spans.pop()[0]
        self.spans.append((begin, time))

    def snapshot(self) -> list[tuple[float, float]]:
        """Return the contacts so far."""
        return list(self.spans)

    def restore(self, kept: Sequence[tuple[float, float]]) -> None:
        """Go on after the contacts of a snapshot.

        Raises:
            ValueError: they are none.
        """
        if not fits(kept, list[tuple[float, float]]):
            raise ValueError("its contacts are no list of begins and ends")
        self.spans = list(kept)

    def described(self) -> dict[str, Any]:
        """Return what ``meta.yaml`` says of them; nothing where nothing was touched."""
        return {"contacts": [list(span) for span in self.spans]} if self.spans else {}
