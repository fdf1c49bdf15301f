"""Camera position of a film: presets about the robot's path, or a given position."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, suggestion
from seals.view.films.settings import CAMERAS, SIZES, RenderSettings

UP = np.array([0.0, 0.0, 1.0])
ROOM = 1.1
"""Room around robot and way in the picture [1]."""
_DIRECTIONS = {
    "side": (0.0, -1.0, 0.12),
    "three_quarter": (-0.75, -1.0, 0.5),
    "split": (-0.35, -1.0, 0.0),
    "under_water": (-0.6, -1.0, -0.12),
}
"""From the middle of the way towards the camera."""
UNDER = 0.35
"""Least depth of the camera ``under_water`` [m]."""


class Viewpoint(NamedTuple):
    """Pose of a camera.

    Args:
        origin: world [m], shape (3,).
        axes: optical axes in the world as columns: right, down, ahead; shape (3, 3).
    """

    origin: Floats
    axes: Floats

    @classmethod
    def looking(cls, origin: Floats, target: Floats) -> Viewpoint:
        """Return an upright camera that looks from one point at another.

        Raises:
            ConfigError: the two places are one.

        Example:
            >>> Viewpoint.looking(np.zeros(3), np.array([2.0, 0.0, 0.0])).axes[:, 2].tolist()
            [1.0, 0.0, 0.0]
        """
        ahead = np.asarray(target, dtype=float) - origin
        length = float(np.linalg.norm(ahead))
        if length < 1e-6:
            raise ConfigError(
                f"camera and look_at are both {np.round(target, 3).tolist()}.\n"
                "Give two places that differ."
            )
        ahead = ahead / length
        # straight up or down: north is the upper edge
        upper = UP if abs(ahead[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
        right = np.cross(ahead, upper)
        right /= np.linalg.norm(right)
        return cls(
            np.asarray(origin, dtype=float), np.column_stack([right, np.cross(ahead, right), ahead])
        )


class Way(NamedTuple):
    """Region that a camera must show during a run.

    Args:
        middle: of the room that the robot goes through [m], shape (3,).
        radius: of the ball around robot and way [m].
        level: of the water [m], or None.
    """

    middle: Floats
    radius: float
    level: float | None


def camera_of(settings: RenderSettings, way: Way) -> Callable[[Floats], Viewpoint]:
    """Return the camera as a function of the robot's position [m], shape (3,).

    Raises:
        ConfigError: an unknown preset, one that needs water where there is none, or no place.
    """
    target = np.asarray(settings.look_at or way.middle, dtype=float)
    if target.shape != (3,):
        raise ConfigError(
            f"look_at={settings.look_at} is not a position.\nAllowed: look_at=[x,y,z]"
        )
    origin = _origin(settings, way, target)
    fixed = Viewpoint.looking(origin, target)
    if not settings.follow:
        return lambda _: fixed
    reach = origin - target
    if settings.camera in ("split", "under_water"):
        return lambda at: Viewpoint.looking(
            np.array([at[0] + reach[0], at[1] + reach[1], origin[2]]), at
        )
    return lambda at: Viewpoint.looking(at + reach, at)


def _origin(settings: RenderSettings, way: Way, target: Floats) -> Floats:
    camera: Any = settings.camera
    if not isinstance(camera, str):
        own = np.asarray(list(camera), dtype=float)
        if own.shape != (3,) or not np.all(np.isfinite(own)):
            raise ConfigError(
                f"camera={camera} is not a finite position.\nAllowed: camera=[x,y,z], or a name."
            )
        return own
    if camera not in _DIRECTIONS:
        raise ConfigError(f"camera={camera} is not known.\n{suggestion(camera, CAMERAS)}")
    if camera in ("split", "under_water") and way.level is None:
        raise ConfigError(
            f"camera={camera}: the run has no water.\nAllowed: side, three_quarter, [x,y,z]"
        )
    toward = np.asarray(_DIRECTIONS[camera])
    toward = toward / np.linalg.norm(toward)
    # the picture is wider than high: the height must hold the ball
    wide, high = SIZES[settings.quality]
    ratio = (settings.height or high) / (settings.width or wide)
    half = math.atan(math.tan(0.5 * settings.fov) * ratio)
    radius = way.radius if not settings.follow else min(way.radius, FOLLOWED)
    place: Floats = target + toward * ROOM * radius / math.sin(half)
    if way.level is not None and camera == "split":
        place[2] = way.level
    elif way.level is not None and camera == "under_water":
        place[2] = min(place[2], way.level - UNDER)
    return place


FOLLOWED = 0.8
"""Largest radius of what a camera that follows keeps in the picture [m]."""
