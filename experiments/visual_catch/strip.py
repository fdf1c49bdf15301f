"""Strip and film of what both cameras see in a flight, with the place that the policy is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seals.arrays import Floats
from seals.errors import ConfigError
from seals.learn.starts import held_out_seeds
from seals.learn.task import SeeingTask
from seals.plugins.tasks.sighting.detector import shot_of
from seals.rendering.optics import to_bytes
from seals.report.pictures import figure_class

USUAL = {"env": "catch_seen", "backend": "mujoco"}
"""Words of the environment where none are given."""
INSTANTS = 8
"""Pairs of pictures in a strip."""
ENLARGED = 2
"""Pixels of the film along an edge of one of a camera."""
BRIGHTER = 1.6
"""Factor for what is drawn: under water the pictures that the policy is given are dark [1]."""
RING = 12
"""Radius of the ring about the place [pixel of the film]."""


class _Glance(NamedTuple):
    """What is seen at one instant.

    Args:
        time: [s].
        pictures: of the cameras by name, sRGB, uint8, shape (H, W, 3).
        spots: column and row of the place that is told [pixel]; None where it is not in the
            picture, or nothing is told.
    """

    time: float
    pictures: Mapping[str, NDArray[np.uint8]]
    spots: Mapping[str, Floats | None]

    @classmethod
    def of(cls, environment: Any, world: Any) -> _Glance:
        pictures, spots, told = {}, {}, environment.perceived
        for name, camera in world.actor.sensor_suite.cameras.items():
            shot = shot_of(camera)
            pictures[name] = to_bytes(np.asarray(shot.picture.colour))
            away = shot.axes.T @ (told.target[0] - shot.position)
            seen = told.facts["seen"][0, 0] > 0.5 and away[2] > shot.lens.near
            spots[name] = np.asarray(shot.lens.project(away)) if seen else None
        return cls(float(environment.now.time[0, 0]), pictures, spots)


def show(words: Sequence[str], path: Path) -> str:
    """Fly from the first held-out start, draw strip and film; return how it ended, in words.

    Args:
        words: of the environment.
        path: of the strip, ``.webp``; the film lies beside it as ``NAME_film.webp``.

    Raises:
        ConfigError: the environment shows nothing to cameras.
    """
    from seals.config.compose import compose
    from seals.learn.environments import batched_of

    keys = {word.partition("=")[0] for word in words}
    own = [f"{key}={value}" for key, value in USUAL.items() if key not in keys]
    config = compose([*own, *words, "task.ends=true"], root="evaluate")
    environment: Any = batched_of(config, count=1, renew=False)
    try:
        world, glances, over = _seeing(environment), [], False
        environment.reset(held_out_seeds(1))
        while not over:
            turn = environment.step(environment.scripted_policy())
            over = bool(turn.terminated[0] | turn.truncated[0])
            glances.append(_Glance.of(environment, world))
    finally:
        environment.close()
    _draw(glances, path)
    _film(glances[::2], path.with_name(f"{path.stem}_film.webp"))
    won = "caught" if bool(turn.success[0]) else "not caught"
    return f"{path}: {won} after {glances[-1].time:.1f} s"


def _seeing(environment: Any) -> Any:
    """Return the world of an environment whose policies are told what cameras see.

    Raises:
        ConfigError: they are not.
    """
    from seals.learn.environments.batch import Environments
    from seals.learn.environments.world import WorldsInTurn

    simulator = environment.simulator if isinstance(environment, Environments) else None
    full = isinstance(simulator, WorldsInTurn) and isinstance(environment.task, SeeingTask)
    world: Any = environment.simulator.worlds[0] if full else None
    if not (full and world.actor.sensor_suite.cameras):
        raise ConfigError(
            "nothing is seen by cameras in this environment.\n"
            "Give one with cameras in full worlds: env=catch_seen backend=mujoco"
        )
    return world


def _draw(glances: Sequence[_Glance], path: Path) -> None:
    """Draw the pictures of evenly spaced instants, one row a camera, with rings at the places."""
    chosen = [glances[int(k)] for k in np.linspace(0, len(glances) - 1, INSTANTS)]
    names = list(chosen[0].pictures)
    figure = figure_class()(figsize=(1.5 * INSTANTS, 1.62 * len(names)), dpi=100)
    for column, glance in enumerate(chosen):
        for row, name in enumerate(names):
            axes = figure.add_subplot(len(names), INSTANTS, row * INSTANTS + column + 1)
            picture, spot = glance.pictures[name], glance.spots[name]
            height, width = picture.shape[:2]
            axes.imshow(_brighter(picture), extent=(0.0, width, height, 0.0))
            if spot is not None and np.all((spot > 0.0) & (spot < [width, height])):
                axes.plot(*spot, "o", ms=13, mfc="none", mec="white", mew=1.5)
            axes.set_axis_off()
            if row == 0:
                axes.set_title(f"{glance.time:.1f} s", fontsize=9, pad=2)
    figure.subplots_adjust(0.0, 0.0, 1.0, 0.93, 0.02, 0.02)
    figure.savefig(path)


def _brighter(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture multiplied by `BRIGHTER`, white at most."""
    bright: NDArray[np.uint8] = np.minimum(BRIGHTER * picture, 255.0).astype(np.uint8)
    return bright


def _film(glances: Sequence[_Glance], path: Path) -> None:
    """Write an animated picture of both cameras side by side, as fast as it was."""
    from PIL import Image, ImageDraw

    frames = []
    for glance in glances:
        wide = np.concatenate(list(glance.pictures.values()), axis=1)
        wide = _brighter(wide)
        frame = Image.fromarray(wide.repeat(ENLARGED, axis=0).repeat(ENLARGED, axis=1))
        pen, left = ImageDraw.Draw(frame), 0
        for name, picture in glance.pictures.items():
            spot, size = glance.spots[name], picture.shape[1::-1]
            if spot is not None and np.all((spot > 0.0) & (spot < size)):
                x, y = (float(v) for v in ENLARGED * np.add(spot, (left, 0)))
                pen.ellipse((x - RING, y - RING, x + RING, y + RING), outline="white", width=2)
            left += picture.shape[1]
        pen.text((4, 2), f"{glance.time:.1f} s", fill="white")
        frames.append(frame)
    step = round(1e3 * (glances[-1].time - glances[0].time) / max(1, len(glances) - 1))
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=step, loop=0, quality=50)
