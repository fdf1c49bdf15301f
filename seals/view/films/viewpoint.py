"""Camera position of a film: presets about the robot's path, or a given position; what it sees."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats
from seals.errors import ConfigError, suggestion
from seals.rendering import Lens
from seals.rendering.optics.path import INDEX
from seals.view.films.settings import CAMERAS, SIZES, RenderSettings

UP = np.array([0.0, 0.0, 1.0])
ROOM = 1.1
"""Room around robot and way in the picture [1]."""
_DIRECTIONS = {
    "side": (0.0, -1.0, 0.12),
    # low enough that the horizon is in the picture
    "three_quarter": (-0.75, -1.0, 0.3),
    "split": (-0.35, -1.0, 0.0),
    "under_water": (-0.6, -1.0, -0.12),
}
"""From the middle of the way towards the camera."""
UNDER = 0.35
"""Least depth of the camera ``under_water`` [m]."""
WIDE, ROUND = 4.0, 1.6
"""How many reaches of the robot its way may be wide before the camera follows, and how many the
camera that follows keeps in the picture [1]."""
SMALLEST = 0.3
"""Least radius of what a camera that follows keeps in the picture [m]."""


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
                "Give two different positions."
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
        reach: of the robot from its base [m].
    """

    middle: Floats
    radius: float
    level: float | None
    reach: float = 0.5

    def followed(self) -> Way:
        """Return what a camera that follows keeps in the picture: the robot and the waterline."""
        beside = 0.0 if self.level is None else 0.5 * self.reach
        near = max(ROUND * self.reach + beside, SMALLEST)
        return self._replace(radius=min(self.radius, near))

    def with_waterline(self) -> Way:
        """Return a region that reaches the water's surface, if that is nearer than its radius."""
        gap = 0.0 if self.level is None else self.level - float(self.middle[2])
        if not 0.0 < abs(gap) - self.radius < self.radius:
            return self
        more = abs(gap) - self.radius
        middle = self.middle + np.array([0.0, 0.0, math.copysign(0.5 * more, gap)])
        return self._replace(middle=middle, radius=self.radius + 0.5 * more)


def camera_of(settings: RenderSettings, way: Way) -> Callable[[Floats], Viewpoint]:
    """Return the camera as a function of the robot's position [m], shape (3,).

    Raises:
        ConfigError: an unknown preset, one that needs water where there is none, or no place.
    """
    own = not isinstance(settings.camera, str)
    follow = settings.follow
    if follow is None:
        follow = not own and not settings.look_at and way.radius > WIDE * way.reach
    if not own and not settings.look_at:
        way = way.followed() if follow else way.with_waterline()
    target = np.asarray(settings.look_at or way.middle, dtype=float)
    if target.shape != (3,):
        raise ConfigError(
            f"look_at={settings.look_at} is not a position.\nAllowed: look_at=[x,y,z]"
        )
    origin = _origin(settings, way, target)
    fixed = Viewpoint.looking(origin, target)
    if not follow:
        return lambda _: fixed
    offset = origin - target

    def along(at: Floats) -> Viewpoint:
        # a preset keeps the waterline beside the robot in the picture
        aim = at if own or way.level is None else at + _toward(way.level - at[2], way.reach)
        place = aim + offset
        if settings.camera == "split":
            place[2] = origin[2]
        elif settings.camera == "under_water" and way.level is not None:
            place[2] = min(place[2], way.level - UNDER)
        return Viewpoint.looking(place, aim)

    return along


def _toward(gap: float, reach: float) -> Floats:
    """Half the way to the waterline, as far as both have room [m], shape (3,)."""
    return np.array([0.0, 0.0, 0.5 * float(np.clip(gap, -reach, reach))])


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
    place: Floats = target + toward * ROOM * way.radius / math.sin(half)
    if way.level is not None and camera == "split":
        place[2] = way.level
    elif way.level is not None and camera == "under_water":
        place[2] = min(place[2], way.level - UNDER)
    return place


def apparent(origin: Floats, points: Floats, level: float | None) -> Floats:
    """Return where points seem to be for an eye on the other side of level water.

    Equation:
        n sin(a) = sin(b): the place x of the surface where c x / sqrt(x^2 + c^2) and
        c' (d - x) / sqrt((d - x)^2 + h^2) are equal, by halving.

    Args:
        origin: of the eye, world [m], shape (3,).
        points: world [m], shape (n, 3).
        level: of the water [m], or None.

    Returns:
        Places along the seen direction, as far away as the points; shape (n, 3).

    Source:
        Snell's law.
    """
    if level is None:
        return points
    depth, height = level - origin[2], points[:, 2] - level
    crossing = depth * height > 0.0
    if not np.any(crossing):
        return points
    flat = points[:, :2] - origin[:2]
    far = np.maximum(np.linalg.norm(flat, axis=1), 1e-9)
    near, beyond = (INDEX, 1.0) if depth > 0.0 else (1.0, INDEX)
    low, high = np.zeros_like(far), far.copy()
    for _ in range(40):
        x = 0.5 * (low + high)
        short = near * x / np.hypot(x, depth) < beyond * (far - x) / np.hypot(far - x, height)
        low, high = np.where(short, x, low), np.where(short, high, x)
    x = 0.5 * (low + high)
    ray = np.column_stack([flat * (x / far)[:, None], np.full_like(x, depth)])
    ray *= (np.linalg.norm(points - origin, axis=1) / np.linalg.norm(ray, axis=1))[:, None]
    return np.where(crossing[:, None], origin + ray, points)


def in_picture(view: Viewpoint, lens: Lens, points: Floats, level: float | None) -> bool:
    """Return whether one of some points is within the picture, seen through level water.

    Args:
        view: of the camera.
        lens: of the camera.
        points: world [m], shape (n, 3).
        level: of the water [m], or None.
    """
    seen = apparent(view.origin, points, level) - view.origin
    right, down, ahead = (seen @ view.axes).T
    wide = math.tan(0.5 * lens.fov)
    high = wide * lens.height / lens.width
    return bool(
        np.any((ahead > lens.near) & (abs(right) < wide * ahead) & (abs(down) < high * ahead))
    )
