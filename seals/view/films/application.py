"""``seals render``: frames and a film of a run folder, resumable."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from seals import registry
from seals.arrays import Floats
from seals.config.build import build
from seals.errors import ConfigError, suggestion
from seals.file_names import short_path
from seals.registry import names
from seals.rendering import Lens, Renderer, Scene
from seals.rendering.optics import Optics
from seals.run.progress import progress
from seals.run.surface import FOLDER as SURFACES
from seals.schema import check_fields
from seals.view import Replay, open_replay
from seals.view.films.files import Frames, times_of
from seals.view.films.film import refuse_missing, write_film
from seals.view.films.frame import Drawn, Frame, Photographer
from seals.view.films.settings import SIZES, RenderSettings
from seals.view.films.viewpoint import Viewpoint, Way, camera_of
from seals.view.films.water import WaterOverTime

FOLDER = "render"
"""Folder of a run that holds its films."""
FILM = "film.mp4"
WATER = "coastal_1"
"""Jerlov type of water whose run names none."""
WALLS = "basin_"
"""Walls of a tank, which a film leaves out; its floor stays."""


class Shooting(NamedTuple):
    """Prepared film: scene, camera, times, water.

    Args:
        replay: of the run.
        scene: what there is to see.
        optics: light in the water.
        water: over time.
        camera: by the place of the robot.
        lens: of the camera.
        times: of the frames [s], shape (n,).
    """

    replay: Replay
    scene: Scene
    optics: Optics
    water: WaterOverTime
    camera: Callable[[Floats], Viewpoint]
    lens: Lens
    times: Floats

    def draw(self, photographer: Photographer, frames: Frames, settings: RenderSettings) -> int:
        """Render the missing frames; return their number."""
        left = [k for k in range(len(self.times)) if not frames.done(k)]
        if not left:
            return 0
        photographer.arrange(self.scene, self.optics, settings.quality)
        with progress("render", len(left), lambda: f"{len(left)} frames") as tell:
            for count, k in enumerate(left, start=1):
                light = photographer.photograph(self.frame_at(k, settings.port))
                frames.write(k, settings.exposure * light)
                tell(count)
        return len(left)

    def frame_at(self, number: int, port: float) -> Frame:
        """Return the content of a frame.

        Args:
            number: of the frame.
            port: radius of the dome before the lens [m].
        """
        time = float(self.times[number])
        replay = self.replay
        track = next(iter(replay.tracks.values())).position
        at = np.array([np.interp(time, replay.time, track[:, k]) for k in range(3)])
        return Frame(
            time,
            replay.poses([time]),
            self.camera(at),
            self.lens,
            self.water.at(time),
            port,
        )


def execute(config: Any) -> int | None:
    """Render the missing frames of one film, then write the film.

    Args:
        config: composed by Hydra from the root ``render``.

    Raises:
        SealsError: the run or the renderer cannot be used; frames drawn so far are kept.
    """
    from omegaconf import OmegaConf

    renderer = build(config.renderer, where="renderer")
    chosen: Any = OmegaConf.to_container(config.renderer, enum_to_str=True)
    typed: Any = OmegaConf.merge(OmegaConf.structured(RenderSettings), {**config, "renderer": None})
    settings: Any = OmegaConf.to_object(typed)
    values = {f.name: getattr(settings, f.name) for f in dataclasses.fields(settings)}
    check_fields(RenderSettings, values, where="")
    shooting = prepare(settings)
    if settings.film:
        refuse_missing()
    photographer = photographer_of(renderer)
    out = Path(settings.out) if settings.out else _folder(settings, str(chosen["_target_"]))
    frames = Frames(out, _card(settings, chosen), replace=settings.replace)
    try:
        drawn = shooting.draw(photographer, frames, settings)
    finally:
        photographer.close()
    count = len(shooting.times)
    print(f"render: {drawn} frames rendered, {count - drawn} already there: {short_path(out)}")
    for remark in shooting.water.remarks:
        print(remark)
    if settings.film:
        write_film(out / FILM, [frames.path(k) for k in range(count)], settings.fps)
        print(f"film: {short_path(out / FILM)} ({count / settings.fps:.1f} s)")
    return None


def prepare(settings: RenderSettings) -> Shooting:
    """Prepare a film of a run folder, without its renderer.

    Raises:
        SealsError: the run cannot be used, or the camera has no place.
    """
    if settings.run is None:
        raise ConfigError(
            "run is not given.\nName the folder of a run: seals render run=runs/DAY/TIME_NAME"
        )
    return shooting_of(open_replay(settings.run, key="run"), settings)


def shooting_of(replay: Replay, settings: RenderSettings, *, way: Way | None = None) -> Shooting:
    """Prepare a film, without its renderer.

    Args:
        replay: what is filmed.
        settings: of the film.
        way: what a camera is to see; None for the robot's way.

    Raises:
        SealsError: the camera has no place.
    """
    run, end = replay.stage.settings, replay.end
    end = end if settings.end is None else min(end, settings.end)
    times = times_of(settings.start, end, fps=settings.fps, speed=settings.speed)
    way = way or _way(replay, times)
    wind = run.sight.ripples if settings.ripples is None else settings.ripples
    # short waves are for the picture only
    rippled = dataclasses.replace(run, sight=dataclasses.replace(run.sight, ripples=wind))
    water = WaterOverTime(rippled, replay.folder, way.middle)
    kind = settings.water_type or (
        WATER if run.optics.water_type == "none" else run.optics.water_type
    )
    wide, high = SIZES[settings.quality]
    return Shooting(
        replay,
        without_walls(replay.stage.scene),
        dataclasses.replace(run.optics, water_type=kind),
        water,
        camera_of(settings, way),
        Lens(
            width=settings.width or wide,
            height=settings.height or high,
            fov=settings.fov,
            near=0.02,
            far=3000.0,
        ),
        times,
    )


def photographer_of(renderer: Any) -> Photographer:
    """Return the frame renderer; water is composited for renderers without it.

    Raises:
        ConfigError: the viewer draws nothing.
    """
    if isinstance(renderer, Photographer):
        return renderer
    if isinstance(renderer, Renderer):
        return Drawn(renderer)
    raise ConfigError(
        f"renderer '{type(renderer).__name__}' draws no frames.\n"
        f"{suggestion('', names('viewer'), label='Installed')}"
    )


def without_walls(scene: Scene) -> Scene:
    """Return the scene without the walls of a tank, which would hide the water."""
    gone = {
        k
        for k, name in enumerate(scene.names)
        if name.startswith(f"world/{WALLS}") and not name.endswith("floor")
    }
    return scene._replace(shapes=tuple(s for s in scene.shapes if s.part not in gone))


def _way(replay: Replay, times: Floats) -> Way:
    track = next(iter(replay.tracks.values())).position
    during = (replay.time >= times[0] - 1e-9) & (replay.time <= times[-1] + 1e-9)
    track = track[during] if during.any() else track
    level = replay.stage.settings.environment.water_level
    low, high = track.min(axis=0), track.max(axis=0)
    radius = 0.5 * float(np.linalg.norm(high - low)) + _reach(replay)
    return Way(0.5 * (low + high), radius, level)


def _reach(replay: Replay) -> float:
    """Return the largest distance of the robot from its base [m]."""
    from seals.rendering.meshes import corners_of

    poses = replay.poses([replay.time[0]])
    base, size = np.asarray(poses.position)[0, 0], 0.1
    for shape in replay.stage.scene.shapes:
        if shape.frame >= 0 and shape.kind != "plane":
            points = corners_of(shape)[0] @ np.asarray(shape.rotation).T + shape.position
            turned = points @ np.asarray(poses.rotation)[0, shape.frame].T
            place = turned + np.asarray(poses.position)[0, shape.frame]
            size = max(size, float(np.linalg.norm(place - base, axis=1).max()))
    return size


def _folder(settings: RenderSettings, target: str) -> Path:
    """Folder of a film in its run's folder, named by renderer, quality and camera."""
    classes = {n: registry.get("viewer", n).value.partition(":")[2] for n in names("viewer")}
    kind = next((n for n, made in classes.items() if target.endswith(f".{made}")), "other")
    camera = settings.camera if isinstance(settings.camera, str) else "own"
    run = Path(str(settings.run))
    found = run / FOLDER / f"{kind}_{settings.quality.value}_{camera}"
    if not found.resolve().is_relative_to(run.resolve()):
        raise ConfigError(
            f"{found} leads out of the folder of its run, to {found.resolve()}.\n"
            "Say where the frames shall be written: out=FOLDER"
        )
    return found


def _card(settings: RenderSettings, renderer: Any) -> Mapping[str, Any]:
    """Return the identity of a film: frames of another identity belong to another film."""
    folder = Path(str(settings.run))
    kept = ("out", "film", "replace", "name")
    card = {k: v for k, v in dataclasses.asdict(settings).items() if k not in kept}
    card |= {"run": str(folder.resolve()), "renderer": renderer}
    place = settings.camera
    camera = place if isinstance(place, str) else [float(x) for x in place]
    card |= {"quality": settings.quality.value, "camera": camera}
    log, surfaces = (folder / "log.parquet").stat(), (folder / SURFACES).glob("t_*.ply")
    return {**card, "log": [log.st_size, log.st_mtime_ns], "surfaces": len(list(surfaces))}
