"""Keyboard and gamepad input in real time, with a window that shows the robot."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from seals.control import Plant, RobotState
from seals.control.key_events import Event
from seals.control.keymap import CONTROLS
from seals.errors import ConfigError, optional_import

DEAD = 0.08
"""Share of an axis that counts as nothing: sticks do not return exactly [1]."""
GRAIN = 0.02
"""Change of an axis that makes an event [1]."""
NAP = 0.004
"""Longest sleep between two looks at the keys [s]."""


class Person:
    """Keyboard or gamepad through pygame, paced by the wall clock.

    Args:
        device: ``keyboard`` or ``joystick``.
        speed: simulated seconds in one second of the clock.
        plant: the robot, for the window.

    Attributes:
        recorded: all events so far.

    Raises:
        MissingExtra: pygame-ce is not installed.
        ConfigError: there is no screen, or no gamepad.
    """

    def __init__(self, device: str, *, speed: float, plant: Plant) -> None:
        self._pygame = pygame_of()
        self._heard: list[Event] = []
        self.recorded: Sequence[Event] = self._heard
        self.speed = speed
        self._pads = self._open(device)
        from seals.teleop.window import Window

        self._window = Window(self._pygame, plant)
        self._began: float | None = None
        self._last: dict[str, float] = {}

    def events(self, situation: RobotState) -> Sequence[Event]:
        """Wait until real time reaches the simulation time, and return all events."""
        now = situation.time
        if self._began is None:
            self._began = time.perf_counter() - now / self.speed
        due = self._began + now / self.speed
        self._take(now)
        while (left := due - time.perf_counter()) > 0.0:
            time.sleep(min(left, NAP))
            self._take(now)
        self._window.show(situation, self._last)
        return self.recorded

    def close(self) -> None:
        """Close the window."""
        self._pygame.quit()

    def _open(self, device: str) -> list[Any]:
        pygame = self._pygame
        try:
            # not pygame.init(): it would look for loudspeakers
            pygame.display.init()
            pygame.font.init()
        except pygame.error as cause:
            raise ConfigError(
                f"device={device} needs a screen, and there is none: {cause}.\n"
                "Fly by a script instead: seals teleop script=keys.csv"
            ) from cause
        if device != "joystick":
            return []
        pygame.joystick.init()
        pads = [pygame.joystick.Joystick(k) for k in range(pygame.joystick.get_count())]
        if not pads:
            pygame.quit()
            raise ConfigError("device=joystick: none is plugged in.\nUse device=keyboard.")
        return pads

    def _take(self, now: float) -> None:
        """Convert pygame's events to input events at the time ``now`` [s]."""
        pygame = self._pygame
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self._tell(now, "escape", 1.0)
            elif event.type in (pygame.KEYDOWN, pygame.KEYUP):
                name = pygame.key.name(event.key)
                if name in CONTROLS:
                    self._tell(now, name, float(event.type == pygame.KEYDOWN))
            elif event.type in (pygame.JOYBUTTONDOWN, pygame.JOYBUTTONUP):
                self._tell(now, f"button_{event.button}", float(event.type == pygame.JOYBUTTONDOWN))
            elif event.type == pygame.JOYAXISMOTION:
                self._tell(now, f"axis_{event.axis}", settled(event.value))

    def _tell(self, now: float, control: str, value: float) -> None:
        last = self._last.get(control, 0.0)
        if value == last or (value and abs(value - last) < GRAIN):
            return
        self._last[control] = value
        self._heard.append(Event(now, control, value))


def settled(value: float) -> float:
    """Return the value of an axis without its dead zone, rounded to two digits.

    Example:
        >>> settled(0.05), settled(-1.0), settled(0.54)
        (0.0, -1.0, 0.5)
    """
    size = abs(value)
    if size <= DEAD:
        return 0.0
    share = round(min((size - DEAD) / (1.0 - DEAD), 1.0), 2)
    return share if value > 0.0 else -share


def pygame_of(importer: Callable[[str], Any] | None = None) -> Any:
    """Return the module pygame; raise a `MissingExtra` where it is missing.

    Raises:
        MissingExtra: it is not installed.
    """
    import importlib
    import os

    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    with optional_import(
        "keyboard and joystick need pygame-ce",
        "Install it: pip install 'aam-seals[teleop]'; or fly by a script: script=keys.csv",
    ):
        return (importer or importlib.import_module)("pygame")
