"""Frames of a run at chosen instants, rendered from its log in software."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.logs import Log
from seals.plugins.viewers.bullet import RendererTiny
from seals.rendering import Lens, SceneView
from seals.rendering.optics import Optics, to_bytes
from seals.report.pictures import figure_class
from seals.run.fleet import ROBOT
from seals.run.settings import RunSettings
from seals.run.sight import surface_of
from seals.view.films.application import without_walls
from seals.view.films.viewpoint import Viewpoint
from seals.view.replay import Replay, tracks_of
from seals.view.stage import build_stage

FAR = 1.2
"""Distance of an object beyond which a picture shows the robot alone [m]."""
LENS = {"fov": 1.12, "near": 0.02, "far": 60.0}
"""Horizontal field of view [rad] and range [m] of the camera."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Camera relative to its target.

    Args:
        distance: from the target [m].
        yaw: heading of the line of sight, from north to the left [deg].
        pitch: of the line of sight, downwards is negative [deg].
        size: width and height in pixels.
    """

    distance: float = 1.15
    yaw: float = 40.0
    pitch: float = -12.0
    size: tuple[int, int] = (480, 360)

    @property
    def offset(self) -> Floats:
        """Camera less target, world [m], shape (3,)."""
        yaw, pitch = np.radians(self.yaw), np.radians(self.pitch)
        ahead = np.cos(pitch) * np.array([-np.sin(yaw), np.cos(yaw), np.tan(pitch)])
        offset: Floats = -self.distance * ahead
        return offset


def draw_frames(
    log: Log, settings: RunSettings, times: Sequence[float], view: View | None = None
) -> list[Any]:
    """Return one picture an instant, arrays of shape (height, width, 3) in 0 to 255.

    Args:
        log: of the run.
        settings: of the run.
        times: instants [s].
        view: camera; it looks at the middle between the robot and its nearest object.

    Raises:
        MissingExtra: the engine is not installed.
    """
    view, stage = view or View(), build_stage(settings)
    replay = Replay(Path(), stage, np.asarray(log.time), tracks_of({ROBOT: log}, stage))
    lens = Lens(width=view.size[0], height=view.size[1], **LENS)
    # the surface of the waves alone: a log keeps none of the particles
    surface = surface_of(dataclasses.replace(settings, fluid=None))
    optics = Optics(water_type="coastal_1", noise=False)
    shown = {"time": 0.0}
    watch = SceneView(
        RendererTiny(),
        without_walls(stage.scene),
        lambda: replay.poses([shown["time"]]),
        optics=optics,
        surface=surface,
    )
    random, pictures = np.random.default_rng(0), []
    try:
        for time in times:
            shown["time"] = float(time)
            # the middle between the robot and its nearest object, if near [m], shape (3,)
            row = int(np.searchsorted(replay.time, float(time)).clip(0, len(replay.time) - 1))
            here, *others = (track.position[row] for track in replay.tracks.values())
            near = min(others, key=lambda place: float(np.linalg.norm(place - here)), default=here)
            target: Floats = here if np.linalg.norm(near - here) > FAR else 0.5 * (here + near)
            camera = Viewpoint.looking(target + view.offset, target)
            pictures.append(
                to_bytes(watch.see((camera.origin, camera.axes), lens, time, random).colour)
            )
        return pictures
    finally:
        watch.close()


def write_sheet(path: Path, pictures: Mapping[str, Any], *, columns: int = 4) -> Path:
    """Write pictures with their titles as one PNG sheet."""
    rows = -(-len(pictures) // columns)
    figure = figure_class()(figsize=(3.2 * columns, 2.6 * rows), dpi=110, layout="constrained")
    for number, (title, picture) in enumerate(pictures.items(), start=1):
        axes = figure.add_subplot(rows, columns, number)
        axes.imshow(picture)
        axes.set_title(title, fontsize=9)
        axes.set_axis_off()
    figure.savefig(path)
    return path


def stage_times(log: Log) -> dict[str, float]:
    """Return an instant near the end of every stage of a log, by number and name."""
    stages = log.meta.get("guide", {}).get("stages", [])
    ends = [row["time"] for row in stages[1:]] + [float(log.time[-1])]
    return {
        f"{k + 1} {row['name']}": max(row["time"], end - 0.1)
        for k, (row, end) in enumerate(zip(stages, ends, strict=True))
    }
