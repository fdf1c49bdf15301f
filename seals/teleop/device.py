"""Input devices of a stick: a script, a keyboard or a gamepad."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from seals.control import RobotState
from seals.control.key_events import Event


class Device(Protocol):
    """Interface of an input device that returns events in order of time.

    Attributes:
        recorded: all events so far.
    """

    recorded: Sequence[Event]

    def events(self, situation: RobotState) -> Sequence[Event]:
        """Return all events so far; a script also returns future ones.

        The list only ever grows at its end, by events that are not earlier than
        ``situation.time``.
        """

    def close(self) -> None:
        """Release windows and devices."""


class Script:
    """Input device that replays a script of events.

    Args:
        events: in the order of their time.

    Attributes:
        recorded: the same events.
    """

    def __init__(self, events: Sequence[Event]) -> None:
        self.recorded: Sequence[Event] = tuple(events)

    def events(self, situation: RobotState) -> Sequence[Event]:
        """Return all events."""
        return self.recorded

    def close(self) -> None:
        """Do nothing: there is no window."""
