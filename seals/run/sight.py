"""Scene, renderer and water surface for the cameras of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from seals.environment.ground import solids_of
from seals.errors import ConfigError, suggestion
from seals.fluid import SeaOfFluid
from seals.plugin_options import options_of
from seals.registry import names
from seals.rendering import Poses, Renderer, SceneView
from seals.rendering.gather import build_scene
from seals.rendering.optics import Surface, SurfaceStill, SurfaceSum, SurfaceWaves, ripples
from seals.run.immersed import surroundings
from seals.run.settings import RunSettings
from seals.sensors.options import SensorOptions
from seals.world import Actor

FLUID = 1.0
"""How far the surface of a simulated water may be from its level [m]."""
MARGIN = 1.3
"""Largest height of unknown waves over the largest of a sample of them [1]."""


RIPPLES = 8
"""Waves that ripples are made of: every one is a pass over all pixels."""


def open_cameras(settings: RunSettings, actors: Mapping[str, Actor]) -> SceneView | None:
    """Open the cameras of a run and return their scene; None without cameras.

    Raises:
        SealsError: the renderer is missing, or cannot draw here.
    """
    with_cameras = [a for a in actors.values() if any(map(sees, a.sensor_suite.sensors.values()))]
    if not with_cameras:
        return None
    watch = SceneView(
        renderer_of(settings.viewer),
        build_scene(
            {name: actor.robot for name, actor in actors.items()},
            solids_of(surroundings(settings)),
            detail=settings.sight.detail,
            tile=settings.sight.tile,
        ),
        lambda: poses_of(actors),
        optics=settings.optics,
        surface=surface_of(settings),
    )
    for actor in with_cameras:
        actor.sensor_suite.open_cameras(watch)
    return watch


def sees(sensor: Any) -> bool:
    """Return whether a sensor is a camera."""
    return options_of(sensor, SensorOptions).sees


def renderer_of(viewer: Any) -> Renderer:
    """Return the renderer of a run.

    Raises:
        ConfigError: there is none, or what was chosen draws no pictures.
    """
    if isinstance(viewer, Renderer):
        return viewer
    known = suggestion("", names("viewer"), label="Installed")
    if viewer is None:
        raise ConfigError(f"a camera needs a renderer, and viewer is not given.\n{known}")
    raise ConfigError(f"viewer '{type(viewer).__name__}' renders no pictures for cameras.\n{known}")


def poses_of(actors: Mapping[str, Actor]) -> Poses:
    """Return the present poses of all links, in the order of the scene's frames."""
    found = [actor.body.poses() for actor in actors.values()]
    places = [np.asarray(p.origins) for p in found]
    return Poses(
        np.concatenate(places, axis=1), np.concatenate([p.rotations for p in found], axis=1)
    )


def surface_of(settings: RunSettings) -> Surface | None:
    """Return the water surface for rendering; None without water."""
    level = settings.environment.water_level
    if level is None:
        return None
    surface: Surface = SurfaceStill(level=level)
    if settings.fluid is not None:
        surface = SurfaceWaves(SeaOfFluid(settings.fluid), level=level, reach=FLUID)
    elif settings.wave is not None:
        # elevation and normal at scattered points and times
        rng = np.random.default_rng(0)
        points = np.column_stack([rng.uniform(-50.0, 50.0, (1024, 2)), np.full(1024, level)])
        sea = settings.wave.at(points, rng.uniform(0.0, 100.0, (1024, 1)), level)
        elevation, normal = np.asarray(sea.elevation, dtype=float), sea.normal
        if normal is not None:
            # still water has no normal
            reach = MARGIN * float(np.abs(elevation).max())
            surface = SurfaceWaves(settings.wave, level=level, reach=reach)
    if settings.sight.ripples > 0.0:
        wind = settings.sight.ripples
        short = ripples(wind=wind, seed=settings.seed, components=RIPPLES, level=level)
        return SurfaceSum(surface, short)
    return surface
