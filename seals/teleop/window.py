"""Window of a session: top and side view of the robot, and the grip."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.control import Plant, RobotState
from seals.multibody.tree import forward

WIDTH, HEIGHT = 960, 520
PANEL, TOP = 470, 40
SPAN = 6.0
"""Width of what a panel shows [m]."""
EVERY = 0.04
"""Simulated time between two pictures [s]."""
TRAIL = 400
INK, PAPER, WATER = (30, 34, 40), (250, 250, 248), (205, 226, 240)
ROBOT, PATH = (200, 80, 30), (150, 160, 175)


class Window:
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
