"""Typed environment of a run: gravity, air, water, ground, shore and obstacles."""

from __future__ import annotations

import enum
import itertools
from dataclasses import dataclass, field
from typing import Any

from seals.errors import ConfigError
from seals.field_roles import roles
from seals.schema import LATER, optional, param, read, setting, vector

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


@roles(read="file")
@dataclass(kw_only=True)
class TerrainSettings:
    """A height map: land, or the bottom of a sea, beside the level ground.

    Args:
        file: PNG of grey values, of 8 or 16 bits, or CSV of heights [m]; the first row is the
            northern edge, the first column the western one; absent for none.
        size: length from west to east and from south to north, from the first node to the last [m].
        low: height of black [m]; a CSV holds its heights itself.
        high: height of white [m].
        position: middle of the map, and what is added to its heights, world [m].
    """

    file: str | None = None
    size: list[float] = vector((20.0, 20.0), "m", bounds=(0.01, 1e5), source=_CHOSEN)
    low: float = setting(-10.0, "m", bounds=(-12000.0, 9000.0), source=_CHOSEN)
    high: float = setting(0.0, "m", bounds=(-12000.0, 9000.0), source=_CHOSEN)
    position: list[float] = vector((0.0, 0.0, 0.0), "m", bounds=(-1e5, 1e5), source=_CHOSEN)


SIZES = {SolidType.box: 3, SolidType.cylinder: 2, SolidType.sphere: 1}
"""Numbers in the size of each primitive."""


def _check_shore(
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
            "A shore rises from tank_bottom through water_level to ground_level."
        )
    if not float(bottom or 0.0) < float(water or 0.0) < float(land or 0.0):
        raise ConfigError(
            f"environment.shore: tank_bottom={bottom}, water_level={water}, ground_level={land}.\n"
            "Allowed: tank_bottom below water_level below ground_level."
        )


_PLACE = (-12000.0, 12000.0)


@roles(data="water_temperature salinity obstacles")
@dataclass(kw_only=True)
class EnvironmentSettings:
    """Environment settings: air, water, ground; the world frame is East-North-Up.

    Args:
        gravity: acceleration of gravity, downwards [m/s^2].
        air_density: density of air [kg/m^3].
        air_viscosity: dynamic viscosity of air [Pa s].
        water_level: height of the calm surface; absent means no water [m].
        tank_bottom: height of the bottom under the water [m].
        ground_level: height of the ground in air [m].
        water_temperature: rows of depth [m] and temperature [degC], depth rising.
        salinity: rows of depth [m] and salinity [g/kg], depth rising.
        water_density: density of water, in place of that of the two profiles [kg/m^3].
        restitution: coefficient of restitution of ground and bottom [1].
        friction: Coulomb friction coefficient of ground and bottom [1].
        shore: slope from the bottom through the waterline to the land.
        obstacles: further static solids, by name.
        terrain: height map of land or sea bed.
    """

    gravity: float = param(
        9.81, "m/s^2", bounds=(0.0, 30.0), tolerance=0.002, source="standard gravity, rounded"
    )
    air_density: float = param(
        1.2, "kg/m^3", bounds=(0.0, 10.0), tolerance=0.02, source="ISO 2533 at 20 degC"
    )
    air_viscosity: float = param(
        1.81e-5, "Pa s", bounds=(1e-7, 1e-2), tolerance=5e-7, source="Sutherland 1893 at 20 degC"
    )
    water_level: float | None = optional("m", bounds=_PLACE, source=_CHOSEN)
    tank_bottom: float | None = optional("m", bounds=_PLACE, source=_CHOSEN)
    ground_level: float | None = optional("m", bounds=_PLACE, source=_CHOSEN)
    # rows of two numbers: a nested float type would refuse the whole number 0 for 0.0
    water_temperature: list[Any] = field(default_factory=lambda: [[0.0, 20.0]])
    salinity: list[Any] = field(default_factory=lambda: [[0.0, 0.0]])
    water_density: float | None = optional("kg/m^3", bounds=(100.0, 20000.0), source=_CHOSEN)
    restitution: float = param(
        0.0, "1", bounds=(0.0, 1.0), tolerance=0.1, source=_CHOSEN, fit=False
    )
    friction: float = param(0.5, "1", bounds=(0.0, 10.0), tolerance=0.2, source=_CHOSEN, fit=False)
    shore: ShoreSettings = field(default_factory=ShoreSettings)
    # entries become ObstacleSettings when the run is built
    obstacles: dict[str, Any] = field(default_factory=dict)
    terrain: TerrainSettings = field(default_factory=TerrainSettings, metadata=LATER)


def check_ground(environment: EnvironmentSettings) -> None:
    """Refuse a shore or obstacles that cannot be built.

    Raises:
        ConfigError: a level is missing, or a size does not fit its type.
    """
    e = environment
    _check_shore(e.shore, bottom=e.tank_bottom, water=e.water_level, land=e.ground_level)
    # refuse obstacles whose size does not fit their type
    for name, obstacle in e.obstacles.items():
        need = SIZES[obstacle.type]
        if len(obstacle.size) != need:
            raise ConfigError(
                f"environment.obstacles.{name}: {obstacle.type.value} has the size "
                f"{list(obstacle.size)}.\nAllowed: {need} numbers "
                "(box edges x, y, z; cylinder radius, length; sphere radius)."
            )


def check_profiles(environment: EnvironmentSettings) -> None:
    """Refuse water profiles that are not rows of depth and value with rising depth.

    Raises:
        ConfigError: a profile is malformed or physically out of range.
    """
    for key, low, high, unit in (
        ("water_temperature", -5, 100, "degC"),
        ("salinity", 0, 300, "g/kg"),
    ):
        where = f"environment.{key}"
        given = getattr(environment, key)
        try:
            rows = read(list[tuple[float, float]], given, where=where)
        except ConfigError:
            rows = []
        if not rows or not all(
            above < below for above, below in itertools.pairwise([depth for depth, _ in rows])
        ):
            raise ConfigError(
                f"{where}={given} is not a profile.\n"
                f"Allowed: rows [depth m, value {unit}] with increasing depth, for instance "
                "[[0, 10]]."
            )
        if not all(low <= value <= high for _, value in rows):
            raise ConfigError(f"{where}={given} is out of range.\nAllowed: {low} to {high} {unit}.")
