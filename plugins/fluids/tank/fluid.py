"""Fluid plug-in of the tank."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from seals.environment.ground_settings import ObstacleSettings
from seals.environment.settings import EnvironmentSettings
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.fluid import FluidBody, Surrounding
from seals.plugins.fluids.coupling import ParticleFluid
from seals.plugins.fluids.solvers.pbf.settings import PbfSettings
from seals.plugins.fluids.tank.basin import Basin, build_basin, walls_of
from seals.plugins.fluids.tank.settings import (
    BeachSettings,
    MakerSettings,
    TideSettings,
    WindSettings,
)
from seals.plugins.fluids.tank.simulation import TankSimulation, paddle_of
from seals.schema import setting, vector

_CHOSEN = "chosen"


@roles(data="open_sides gauges")
@dataclass(kw_only=True)
class FluidParticles(ParticleFluid):
    """Water as particles in a tank, two-way coupled with bodies.

    Equation:
        Density constraint of Macklin and Mueller 2013 with compliance (XPBD), or with
        ``solver=dfsph`` constant density and zero divergence (Bender and Koschier 2015); bodies as
        samples with volumes (Akinci et al. 2012), their mass and inertia in the iterations. It is
        filled to ``environment.water_level``; its floor is ``environment.tank_bottom``, else the
        depth is ``size[2]``.

    Args:
        spacing: of the particles at rest [m]; the nearest one that divides the depth is taken.
        size: length (x), width (y) and depth of the water [m].
        centre: of the basin, east and north [m].
        freeboard: room above the water in which particles may fly [m].
        open_sides: sides without a wall (x_low, x_high, y_low, y_high): particles that leave there
            are gone, and counted.
        maker: of waves, in place of the wall at low x.
        beach: sponge layer at high x.
        tide: slow change of the mean level.
        wind: over the water.
        gauges: of the surface height, by name, each [east, north] in m.
        settle: for how long the water comes to rest around held bodies before the first step [s].

    Assumptions:
        No air: it exerts no force. A particle is a blob of water of the size of its spacing.

    Valid range:
        Bodies of ten spacings and more for forces within 5 %; two spacings at least.

    Limitations:
        Eddies below the spacing and the boundary layer are not resolved: pressure drag on the scale
        of the spacing is there; friction and the drag of thin parts are not. The
        viscosity of the method keeps the effective Reynolds number at some hundreds. Add what is
        missing as an effect with ``correction: true``. No cavity pressure, no air
        cushion. The basin stands still and is alone: ``wave`` must be still, a paddle has no solid
        that bodies touch.

    References:
        Macklin and Mueller 2013, doi:10.1145/2461912.2461984; Akinci et al. 2012,
        doi:10.1145/2185520.2185558; Macklin et al. 2014, doi:10.1145/2601097.2601152; Bender and
        Koschier 2015, doi:10.1145/2786784.2786796.

    Example:
        >>> FluidParticles(spacing=0.05).name
        'particles'
    """

    spacing: float = setting(0.04, "m", bounds=(1e-3, 5.0), source=_CHOSEN)
    physics: PbfSettings = field(default_factory=PbfSettings)
    centre: list[float] = vector((0.0, 0.0), "m", bounds=(-1e5, 1e5), source=_CHOSEN)
    open_sides: list[str] = field(default_factory=list)
    maker: MakerSettings = field(default_factory=MakerSettings)
    beach: BeachSettings = field(default_factory=BeachSettings)
    tide: TideSettings = field(default_factory=TideSettings)
    wind: WindSettings = field(default_factory=WindSettings)
    gauges: dict[str, list[float]] = field(default_factory=dict)
    settle: float = setting(0.0, "s", bounds=(0.0, 60.0), source=_CHOSEN)

    name: ClassVar[str] = "particles"

    def __post_init__(self) -> None:
        """Check counts and gauges; nothing is allocated yet."""
        super().__post_init__()
        for name, place in self.gauges.items():
            if len(place) != 2:
                raise ConfigError(
                    f"gauges.{name}={place} is not a position.\nAllowed: [east, north] in m."
                )
        if -self.maker.start > self.settle:
            raise ConfigError(
                f"maker.start={self.maker.start:g} s is before the water settles "
                f"(settle={self.settle:g} s).\nUse settle={1.0 - self.maker.start:g} or more."
            )

    def solids(self, environment: EnvironmentSettings) -> Mapping[str, ObstacleSettings]:
        """Return walls and floor of the basin."""
        return walls_of(self._basin(environment))

    def _basin(self, environment: EnvironmentSettings) -> Basin:
        """Sizes of the basin in a given environment."""
        paddle = paddle_of(self, environment)
        return build_basin(
            spacing=self.spacing,
            size=self.size,
            centre=self.centre,
            level=float(environment.water_level or 0.0),
            bottom=environment.tank_bottom,
            freeboard=self.freeboard,
            behind=0.0 if paddle is None else paddle.travel + 4.0 * self.spacing,
            open_sides=self.open_sides,
        )

    def open(self, around: Surrounding, bodies: Sequence[FluidBody]) -> None:
        """Create the basin and its boundaries."""
        environment = around.environment
        if around.waves.at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0).normal is not None:
            raise ConfigError(
                "wave: the sea around a basin of particles is still.\n"
                "Leave wave out and make waves in the basin: fluid.maker.kind=piston"
            )
        outflow = bool(self.open_sides) or self.physics.outflow
        physics = self._physics(environment, outflow=outflow)
        self._simulation = TankSimulation(self, self._basin(environment), physics, around, bodies)
