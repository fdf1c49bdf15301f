"""Pictures of an episode of a policy: a film, images, a window."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.config.build import build
from seals.errors import optional_import
from seals.learn.environments.batch_cameras import with_ball
from seals.learn.environments.build import build_learning
from seals.learn.environments.simulator import EpisodeFrame
from seals.learn.policy import Policy
from seals.learn.task import Task
from seals.rendering import NOTHING, Light, Poses, Renderer, Scene
from seals.rendering.optics import to_bytes
from seals.view.films.application import Shooting, photographer_of, shooting_of
from seals.view.films.files import Frames, refuse_missing, write_film
from seals.view.films.settings import RenderSettings
from seals.view.films.viewpoint import Way
from seals.view.replay import Replay, Track, continuous
from seals.view.stage import Stage, build_stage

FILM = "policy.mp4"
"""Film in the folder of a training or an evaluation."""
BALL = 0.6
"""Radius of the ball at the target, in distances within which it counts as reached [1]: large
enough to be seen, too small to hide a crab that stands there.
"""


class Episode(Replay):
    """Episode for rendering: poses over time, with a ball at the target.

    Args:
        stage: of its world.
        rows: one after the other in time.
    """

    def __init__(self, stage: Stage, rows: Sequence[EpisodeFrame]) -> None:
        """Concatenate the rows."""
        time = np.array([row.time for row in rows])
        tracks = {}
        for name in stage.robots:
            columns = zip(*(row.actors[name] for row in rows), strict=True)
            place, turn, joints = (np.array(column) for column in columns)
            tracks[name] = Track(place, continuous(turn), joints)
        # no run has left anything beside it: water is drawn from what is configured
        super().__init__(Path(), stage, time, tracks)
        self.target: Floats = np.array([row.target for row in rows])

    def poses(self, times: Floats | Sequence[float]) -> Poses:
        """Return the poses of all frames, see `Replay.poses`; the target is the last one."""
        found, at = super().poses(times), np.atleast_1d(np.asarray(times, dtype=float))
        ball = np.stack([np.interp(at, self.time, self.target[:, k]) for k in range(3)], axis=-1)
        upright = np.broadcast_to(np.eye(3), (len(at), 1, 3, 3))
        return Poses(
            np.concatenate([found.position, ball[:, None]], axis=1),
            np.concatenate([found.rotation, upright], axis=1),
        )

    @property
    def way(self) -> Way:
        """Return the region that a camera must show: all links, objects and the target."""
        places = np.asarray(self.poses(self.time).position).reshape(-1, 3)
        low, high = places.min(axis=0), places.max(axis=0)
        radius = 0.5 * float(np.linalg.norm(high - low))
        level = self.stage.settings.environment.water_level
        return Way(0.5 * (low + high), radius, level, reach=radius)


def refuse_unfilmed(config: Any) -> None:
    """Refuse a film that cannot be rendered, before the evaluation starts.

    Args:
        config: of the environment; its ``viewer`` draws.

    Raises:
        MissingExtra: the package that draws, or the one that writes films, is not installed.
        ConfigError: the viewer renders no frames.
    """
    refuse_missing()
    renderer = build(config.viewer, where="viewer")
    photographer_of(renderer)
    if isinstance(renderer, Renderer):
        renderer.open(Scene((), (NOTHING,), ()), Light())
        renderer.close()


def film(environment: Any, policy: Policy, seed: int, *, config: Any, path: Path) -> str:
    """Run a policy from one start and write a film of it.

    Args:
        environment: that tells whoever watches what stands where; all of it starts there.
        policy: acts without chance.
        seed: of the start.
        config: that the environment was made from.
        path: of the film, ``.mp4``.

    Returns:
        What was written, in words.

    Raises:
        SealsError: the film cannot be drawn or written.
    """
    settings, task = build_learning(config)
    episode = Episode(build_stage(settings), episode_frames(environment, policy, seed))
    look = RenderSettings()
    shooting = episode_shooting(episode, task, look, way=episode.way)
    photographer = photographer_of(settings.viewer)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="seals_film_") as folder:
        frames = Frames(Path(folder), {})
        try:
            shooting.draw(photographer, frames, look)
        finally:
            photographer.close()
        write_film(path, [frames.path(k) for k in range(len(shooting.times))], look.fps)
    return f"film: {path} ({len(shooting.times) / look.fps:.1f} s, start {seed})"


def episode_shooting(episode: Episode, task: Task, look: RenderSettings, *, way: Way) -> Shooting:
    """Prepare pictures of an episode, with a ball at the target.

    Args:
        episode: what is drawn.
        task: with the size of the target.
        look: of the pictures.
        way: what the camera is to see.
    """
    found = shooting_of(episode, look, way=way)
    if task.object:
        # an object that is the target shows where it is by itself
        return found
    return found._replace(scene=with_ball(found.scene, BALL * task.success_distance))


def episode_frames(environment: Any, policy: Policy, seed: int) -> list[EpisodeFrame]:
    """Return the frames of one episode."""
    seeds = [seed] * environment.count
    observation = environment.reset(seeds)
    policy.begin(seeds)
    rows: list[EpisodeFrame] = []
    environment.set_frame_callback(rows.append)
    try:
        ended = False
        while not ended:
            turn = environment.step(policy.act(observation))
            observation = turn.observation
            ended = bool(turn.terminated[0] | turn.truncated[0])
    finally:
        environment.set_frame_callback(None)
    return rows


ROOM = 1.3
"""Radius of what is in the picture, in that of robot and target at the start [1]."""


class Picture:
    """Images of one environment: robot, objects, target and water, from one place an episode.

    Args:
        config: of the environment; its ``viewer`` draws.

    Attributes:
        frame: the last one that the environments told; None before the first episode.

    Raises:
        SealsError: the viewer draws no frames, or its package is absent.
    """

    def __init__(self, config: Any) -> None:
        self._settings, self._task = build_learning(config)
        self._stage = build_stage(self._settings)
        self._photographer = photographer_of(self._settings.viewer)
        self._look = RenderSettings()
        self._shooting: Shooting | None = None
        self.frame: EpisodeFrame | None = None
        self._window: Any = None
        self._clock: Any = None

    def begin(self, environments: Any) -> None:
        """Place the camera for an episode, and follow what the environments tell of the first."""

        def follow(frame: EpisodeFrame) -> None:
            self.frame = frame

        # a callback is told at once what stands where
        environments.set_frame_callback(follow)
        first = self._shooting is None
        assert self.frame is not None
        episode = Episode(self._stage, [self.frame])
        way = episode.way._replace(radius=ROOM * episode.way.radius)
        self._shooting = found = episode_shooting(episode, self._task, self._look, way=way)
        if first:
            self._photographer.arrange(found.scene, found.optics, self._look.quality)

    def image(self, frame: EpisodeFrame | None = None) -> NDArray[np.uint8]:
        """Return the image of a frame, shape (height, width, 3); None for the last one told."""
        frame = self.frame if frame is None else frame
        assert self._shooting is not None
        assert frame is not None
        here = Episode(self._stage, [frame])
        now = self._shooting._replace(replay=here, times=here.time)
        light = self._photographer.photograph(now.frame_at(0, self._look.port))
        found: NDArray[np.uint8] = to_bytes(np.clip(self._look.light * light, 0.0, 1.0))
        return found

    def show(self) -> None:
        """Show the present instant in a window, no faster than the robot decides.

        Raises:
            MissingExtra: pygame is not installed.
        """
        with optional_import(
            'render_mode="human" needs pygame', "Install it: pip install 'aam-seals[learn]'"
        ):
            import pygame
        image = self.image()
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode((image.shape[1], image.shape[0]))
            self._clock = pygame.time.Clock()
        self._window.blit(pygame.surfarray.make_surface(image.swapaxes(0, 1)), (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._task.rate)

    def close(self) -> None:
        """Release renderer and window."""
        self._photographer.close()
        if self._window is not None:
            import pygame

            pygame.display.quit()
            self._window = None
