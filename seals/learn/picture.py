"""Rendering of the current state of a learning environment: images, or a window."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.errors import optional_import
from seals.learn.environments.build import build_learning
from seals.learn.environments.simulator import EpisodeFrame
from seals.learn.film import Episode, episode_shooting
from seals.rendering.optics import to_bytes
from seals.view.films.application import Shooting, photographer_of
from seals.view.films.settings import RenderSettings
from seals.view.stage import build_stage

ROOM = 1.3
"""Radius of what is in the picture, in that of robot and target at the start [1]."""


class Picture:
    """Images of one environment: robot, objects, target and water, from one place an episode.

    Args:
        config: of the environment; its ``viewer`` draws.

    Raises:
        SealsError: the viewer draws no frames, or its package is absent.
    """

    def __init__(self, config: Any) -> None:
        """Build what is to be drawn."""
        self._settings, self._task = build_learning(config)
        self._stage = build_stage(self._settings)
        self._photographer = photographer_of(self._settings.viewer)
        self._look = RenderSettings()
        self._shooting: Shooting | None = None
        self._window: Any = None
        self._clock: Any = None

    def begin(self, frame: EpisodeFrame) -> None:
        """Place the camera for an episode.

        Args:
            frame: at the start.
        """
        first = self._shooting is None
        episode = Episode(self._stage, [frame])
        way = episode.way._replace(radius=ROOM * episode.way.radius)
        self._shooting = found = episode_shooting(episode, self._task, self._look, way=way)
        if first:
            self._photographer.arrange(found.scene, found.optics, self._look.quality)

    def image(self, frame: EpisodeFrame) -> NDArray[np.uint8]:
        """Return the image of an instant, shape (height, width, 3)."""
        if self._shooting is None:
            self.begin(frame)
        assert self._shooting is not None
        here = Episode(self._stage, [frame])
        now = self._shooting._replace(replay=here, times=np.array([frame.time]))
        light = self._photographer.photograph(now.frame_at(0, self._look.port))
        found: NDArray[np.uint8] = to_bytes(np.clip(self._look.light * light, 0.0, 1.0))
        return found

    def show(self, frame: EpisodeFrame, rate: float) -> None:
        """Show an instant in a window, at most so many a second.

        Args:
            frame: the instant.
            rate: images a second [Hz].

        Raises:
            MissingExtra: pygame is not installed.
        """
        with optional_import(
            'render_mode="human" needs pygame', "Install it: pip install 'aam-seals[learn]'"
        ):
            import pygame
        image = self.image(frame)
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((image.shape[1], image.shape[0]))
            self._clock = pygame.time.Clock()
        self._window.blit(pygame.surfarray.make_surface(image.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(rate)

    def close(self) -> None:
        """Release renderer and window."""
        self._photographer.close()
        if self._window is not None:
            import pygame

            pygame.display.quit()
            self._window = None
