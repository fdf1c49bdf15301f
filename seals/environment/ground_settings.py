"""Typed settings of the ground beyond level planes: shore and obstacles."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from seals.errors import ConfigError
from seals.schema import optional, setting, vector

_CHOSEN = "chosen"


class SolidType(enum.Enum):
    """Primitive an obstacle is made of."""

    box = "box"
    cylinder = "cylinder"
    sphere = "sphere"


@dataclass(kw_only=True)
class ObstacleSettings:
    """Settings of one obstacle, a static solid.

    Args:
        type: which primitive.
        size: box full edges x, y, z; cylinder radius, length; sphere radius [m].
        position: centre in the world [m].
        rpy: roll, pitch, yaw in the world [rad].
        friction: Coulomb friction coefficient; that of the ground when left out [1].
        restitution: coefficient of restitution; that of the ground when left out [1].
    """

    type: SolidType = SolidType.box
    size: list[float] = vector((), "m", bounds=(1e-4, 1e4), source=_CHOSEN)
    position: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e5, 1e5), source=_CHOSEN)
    rpy: list[float] = vector((0.0, 0.0, 0.0), "rad", bounds=(-6.3, 6.3), source=_CHOSEN)
    friction: float | None = optional("1", bounds=(0.0, 10.0), source=_CHOSEN)
    restitution: float | None = optional("1", bounds=(0.0, 1.0), source=_CHOSEN)


@dataclass(kw_only=True)
class ShoreSettings:
    """A slope that climbs from ``tank_bottom`` through the waterline to land at ``ground_level``.

    Args:
        waterline: distance of the waterline from the origin, uphill [m].
        slope: angle of the slope against the horizontal; absent means no shore [rad].
        heading: direction uphill; 0 is east, counter-clockwise from above [rad].
        width: along the waterline, half of it on either side of the origin [m].
        land: length of the level land behind the slope [m].
    """

    waterline: float = setting(0.0, "m", bounds=(-1e5, 1e5), source=_CHOSEN)
    slope: float | None = optional("rad", bounds=(0.01, 1.5), source=_CHOSEN)
    heading: float = setting(0.0, "rad", bounds=(-6.3, 6.3), source=_CHOSEN)
    width: float = setting(20.0, "m", bounds=(0.1, 1e4), source=_CHOSEN)
    land: float = setting(10.0, "m", bounds=(0.1, 1e4), source=_CHOSEN)


SIZES = {SolidType.box: 3, SolidType.cylinder: 2, SolidType.sphere: 1}
"""Numbers in the size of each primitive."""


def check_obstacles(obstacles: dict[str, ObstacleSettings]) -> None:
    """Refuse obstacles whose size does not fit their type.

    Raises:
        ConfigError: a size has too many or too few numbers.
    """
    for name, obstacle in obstacles.items():
        need = SIZES[obstacle.type]
        if len(obstacle.size) != need:
            raise ConfigError(
                f"environment.obstacles.{name}: {obstacle.type.value} has the size "
                f"{list(obstacle.size)}.\nAllowed: {need} numbers "
                "(box edges x, y, z; cylinder radius, length; sphere radius)."
            )


def check_shore(
    shore: ShoreSettings, *, bottom: float | None, water: float | None, land: float | None
) -> None:
    """Refuse a shore without the three levels that it connects.

    Raises:
        ConfigError: a level is missing, or they do not rise.
    """
    if shore.slope is None:
        return
    levels = {"tank_bottom": bottom, "water_level": water, "ground_level": land}
    missing = [name for name, level in levels.items() if level is None]
    if missing:
        raise ConfigError(
            f"environment.shore needs environment.{missing[0]}, which is not given.\n"
            "A shore climbs from tank_bottom through water_level to ground_level."
        )
    if not float(bottom or 0.0) < float(water or 0.0) < float(land or 0.0):
        raise ConfigError(
            f"environment.shore: tank_bottom={bottom}, water_level={water}, ground_level={land}.\n"
            "Allowed: tank_bottom below water_level below ground_level."
        )
