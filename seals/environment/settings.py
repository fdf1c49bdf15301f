"""Typed environment of a run: gravity, air, water and ground."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

from seals.environment.ground_settings import ShoreSettings, check_obstacles, check_shore
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.schema import optional, param, read

_CHOSEN = "chosen"
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
        obstacles: further solids that stand still, by name.
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


def check_ground(environment: EnvironmentSettings) -> None:
    """Refuse a shore or obstacles that cannot be built.

    Raises:
        ConfigError: a level is missing, or a size does not fit its type.
    """
    e = environment
    check_shore(e.shore, bottom=e.tank_bottom, water=e.water_level, land=e.ground_level)
    check_obstacles(e.obstacles)


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
        if not rows or not _rising([depth for depth, _ in rows]):
            raise ConfigError(
                f"{where}={given} is not a profile.\n"
                f"Allowed: rows [depth m, value {unit}] with rising depth, for instance [[0, 10]]."
            )
        if not all(low <= value <= high for _, value in rows):
            raise ConfigError(f"{where}={given} is out of range.\nAllowed: {low} to {high} {unit}.")


def _rising(depths: list[float]) -> bool:
    return all(above < below for above, below in itertools.pairwise(depths))
