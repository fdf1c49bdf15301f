"""Keyboard and gamepad input in real time, with a window that shows the robot."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, RobotState
from seals.control.key_events import CONTROLS, Event
from seals.errors import ConfigError, optional_import
from seals.multibody.tree import forward

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
        speed: simulated seconds per second of real time.
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
        self._window = _Window(self._pygame, plant)
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
                "Use a script instead: seals teleop script=keys.csv"
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
        "Install it: pip install 'aam-seals[teleop]'; or use a script: script=keys.csv",
    ):
        return (importer or importlib.import_module)("pygame")


WIDTH, HEIGHT = 960, 520
PANEL, TOP = 470, 40
SPAN = 6.0
"""Width of what a panel shows [m]."""
EVERY = 0.04
"""Simulated time between two pictures [s]."""
TRAIL = 400
INK, PAPER, WATER = (30, 34, 40), (250, 250, 248), (205, 226, 240)
ROBOT, PATH = (200, 80, 30), (150, 160, 175)


class _Window:
    """Two views that follow the robot, redrawn some 25 times a second.

    Args:
        pygame: the module, with its display open.
        plant: the robot.
    """

    def __init__(self, pygame: Any, plant: Plant) -> None:
        self._pygame, self._plant = pygame, plant
        self._screen = pygame.display.set_mode((WIDTH, HEIGHT))
        pygame.display.set_caption("seals teleop")
        self._font = pygame.font.Font(None, 22)
        self._trail: list[Floats] = []
        self._next = 0.0

    def show(self, situation: RobotState, held: Mapping[str, float]) -> None:
        """Draw the present state when a redraw is due."""
        if situation.time < self._next:
            return
        self._next = situation.time + EVERY
        self._trail = [*self._trail[-TRAIL:], situation.position.copy()]
        self._screen.fill(PAPER)
        # lines to draw: each link to its parent, and the drives, in the world [m]
        robot = self._plant.robot
        origins, _ = forward(
            robot.tree, situation.position[None], situation.rotation[None], situation.joints[None]
        )
        lines = [
            (origins[0, robot.tree.parent[k]], origins[0, k]) for k in range(1, robot.tree.links)
        ]
        hubs = situation.position + self._plant.layout.position @ situation.rotation.T
        nose = situation.position + 0.3 * situation.rotation[:, 0]
        points = [*lines, *((situation.position, hub) for hub in hubs), (situation.position, nose)]
        self._panel(situation, points, left=5, axes=(0, 1), name="from above (x right, y up)")
        self._panel(situation, points, left=485, axes=(0, 2), name="from the side (x right, z up)")
        x, y, z = situation.position
        speed = float(np.linalg.norm(situation.velocity))
        keys = " ".join(key for key, value in held.items() if value) or "-"
        text = (
            f"t {situation.time:6.1f} s   x {x:+.2f}  y {y:+.2f}  z {z:+.2f} m   {speed:.2f} m/s   "
            f"under water {situation.submersion:.0%}   held: {keys}   (escape ends)"
        )
        self._screen.blit(self._font.render(text, True, INK), (10, 12))
        self._pygame.display.flip()

    def _panel(
        self,
        situation: RobotState,
        lines: list[tuple[Floats, Floats]],
        *,
        left: int,
        axes: tuple[int, int],
        name: str,
    ) -> None:
        """One view: grid of metres, water, trail and robot."""
        draw = self._pygame.draw
        frame = self._pygame.Rect(left, TOP, PANEL, PANEL)
        scale = PANEL / SPAN
        middle = np.round(situation.position * 2.0) / 2.0

        def at(point: Floats) -> tuple[int, int]:
            x, y = point[axes[0]] - middle[axes[0]], point[axes[1]] - middle[axes[1]]
            return (round(frame.centerx + scale * x), round(frame.centery - scale * y))

        self._screen.set_clip(frame)
        level = self._plant.environment.water_level
        if level is not None and axes[1] == 2:
            surface = at(np.array([0.0, 0.0, level]))[1]
            top = max(surface, frame.top)
            draw.rect(self._screen, WATER, (frame.left, top, PANEL, max(frame.bottom - top, 0)))
        for k in range(-math.ceil(SPAN), math.ceil(SPAN) + 1):
            x, y = at(np.floor(middle) + k)
            draw.line(self._screen, (225, 228, 230), (x, frame.top), (x, frame.bottom))
            draw.line(self._screen, (225, 228, 230), (frame.left, y), (frame.right, y))
        if len(self._trail) > 1:
            draw.lines(self._screen, PATH, False, [at(p) for p in self._trail])
        for start, end in lines:
            draw.line(self._screen, ROBOT, at(start), at(end), 3)
        draw.circle(self._screen, ROBOT, at(situation.position), 5)
        self._screen.set_clip(None)
        draw.rect(self._screen, INK, frame, 1)
        self._screen.blit(self._font.render(name, True, INK), (left + 8, TOP + 6))
