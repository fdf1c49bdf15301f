"""Sampling of air and water at the links: submersion, density, flow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seals.arrays import Array, Floats, as_like, namespace
from seals.environment.sample import Sample
from seals.environment.seawater import density_of, viscosity_of
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves, carried
from seals.environment.wetting import POINT_RADIUS, Wetting, WettingExact, WettingNone, WettingTable
from seals.frames import FEW, cross, unrotate
from seals.hydrostatics import Hull, HullSphere, HullTable
from seals.motion import Motion
from seals.robot.model import RobotModel


@dataclass(frozen=True, kw_only=True)
class WaterColumn:
    """Density and viscosity against depth, piecewise linear.

    Args:
        depth: increasing, first 0 [m], shape (K,).
        density: [kg/m^3], shape (K,).
        viscosity: [Pa s], shape (K,).
    """

    depth: Floats
    density: Floats
    viscosity: Floats

    @staticmethod
    def of_profiles(
        temperature: Sequence[Sequence[float]],
        salinity: Sequence[Sequence[float]],
        density: float | None,
    ) -> WaterColumn:
        """Build the column from rows [depth m, degC] and [depth m, g/kg].

        A stated density [kg/m^3] rules over them.
        """
        t, s = (np.atleast_2d(np.asarray(rows, dtype=float)) for rows in (temperature, salinity))
        depth = np.unique(np.concatenate([[0.0], t[:, 0], s[:, 0]]))
        warm, salt = np.interp(depth, t[:, 0], t[:, 1]), np.interp(depth, s[:, 0], s[:, 1])
        rho = density_of(warm, salt) if density is None else np.full(depth.shape, density)
        return WaterColumn(depth=depth, density=rho, viscosity=viscosity_of(warm, salt))


class EnvironmentSampler:
    """Sampler of air, water and waves at the links of one scene or batch.

    Args:
        gravity: [m/s^2].
        air_density: [kg/m^3].
        air_viscosity: [Pa s].
        water_level: mean surface height in the world [m], None without water.
        column: density and viscosity of the water.
        waves: motion of the surface and of the water.
        wetting: submerged parts of the hulls.
        volume: displaced volume of every row when submerged [m^3], shape (N, 1).
        bottom: height of the level bottom under the water [m]; None for none.
    """

    def __init__(
        self,
        *,
        gravity: float,
        air_density: float,
        air_viscosity: float,
        water_level: float | None,
        column: WaterColumn,
        waves: Waves,
        wetting: Wetting,
        volume: Array,
        bottom: float | None = None,
    ) -> None:
        self.water_level, self.waves, self.wetting = water_level, waves, wetting
        self.volume, self.bottom = volume, bottom
        self._constants = {
            name: as_like([[value]], volume)
            for name, value in {
                "gravity": gravity,
                "air_density": air_density,
                "air_viscosity": air_viscosity,
                "one": 1.0,
                "zero": 0.0,
            }.items()
        }
        self._none = as_like(np.zeros((1, 3)), volume)
        self._density = _Profile(column.depth, column.density, volume)
        self._viscosity = _Profile(column.depth, column.viscosity, volume)
        self._wet_volume: Array = None
        self._share: Array = None
        self._inverse_volume = 1.0 / namespace(volume).clip(volume, 1e-12, None)

    @property
    def air_density(self) -> Array:
        """Density of the air [kg/m^3], shape (1, 1)."""
        return self._constants["air_density"]

    def water_at(self, places: Array, time: Array) -> tuple[Array | None, Array, Array]:
        """Return depth, velocity and density of the water at places, without flow effects.

        Args:
            places: world [m], shape (N, 3).
            time: [s], shape (1 or N, 1).

        Returns:
            Depth below the surface [m], shape (N, 1), None without water; velocity of the waves in
            the world [m/s], shape (N, 3); density [kg/m^3], shape (N or 1, 1).
        """
        none = 0.0 * places
        if self.water_level is None:
            return None, none, self._constants["zero"]
        sea = self.waves.at(places, time, self.water_level)
        depth = sea.elevation - places[:, 2:3]
        return depth, none if sea.velocity is None else sea.velocity, self._density.at(depth)

    def sample(self, motion: Motion) -> Sample:
        """Sample air and water at the links, without flow effects such as wind and current."""
        if self.water_level is None:
            # sample where there is no water
            zero, none = self._constants["zero"], self._none
            return Sample(
                submersion=zero,
                submersion_rate=zero,
                buoyancy_centre=none,
                normal=motion.up,
                sinking_speed=zero,
                gravity=self._constants["gravity"],
                water_velocity=none,
                water_acceleration=none,
                water_density=zero,
                water_viscosity=zero,
                air_velocity=self._none,
                air_density=self._constants["air_density"],
                air_viscosity=self._constants["air_viscosity"],
                one=self._constants["one"],
            )
        sea = self.waves.at(motion.position, motion.time, self.water_level)
        normal = motion.up if sea.normal is None else unrotate(motion.rotation, sea.normal)
        height = sea.elevation - motion.position[:, 2:3]
        level = height if sea.normal is None else height * sea.normal[:, 2:3]
        wet = self.wetting.wet(normal, level)
        sinking = -_dot(motion.velocity, normal)
        if sea.rise is not None:
            sinking = sinking + sea.rise
        rate = self._constants["zero"]
        if wet.area is not None:
            turning = _dot(cross(motion.angular_velocity, wet.area_centre), normal)
            rate = (sinking - turning) * wet.area * self._inverse_volume
        depth = height if sea.normal is None else self.water_level - motion.position[:, 2:3]
        if wet.volume is not self._wet_volume:
            # those of the dry and of the submerged state are the very same arrays every time
            self._wet_volume, self._share = wet.volume, wet.volume * self._inverse_volume
        felt = sea.acceleration
        if felt is not None and sea.gradient is not None:
            # acceleration of the water along the path of the point, world axes [m/s^2]
            felt = felt + carried(sea.gradient, sea.velocity)
        return Sample(
            submersion=self._share,
            submersion_rate=rate,
            buoyancy_centre=wet.centre,
            normal=normal,
            sinking_speed=sinking,
            gravity=self._constants["gravity"],
            water_velocity=self._none
            if sea.velocity is None
            else unrotate(motion.rotation, sea.velocity),
            water_acceleration=self._none if felt is None else unrotate(motion.rotation, felt),
            water_density=self._density.at(depth),
            water_viscosity=self._viscosity.at(depth),
            air_velocity=self._none,
            air_density=self._constants["air_density"],
            air_viscosity=self._constants["air_viscosity"],
            one=self._constants["one"],
            depth=height,
            water_gradient=sea.gradient,
        )


class _Profile:
    """Piecewise-linear function of depth on any array library.

    It is constant below the last node and above the first.
    """

    def __init__(self, depth: Floats, value: Floats, like: Array) -> None:
        self._first = as_like([[value[0]]], like)
        steps = zip(depth[:-1], np.diff(depth), np.diff(value), strict=True)
        self._pieces = [(float(d), float(h), float(v / h)) for d, h, v in steps if v != 0.0]

    def at(self, depth: Array) -> Array:
        """Return the value at ``depth`` [m], shape (N, 1) or (1, 1) when constant."""
        value = self._first
        for start, width, slope in self._pieces:
            value = value + slope * namespace(depth).clip(depth - start, 0.0, width)
        return value


def _dot(a: Array, b: Array) -> Array:
    """Inner products of rows, shape (N, 1)."""
    if type(a) is np.ndarray and type(b) is np.ndarray and len(a) == len(b) < FEW:
        return np.vecdot(a, b)[:, None]
    product = a * b
    return product[:, 0:1] + product[:, 1:2] + product[:, 2:3]


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
        bottom=environment.tank_bottom,
    )
