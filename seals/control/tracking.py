"""Position tracking: velocity references from a moving target point."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from seals.arrays import Floats, namespace
from seals.control.protocols import NOTHING, STILL, Reference, RobotState
from seals.errors import ConfigError

FARTHEST, MOST_PLACES = 1e5, 1000
"""Distance from the world's origin within which goals lie [m], and how many one guide has."""


class Place(NamedTuple):
    """Point of a path with its velocity and heading.

    Args:
        position: world [m], shape (3,).
        velocity: world axes [m/s], shape (3,).
        acceleration: world axes [m/s^2], shape (3,).
        yaw: heading [rad].
        yaw_rate: [rad/s].
    """

    position: Floats
    velocity: Floats = STILL
    acceleration: Floats = STILL
    yaw: float = 0.0
    yaw_rate: float = 0.0


def towards(position: Any, place: Any, gain: Any, speed: Any) -> list[Any]:
    """Return the velocity towards a place, no faster than a speed; pure, one number at a time.

    Args:
        position: x, y and z, numbers or entries of an array of any library [m].
        place: likewise.
        gain: of the distance [1/s].
        speed: largest [m/s].
    """
    x, y, z = (gain * (place[k] - position[k]) for k in range(3))
    square = x * x + y * y + z * z
    if isinstance(square, float):
        length = math.sqrt(square)
        share = speed / length if length > speed else 1.0
    else:
        xp = namespace(square)
        length = xp.sqrt(square)
        share = xp.where(length > speed, speed / length, 1.0)
    return [x * share, y * share, z * share]


def pursued(
    situation: RobotState,
    place: Place,
    *,
    gain: float,
    speed: float,
    joints: Mapping[str, Floats] = NOTHING,
    grip: Mapping[str, float] = NOTHING,
) -> Reference:
    """Return the velocity reference that tracks a path point (position loop of the guides).

    Args:
        situation: now.
        place: on the course, now.
        gain: of the position's error [1/s].
        speed: largest speed towards the place [m/s].
        joints: of the arms, see `Reference`.
        grip: of the grippers, see `Reference`.
    """
    goal, position = place.position.tolist(), situation.position.tolist()
    back = np.array(towards(position, goal, gain, speed))
    return Reference(
        velocity=place.velocity + back,
        acceleration=place.acceleration,
        yaw=place.yaw,
        yaw_rate=place.yaw_rate,
        joints=joints,
        grip=grip,
    )


def minimum_jerk(start: Floats, end: Floats, duration: float, time: float) -> Place:
    """Return the point on a straight minimum-jerk path between two points at rest.

    Args:
        start: [m], shape (3,).
        end: [m], shape (3,).
        duration: [s].
        time: since the start [s]; before and after it rests at the ends.

    References:
        Flash and Hogan 1985, Journal of Neuroscience 5(7).

    Example:
        >>> import numpy as np
        >>> minimum_jerk(np.zeros(3), np.ones(3), 2.0, 1.0).position
        array([0.5, 0.5, 0.5])
    """
    way = end - start
    if duration <= 0.0 or time >= duration:
        return Place(end)
    u = max(time, 0.0) / duration
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    v = 30.0 * u**2 * (1.0 - u) ** 2 / duration
    a = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / duration**2
    return Place(start + s * way, v * way, a * way)


def refuse_strange_places(key: str, places: Sequence[Sequence[float]]) -> None:
    """Refuse places that are no positions of this world.

    Args:
        key: of the setting, for the message.
        places: world [m], rows of three numbers.

    Raises:
        ConfigError: none, too many, or one that is not three numbers within 100 km.
    """
    # each as a number of its own: rows may be of any length
    near = all(len(p) == 3 and all(abs(x) <= FARTHEST for x in p) for p in places)
    if not 1 <= len(places) <= MOST_PLACES or not near:
        raise ConfigError(
            f"{key}={str(places)[:120]} is not allowed.\n"
            f"Allowed: 1 to {MOST_PLACES} rows of three numbers [x, y, z] within {FARTHEST:g} m."
        )
