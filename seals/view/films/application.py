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
from seals.errors import ConfigError, MissingExtra, suggestion
from seals.file_names import short_path
from seals.logs.atomic import write_bytes
from seals.registry import names
from seals.rendering import Lens, Renderer, Scene
from seals.rendering.optics import Optics, to_bytes
from seals.rendering.picture import png
from seals.run.progress import progress
from seals.run.surface import FOLDER as SURFACES
from seals.schema import check_fields
from seals.view import Replay, open_replay
from seals.view.films.files import Frames, refuse_missing, times_of, write_film
from seals.view.films.frame import Drawn, Frame, Photographer
from seals.view.films.settings import CAMERAS, SIZES, RenderSettings
from seals.view.films.viewpoint import Viewpoint, Way, camera_of, in_picture
from seals.view.films.water import WaterOverTime

FOLDER = "render"
"""Folder of a run that holds its films."""
FILM = "film.mp4"
WATER = "coastal_1"
"""Jerlov type of water whose run names none."""
PREVIEW = "preview.png"
"""Four frames of a long film, drawn in seconds before it."""
LOOKED_AT, PREVIEWED = 40, 4
"""Frames looked at for whether they show the robot, and those of a preview."""
PLAIN = 2.0
"""Standard deviation of the grey values of a picture below which nothing can be told apart in it,
of 255: sky alone, or dark water alone.
"""
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
        way: what the camera is to see.
        afloat: whether the camera rides on the water's surface.
    """

    replay: Replay
    scene: Scene
    optics: Optics
    water: WaterOverTime
    camera: Callable[[Floats], Viewpoint]
    lens: Lens
    times: Floats
    way: Way
    afloat: bool

    def draw(
        self, photographer: Photographer, frames: Frames, settings: RenderSettings
    ) -> tuple[int, list[float]]:
        """Render the missing frames.

        Returns:
            Their number, and the times of those that are of one colour throughout [s].
        """
        left = [k for k in range(len(self.times)) if not frames.done(k)]
        empty: list[float] = []
        if not left:
            return 0, empty
        photographer.arrange(self.scene, self.optics, settings.quality)
        with progress("render", len(left), lambda: f"{len(left)} frames") as tell:
            for count, k in enumerate(left, start=1):
                light = settings.light * photographer.photograph(self.frame_at(k, settings.port))
                frames.write(k, light)
                if float(to_bytes(light).mean(axis=2).std()) < PLAIN:
                    empty.append(float(self.times[k]))
                tell(count)
        return len(left), empty

    def shown(self, camera: Callable[[Floats], Viewpoint]) -> list[tuple[float, bool]]:
        """Return the times of up to 40 frames, and whether a camera has the robot in its picture.

        Args:
            camera: by the place of the robot.
        """
        found: list[tuple[float, bool]] = []
        for number in np.linspace(0, len(self.times) - 1, LOOKED_AT).round().astype(int):
            time = float(self.times[number])
            points = _corners(self.replay, time)
            view = camera(self.robot_at(time))
            if not found or time > found[-1][0]:
                found.append((time, in_picture(view, self.lens, points, self.water.level)))
        return found

    def robot_at(self, time: float) -> Floats:
        """Place of the robot [m], shape (3,)."""
        track = next(iter(self.replay.tracks.values())).position
        return np.array([np.interp(time, self.replay.time, track[:, k]) for k in range(3)])

    def frame_at(self, number: int, port: float) -> Frame:
        """Return the content of a frame.

        Args:
            number: of the frame.
            port: radius of the dome before the lens [m].
        """
        time = float(self.times[number])
        view, water = self.camera(self.robot_at(time)), self.water.at(time)
        if self.afloat and water is not None:
            x, y = view.origin[:2]
            height = float(water.surface.height(np.array([x]), np.array([y]), time)[0])
            view = view._replace(origin=np.array([x, y, height]))
        return Frame(time, self.replay.poses([time]), view, self.lens, water, port)


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
    for line in (*_unseen(shooting, settings), *_preview(shooting, settings, renderer, out)):
        print(line)
    try:
        drawn, empty = shooting.draw(photographer, frames, settings)
    finally:
        photographer.close()
    count = len(shooting.times)
    for line in _empty(shooting, settings, empty, drawn):
        print(line)
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
        way,
        settings.camera == "split",
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
        f"renderer '{type(renderer).__name__}' renders no frames.\n"
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
    # largest distance of the robot from its base [m]
    time = float(replay.time[0])
    base = np.asarray(replay.poses([time]).position)[0, 0]
    reach = max(0.1, float(np.linalg.norm(_corners(replay, time) - base, axis=1).max()))
    radius = 0.5 * float(np.linalg.norm(high - low)) + reach
    return Way(0.5 * (low + high), radius, level, reach)


def _corners(replay: Replay, time: float) -> Floats:
    """Return the corners of the first actor as drawn, world [m], shape (n, 3)."""
    from seals.rendering.meshes import corners_of

    poses, scene = replay.poses([time]), replay.stage.scene
    position, rotation = np.asarray(poses.position)[0], np.asarray(poses.rotation)[0]
    robot = next(iter(replay.tracks))
    found = [position[:1]]
    for shape in scene.shapes:
        own = shape.frame >= 0 and scene.frames[shape.frame].partition("/")[0] == robot
        if own and shape.kind != "plane":
            points = corners_of(shape)[0] @ np.asarray(shape.rotation).T + shape.position
            found.append(points @ rotation[shape.frame].T + position[shape.frame])
    return np.concatenate(found)


def _unseen(shooting: Shooting, settings: RenderSettings) -> list[str]:
    """Say in how many frames the robot is out of the picture, and which camera shows more."""
    seen = shooting.shown(shooting.camera)
    missed = [time for time, is_in in seen if not is_in]
    if not missed:
        return []

    def share(camera: str) -> float:
        found = shooting.shown(
            camera_of(dataclasses.replace(settings, camera=camera, look_at=[]), shooting.way)
        )
        return sum(is_in for _, is_in in found) / len(found)

    wet = ("split", "under_water")
    presets = [c for c in CAMERAS if shooting.water.level is not None or c not in wet]
    best = max(presets, key=share)
    better = share(best)
    lines = [
        f"camera: the robot is in the picture in {len(seen) - len(missed)} of {len(seen)} sampled "
        f"frames; first out of view at {missed[0]:.2f} s"
    ]
    if better > 1.0 - len(missed) / len(seen):
        lines.append(f"  camera={best} shows it in {100.0 * better:.0f} %; replace=true draws anew")
    return lines


def _empty(
    shooting: Shooting, settings: RenderSettings, empty: list[float], drawn: int
) -> list[str]:
    """Say how many frames show nothing, and where to look from instead."""
    if not empty:
        return []
    level, at = shooting.water.level, shooting.robot_at(empty[0])
    near = "three_quarter" if level is None or at[2] > level else "under_water"
    advice = f"camera={near} looks from near by; " if settings.camera != near else ""
    return [
        f"camera: {len(empty)} of {drawn} frames show nothing but one colour, the first at "
        f"{empty[0]:.2f} s: the robot is too far away, or in the dark",
        f"  {advice}exposure={4.0 * settings.light:g} is brighter; replace=true draws anew",
    ]


def _preview(shooting: Shooting, settings: RenderSettings, renderer: Any, out: Path) -> list[str]:
    """Draw four small frames by the renderer that takes seconds, before one that takes longer."""
    if not isinstance(renderer, Photographer) or len(shooting.times) <= PREVIEWED:
        return []
    few = shooting._replace(
        lens=dataclasses.replace(shooting.lens, width=320, height=200),
        times=shooting.times[np.linspace(0, len(shooting.times) - 1, PREVIEWED).astype(int)],
    )
    try:
        quick = Drawn(registry.get("viewer", "tiny").load()())
    except MissingExtra:
        # a preview wants PyBullet; the film does not
        return []
    try:
        quick.arrange(few.scene, few.optics, settings.quality)
        drawn = [quick.photograph(few.frame_at(k, settings.port)) for k in range(PREVIEWED)]
    finally:
        quick.close()
    sheet = np.concatenate([np.concatenate(drawn[k : k + 2], axis=1) for k in (0, 2)])
    write_bytes(out / PREVIEW, png(to_bytes(np.clip(settings.light * sheet, 0.0, 1.0))))
    return [f"preview: {short_path(out / PREVIEW)} (four frames, by renderer=tiny)"]


def _folder(settings: RenderSettings, target: str) -> Path:
    """Folder of a film in its run's folder, named by renderer, quality and camera."""
    classes = {n: registry.get("viewer", n).value.partition(":")[2] for n in names("viewer")}
    kind = next((n for n, made in classes.items() if target.endswith(f".{made}")), "other")
    camera = settings.camera if isinstance(settings.camera, str) else "own"
    run = Path(str(settings.run))
    found = run / FOLDER / f"{kind}_{settings.quality.value}_{camera}"
    if not found.resolve().is_relative_to(run.resolve()):
        raise ConfigError(
            f"{found} leads outside the folder of its run, to {found.resolve()}.\n"
            "Name a folder for the frames: out=FOLDER"
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
