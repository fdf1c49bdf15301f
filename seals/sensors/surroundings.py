"""Water, ground and other bodies around a sensor, computed on demand."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from seals.arrays import Floats
from seals.environment.ground import solids_of
from seals.environment.sampler import WaterColumn
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Waves
from seals.sensors.acoustics import sound_speed
from seals.sensors.rays import Shape, distances, shape_of_solid

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
# cubed nodes crowd at the surface, where the waves' motion is
_CUBED = (0.5 * (_NODES + 1.0)) ** 3
_SHARES = 1.5 * _WEIGHTS * (0.5 * (_NODES + 1.0)) ** 2
_SAMPLES = 65
"""Points on a ray between which the water surface is looked for."""
_HALVINGS = 30


class Surroundings:
    """Surroundings of a sensor, computed on demand.

    Args:
        environment: levels, water, ground.
        waves: motion of the water surface; None for still water.

    Attributes:
        bodies: shapes of the scene's other bodies as they stand now.
        ground: shapes of ground, shore and obstacles.
        ground_names: their names.
    """

    def __init__(self, environment: EnvironmentSettings, waves: Waves | None = None) -> None:
        e = environment
        self.level, self.gravity, self.waves = e.water_level, e.gravity, waves
        solids = solids_of(e)
        self.ground = [shape_of_solid(solid) for solid in solids]
        self.ground_names = tuple(solid.name for solid in solids)
        profiles = (e.water_temperature, e.salinity)
        self._warmth, self._salt = (np.atleast_2d(np.asarray(p, dtype=float)) for p in profiles)
        self.bodies: Callable[[], Sequence[Shape]] = tuple
        column = WaterColumn.of_profiles(e.water_temperature, e.salinity, e.water_density)
        self._depths, self._densities = column.depth, column.density
        slabs = 0.5 * np.diff(self._depths) * (self._densities[1:] + self._densities[:-1])
        self._loads = np.concatenate([[0.0], np.cumsum(slabs)])

    def surface(self, time: float, points: Floats) -> Floats:
        """Return the height of the water surface above or below points, world z [m], shape (n,).

        It is minus infinity without water.
        """
        if self.level is None:
            return np.full(len(points), -math.inf)
        if self.waves is None:
            return np.full(len(points), self.level)
        sea = self.waves.at(points, np.array([[time]]), self.level)
        return np.broadcast_to(np.reshape(sea.elevation, -1), len(points))

    def wet(self, time: float, point: Floats) -> bool:
        """Return whether a point is under the local water surface."""
        return bool(point[2] < self.surface(time, point[None])[0])

    def density(self, depth: float) -> float:
        """Return the density of the water at a depth [kg/m^3]."""
        return float(np.interp(depth, self._depths, self._densities))

    def temperature(self, depth: float) -> float:
        """Return the temperature of the water at a depth [degC]."""
        return float(np.interp(depth, self._warmth[:, 0], self._warmth[:, 1]))

    def salinity(self, depth: float) -> float:
        """Return the salinity of the water at a depth [g/kg]."""
        return float(np.interp(depth, self._salt[:, 0], self._salt[:, 1]))

    def sound(self, time: float, here: Floats, there: Floats, farthest: float) -> float | None:
        """Return the speed of sound half-way between two points [m/s]; None where none arrives.

        Both are under water, nothing stands between them, and they are no farther apart.

        Args:
            time: [s].
            here: world [m], shape (3,).
            there: likewise.
            farthest: range [m].
        """
        offset, middle = there - here, 0.5 * (there + here)
        way = float(np.linalg.norm(offset))
        if not 0.0 < way <= farthest or not (self.wet(time, here) and self.wet(time, there)):
            return None
        if self.ground_ahead(here, offset[None] / way)[0] < way * (1.0 - 1e-9):
            return None
        depth = max(float(self.surface(time, middle[None])[0]) - float(middle[2]), 0.0)
        warm, salt = self.temperature(depth), self.salinity(depth)
        return sound_speed(temperature=warm, salinity=salt, depth=depth)

    def pressure(self, time: float, point: Floats) -> float:
        """Return the pressure above that of the air [Pa]; zero out of the water.

        Equation:
            p = integral from z to the local surface eta of rho (g + a_z(z' - eta)) dz', a_z the
            vertical acceleration of the water as far below its mean level: the vertical component
            of Euler's equation, stretched (Wheeler 1970) so that waves fade with depth.

        In linear waves on deep water this is rho g (-z + eta exp(k (z - eta))).
        """
        if self.level is None:
            return 0.0
        now, height, moves = np.array([[time]]), self.level, False
        if self.waves is not None:
            sea = self.waves.at(point[None], now, self.level)
            height, moves = float(np.reshape(sea.elevation, -1)[0]), sea.acceleration is not None
        depth = height - float(point[2])
        if not depth > 0.0:
            return 0.0
        if len(self._depths) == 1:
            load = depth * float(self._densities[0])
        else:
            k = int(np.searchsorted(self._depths, depth, side="right")) - 1
            above, density = float(self._depths[k]), float(self._densities[k])
            part = 0.5 * (depth - above) * (density + self.density(depth))
            load = float(self._loads[k]) + part
        still = self.gravity * load
        if not moves or self.waves is None:
            return still
        points = np.repeat(point[None], len(_CUBED), axis=0)
        points[:, 2] = self.level - depth * _CUBED
        rise = np.asarray(self.waves.at(points, now, self.level).acceleration)[:, 2]
        dense = np.interp(depth * _CUBED, self._depths, self._densities)
        return still + depth * float(np.sum(_SHARES * dense * rise))

    def ground_ahead(self, origin: Floats, directions: Floats) -> Floats:
        """Return the distances of rays to ground, shore or obstacles [m], shape (n,).

        Args:
            origin: of all rays, world [m], shape (3,).
            directions: unit vectors, world axes, shape (n, 3); those that meet nothing run to
                infinity.
        """
        return _nearest(self.ground, origin, directions)

    def bodies_ahead(self, origin: Floats, directions: Floats) -> Floats:
        """Return the distances of rays to another body's hull [m], shape (n,)."""
        return _nearest(self.bodies(), origin, directions)

    def water(
        self,
        time: float,
        origin: Floats,
        directions: Floats,
        farthest: Floats,
        *,
        level: bool = False,
    ) -> Floats:
        """Return the distances of rays to the water surface, from either side [m].

        In waves the surface is looked for at points along the rays: a crest narrower than a
        sixtieth of their length may be missed.

        Args:
            time: [s].
            origin: of all rays, world [m], shape (3,).
            directions: unit vectors, world axes, shape (n, 3).
            farthest: length of every ray [m], shape (n,); infinity for those without a crossing.
            level: whether the surface counts as level, at its height above the origin: quick for
                thousands of rays in waves.
        """
        out = np.full(len(directions), math.inf)
        if self.level is None:
            return out
        if level or self._flat(time, origin):
            height = float(self.surface(time, origin[None])[0]) - float(origin[2])
            with np.errstate(divide="ignore", invalid="ignore"):
                way = height / directions[:, 2]
            return np.where((way >= 0.0) & (way <= farthest), way, math.inf)

        def under(along: Floats, ways: Floats) -> Any:
            points = (origin + along[..., None] * ways[:, None]).reshape(-1, 3)
            return np.reshape(points[:, 2] < self.surface(time, points), along.shape)

        along = farthest[:, None] * np.linspace(0.0, 1.0, _SAMPLES)
        side = under(along, directions)
        changed = side != side[:, :1]
        some = np.flatnonzero(changed.any(axis=1))
        if not len(some):
            return out
        first = np.argmax(changed[some], axis=1)
        low, high = along[some, first - 1][:, None], along[some, first][:, None]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            same = under(middle, directions[some]) == side[some, :1]
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        out[some] = 0.5 * (low + high)[:, 0]
        return out

    def _flat(self, time: float, point: Floats) -> bool:
        """Return whether the water is still."""
        if self.waves is None:
            return True
        assert self.level is not None
        return self.waves.at(point[None], np.array([[time]]), self.level).normal is None


def _nearest(shapes: Sequence[Shape], origin: Floats, directions: Floats) -> Floats:
    out = np.full(len(directions), math.inf)
    for shape in shapes:
        out = np.minimum(out, distances(shape, origin, directions))
    return out


def no_surroundings() -> Surroundings:
    """Return empty surroundings, without water and ground."""
    return Surroundings(EnvironmentSettings())
