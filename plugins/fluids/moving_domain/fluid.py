"""Water as particles in a moving domain that follows the robot through an open sea."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from seals.environment.ground_settings import ObstacleSettings
from seals.environment.settings import EnvironmentSettings
from seals.fluid import FluidBody, Surrounding
from seals.plugins.fluids.coupling import ParticleFluid
from seals.plugins.fluids.moving_domain.box import Box
from seals.plugins.fluids.moving_domain.outer_sea import OuterSea
from seals.plugins.fluids.moving_domain.refusals import refuse_box, refuse_ground, refuse_sea
from seals.plugins.fluids.moving_domain.simulation import MovingDomain
from seals.plugins.fluids.sampling import reach_of
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.schema import count, setting, vector

_CHOSEN = "chosen"
WIDE = 2.0
"""Width of the water inside of the ring over that of the followed body, where none is set [1]."""
MACH = 10.0
"""Speed of sound over that of the fastest long wave on water of the window's depth [1]."""


@dataclass(kw_only=True)
class FluidWindow(ParticleFluid):
    """Water as particles in a moving domain that follows the robot through an open sea.

    Equation:
        Water as in `FluidParticles`. Sides and floor are where the outer sea has carried them,
        x = X + U t + xi(X, t), with the displacement xi of the waves and the current U; in a ring
        along the sides v <- v + (u - v)(1 - exp(-rate w h)), u of the outer sea,
        w = (exp(s^3.5) - 1) / (e - 1), s from 0 at its inner edge to 1 at the side.

    Args:
        spacing: of the particles at rest [m]; the nearest one that divides the depth is taken.
        size: length (x), width (y) and depth of the window [m]; a length or width of 0 is twice
            that of the body that the window follows, or the depth if that is more, and a ring and a
            cell on both sides. Down to ``environment.tank_bottom`` where that is less deep.
        freeboard: height of the sides above the water [m].
        ring: width of the relaxation ring, in spacings.
        cell: by which the window moves, in spacings, once the robot has come so far.
        rate: of relaxation at the sides [1/s].
        relaxations: substeps after a shift in which only places change, so that what was cut and
            added is as dense as the rest; 0 leaves it to the next step.
        lag: time constant of the level controller [s].
        current: east and north [m/s].

    Assumptions:
        The outer sea is that of ``wave``: sums of linear waves, undisturbed by the robot. The
        first body of the robot is the one that the window follows. Air pushes nothing.

    Valid range:
        Waves of eight spacings and more; steepness k a below 0.2. Robots that fit inside of the
        ring with a cell to spare.

    Limitations:
        The window moves with the orbits of its waves as a whole, so it must hold the robot also
        when waves carry the two apart by their height. What the robot radiates ends in the ring,
        so the window should be some times as wide as the robot: the water that it pushes aside has
        to pass between it and the sides. The default size knows of the followed body alone, of no
        arms and no depth of a dive. A shift sends a small pulse of sound through the window, see
        `experiments/open_sea`. An irregular sea of many components costs more than the particles.
        No obstacles, no shore. The limits of `FluidParticles`.

    References:
        Jacobsen, Fuhrman and Fredsoe 2012, doi:10.1002/fld.2726, for the weight of the ring;
        those of `FluidParticles`.

    Example:
        >>> FluidWindow(spacing=0.05).name
        'window'
    """

    size: list[float] = vector((0.0, 0.0, 0.8), "m", bounds=(0.0, 1e3), source=_CHOSEN)
    freeboard: float = setting(0.3, "m", bounds=(0.0, 1e3), source=_CHOSEN)
    physics: PbfSettings = field(default_factory=PbfSettings)
    ring: int = count(5, bounds=(1, 1000))
    cell: int = count(1, bounds=(1, 100))
    rate: float = setting(300.0, "1/s", bounds=(0.0, 1e4), source="measured on shifts")
    relaxations: int = count(4, bounds=(0, 100))
    lag: float = setting(0.1, "s", bounds=(1e-3, 1e3), source=_CHOSEN)
    current: list[float] = vector((0.0, 0.0), "m/s", bounds=(-10.0, 10.0), source=_CHOSEN)

    name: ClassVar[str] = "window"

    def solids(self, environment: EnvironmentSettings) -> Mapping[str, ObstacleSettings]:
        """Return an empty list: an open sea has no walls."""
        return {}

    def box(self, environment: EnvironmentSettings, reach: float = 0.0) -> Box:
        """Return the box of the domain in an environment.

        Args:
            environment: its level, floor and gravity.
            reach: of the followed body about its reference point [m]; for sides that are not set.

        Raises:
            ConfigError: a side is too short for the ring, or the ring too thin.
        """
        level = float(environment.water_level or 0.0)
        bottom = environment.tank_bottom
        depth = self.size[2] if bottom is None else min(self.size[2], level - bottom)
        ample = max(2.0 * WIDE * reach, depth) + 2 * (self.ring + self.cell) * self.spacing
        length, width = (side or ample for side in self.size[:2])
        refuse_box(self.spacing, (length, width, depth), self.ring)
        d = depth / round(depth / self.spacing)
        counts = (round(length / d), round(width / d), round(depth / d))
        half = 0.5 * d * np.array(counts)
        lower = np.array([-half[0], -half[1], level - depth])
        squeeze = environment.gravity / self._sound(environment.gravity, depth) ** 2
        return Box(d, lower, counts, self.ring, self.cell, self.freeboard, squeeze)

    def _sound(self, gravity: float, depth: float) -> float:
        """Speed of sound: it must not change with the height of a splash [m/s]."""
        return self.physics.sound_speed or MACH * math.sqrt(gravity * depth)

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Create the domain and its boundaries."""
        e = around.environment
        reach = reach_of(bodies[0].pieces, self.spacing, self.thin) if bodies else 0.0
        box = self.box(e, reach)
        refuse_ground(e, around.solids)
        level = float(e.water_level or 0.0)
        outer = OuterSea(around.waves, level, (self.current[0], self.current[1]))
        refuse_sea(outer, box, floor=e.tank_bottom)
        physics = self._physics(e, sound_speed=self._sound(e.gravity, box.depth))
        self._simulation = MovingDomain(self, box, outer, physics, bodies)
