"""Ground as static solids for all backends: planes, shore, obstacles."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.environment.settings import EnvironmentSettings, ObstacleSettings
from seals.environment.terrain import Terrain, terrain_of
from seals.frames import matrix_of, quaternion_of_rpy

THICKNESS = 0.5
"""Thickness of the slab of a slope [m]: more than a body sinks in within one step."""


class Solid(NamedTuple):
    """Static solid.

    Args:
        name: for messages.
        kind: ``plane`` (upper side of a level half space), ``box``, ``cylinder``, ``sphere`` or
            ``terrain``.
        size: box edges; cylinder radius, length; sphere radius; lengths of a terrain along x and y;
            empty for a plane [m].
        position: centre, or a point of the plane, world [m], shape (3,).
        quaternion: q_WS_xyzw, shape (4,).
        friction: Coulomb friction coefficient [1].
        restitution: coefficient of restitution [1].
        terrain: height map, of a terrain alone.
    """

    name: str
    kind: str
    size: tuple[float, ...]
    position: Floats
    quaternion: Floats
    friction: float
    restitution: float
    terrain: Terrain | None = None


def solids_of(environment: EnvironmentSettings) -> list[Solid]:
    """Return all static solids that a body can touch.

    With a shore, the land at ``ground_level`` lies behind the slope only.

    Example:
        >>> [s.name for s in solids_of(EnvironmentSettings(tank_bottom=-2.0))]
        ['tank_bottom']
    """
    e = environment
    level = np.array([0.0, 0.0, 0.0, 1.0])
    planes = {"tank_bottom": e.tank_bottom}
    if e.shore.slope is None and e.ground_level != e.tank_bottom:
        planes["ground_level"] = e.ground_level
    found = [
        Solid(name, "plane", (), np.array([0.0, 0.0, z]), level, e.friction, e.restitution)
        for name, z in planes.items()
        if z is not None
    ]
    if e.shore.slope is not None:
        found += _shore(e, e.shore.slope)
    terrain = terrain_of(e.terrain)
    if terrain is not None:
        place = np.array([*e.terrain.position[:2], 0.0])
        found.append(Solid("terrain", "terrain", terrain.size, place, level, *_contact(e), terrain))
    return found + [_obstacle(e, name, settings) for name, settings in e.obstacles.items()]


def ground_height(environment: EnvironmentSettings, x: float, y: float) -> float | None:
    """Return the height of the ground below a point [m]; None if there is none.

    Args:
        environment: with its levels.
        x: east [m].
        y: north [m].

    Example:
        >>> ground_height(EnvironmentSettings(tank_bottom=-2.0), 0.0, 0.0)
        -2.0
    """
    e = environment
    terrain = terrain_of(e.terrain)
    own = None if terrain is None else terrain.height(x, y)
    levels = [z for z in (e.tank_bottom, e.ground_level, own) if z is not None]
    if e.shore.slope is None:
        return max(levels, default=None)
    bottom, water, land = _levels(e)
    uphill = x * math.cos(e.shore.heading) + y * math.sin(e.shore.heading)
    slope = water + math.tan(e.shore.slope) * (uphill - e.shore.waterline)
    return max([min(max(slope, bottom), land), *([] if own is None else [own])])


def _shore(e: EnvironmentSettings, slope: float) -> list[Solid]:
    """Slope and land as two boxes that overlap at the upper edge."""
    shore = e.shore
    bottom, water, land = _levels(e)
    rise = math.tan(slope)
    foot, edge = (shore.waterline + (z - water) / rise for z in (bottom, land))
    turn = quaternion_of_rpy(np.array([[0.0, -slope, shore.heading]]))[0]
    level = quaternion_of_rpy(np.array([[0.0, 0.0, shore.heading]]))[0]
    uphill = np.array([math.cos(shore.heading), math.sin(shore.heading), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    normal = matrix_of(turn[None])[0][:, 2]
    middle = 0.5 * (foot + edge) * uphill + 0.5 * (bottom + land) * up
    length, height = math.hypot(edge - foot, land - bottom), land - bottom
    slab = (length, shore.width, THICKNESS)
    block = (shore.land, shore.width, height)
    inland = (edge + 0.5 * shore.land) * uphill + 0.5 * (bottom + land) * up
    return [
        Solid("slope", "box", slab, middle - 0.5 * THICKNESS * normal, turn, *_contact(e)),
        Solid("land", "box", block, inland, level, *_contact(e)),
    ]


def _obstacle(e: EnvironmentSettings, name: str, settings: ObstacleSettings) -> Solid:
    turn = quaternion_of_rpy(np.array([settings.rpy], dtype=float))[0]
    friction = e.friction if settings.friction is None else settings.friction
    bounce = e.restitution if settings.restitution is None else settings.restitution
    size, place = tuple(settings.size), np.array(settings.position, dtype=float)
    return Solid(name, settings.type.value, size, place, turn, friction, bounce)


def _contact(e: EnvironmentSettings) -> tuple[float, float]:
    return e.friction, e.restitution


def _levels(e: EnvironmentSettings) -> tuple[float, float, float]:
    """Return the levels of bottom, water and land of a shore [m]."""
    return float(e.tank_bottom or 0.0), float(e.water_level or 0.0), float(e.ground_level or 0.0)
