"""Construction of a robot's environment sampler from the environment settings."""

from __future__ import annotations

import numpy as np

from seals.arrays import Array, as_like
from seals.environment.sampler import EnvironmentSampler, WaterColumn
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.environment.wetting import POINT_RADIUS, Wetting, WettingExact, WettingNone, WettingTable
from seals.hydrostatics import Hull, HullSphere, HullTable
from seals.robot.model import RobotModel


def hulls_of(robot: RobotModel) -> list[Hull]:
    """Return one hull per link.

    A small sphere at the origin tells whether a link without hull is wet.
    """
    return [HullSphere(radius=POINT_RADIUS) if hull is None else hull for hull in robot.hulls]


def exact_of(robot: RobotModel, environment: EnvironmentSettings) -> Wetting:
    """Return exact hull clipping for the links of one scene."""
    return WettingNone() if environment.water_level is None else WettingExact(hulls_of(robot))


def tables_of(robot: RobotModel, environment: EnvironmentSettings) -> Wetting:
    """Return hull interpolation tables for a batch."""
    if environment.water_level is None:
        return WettingNone()
    hulls = hulls_of(robot)
    reach = [float(hull.reach) for hull in hulls]
    return WettingTable([HullTable.build(hull) for hull in hulls], reach=reach)


def build_surroundings(
    robot: RobotModel,
    environment: EnvironmentSettings,
    waves: Waves,
    wetting: Wetting,
    *,
    like: Array,
    batch: int = 1,
) -> EnvironmentSampler:
    """Return the environment sampler of all links, in the array library of ``like``."""
    volume = np.repeat([[hull.volume] for hull in hulls_of(robot)], batch, axis=0)
    column = WaterColumn.of_profiles(
        environment.water_temperature, environment.salinity, environment.water_density
    )
    return EnvironmentSampler(
        gravity=environment.gravity,
        air_density=environment.air_density,
        air_viscosity=environment.air_viscosity,
        water_level=environment.water_level,
        column=column,
        waves=waves,
        wetting=wetting,
        volume=as_like(volume[:1] if len(robot.links) == 1 else volume, like),
    )
