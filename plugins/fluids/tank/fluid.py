"""Water as particles, by position-based dynamics, coupled with bodies both ways."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats
from seals.environment.ground_settings import ObstacleSettings
from seals.environment.settings import EnvironmentSettings
from seals.environment.surroundings import WaterColumn
from seals.environment.waves import Sea
from seals.errors import ConfigError
from seals.fluid import BodyStates, Books, FluidBody, Surrounding
from seals.plugins.fluids.coupling import ACCOUNTS
from seals.plugins.fluids.pbd.settings import PbdSettings
from seals.plugins.fluids.sampling import Thin
from seals.plugins.fluids.tank.basin import Basin, build_basin, walls_of
from seals.plugins.fluids.tank.pool import Pool, paddle_of
from seals.plugins.fluids.tank.settings import (
    BeachSettings,
    Device,
    MakerSettings,
    TideSettings,
    WindSettings,
)
from seals.schema import param, vector

_CHOSEN = "chosen"


@dataclass(kw_only=True)
class FluidParticles:
    """Water as particles in a basin, by position-based dynamics, coupled with bodies both ways.

    Equation:
        Density constraint of Macklin and Mueller 2013 with compliance; bodies as samples with
        volumes (Akinci et al. 2012), their mass and inertia inside the iterations. The basin is
        filled to ``environment.water_level``; its floor is ``environment.tank_bottom``, else the
        depth is ``size[2]``.

    Args:
        spacing: of the particles at rest [m]; the nearest one that divides the depth is taken.
        size: length (x), width (y) and depth of the water [m].
        centre: of the basin, east and north [m].
        freeboard: room above the water in which particles may fly [m].
        substeps: of the fluid in a step of the world; 0 takes as many as its speed of sound asks.
        physics: numbers of the fluid itself; density and gravity are those of the environment.
        device: cpu or cuda.
        threads: on the cpu; 0 for all that this process may use.
        most: particles and boundary samples allowed before anything is allocated.
        thin: what parts of bodies thinner than a spacing stand for: their volume, or a layer.
        open_sides: sides without a wall (x_low, x_high, y_low, y_high): particles that leave there
            are gone, and counted.
        maker: of waves, in place of the wall at low x.
        beach: that takes waves in, at high x.
        tide: slow change of the mean level.
        wind: over the water.
        gauges: of the surface height, by name, each [east, north] in m.
        look: time between two looks at the surface [s].
        settle: for how long the water comes to rest around held bodies before the first step [s].

    Assumptions:
        Air pushes nothing. A particle is a blob of water of the size of its spacing.

    Valid range:
        Bodies of ten spacings and more for forces within 5 %; two spacings at least.

    Limitations:
        The smallest whirls and the boundary layer are not there: of drag, the part that pressure
        makes on the scale of the spacing is; friction and the drag of thin parts are not. The
        viscosity of the method keeps the effective Reynolds number at some hundreds. Add what is
        missing as an effect with ``correction: true``. No cavity pressure, no air
        cushion. The basin stands still and is alone: ``wave`` must be still, a paddle has no solid
        that bodies touch.

    References:
        Macklin and Mueller 2013, doi:10.1145/2461912.2461984; Akinci et al. 2012,
        doi:10.1145/2185520.2185558; Macklin et al. 2014, doi:10.1145/2601097.2601152.

    Example:
        >>> FluidParticles(spacing=0.05).name
        'particles'
    """

    spacing: float = param(0.04, "m", bounds=(1e-3, 5.0), tolerance=0.0, source=_CHOSEN, fit=False)
    size: list[float] = vector((1.2, 1.2, 0.8), "m", bounds=(0.01, 1e3), source=_CHOSEN)
    centre: list[float] = vector((0.0, 0.0), "m", bounds=(-1e5, 1e5), source=_CHOSEN)
    freeboard: float = param(0.6, "m", bounds=(0.0, 1e3), tolerance=0.0, source=_CHOSEN, fit=False)
    substeps: int = 0
    physics: PbdSettings = field(default_factory=PbdSettings)
    device: Device = Device.cpu
    threads: int = 0
    most: int = 2_000_000
    thin: Thin = Thin.volume
    open_sides: list[str] = field(default_factory=list)
    maker: MakerSettings = field(default_factory=MakerSettings)
    beach: BeachSettings = field(default_factory=BeachSettings)
    tide: TideSettings = field(default_factory=TideSettings)
    wind: WindSettings = field(default_factory=WindSettings)
    gauges: dict[str, list[float]] = field(default_factory=dict)
    look: float = param(0.02, "s", bounds=(0.0, 10.0), tolerance=0.0, source=_CHOSEN, fit=False)
    settle: float = param(0.0, "s", bounds=(0.0, 60.0), tolerance=0.0, source=_CHOSEN, fit=False)

    name: ClassVar[str] = "particles"
    accounts_for: ClassVar[tuple[str, ...]] = ACCOUNTS

    def __post_init__(self) -> None:
        """Refuse counts that mean nothing; nothing is allocated yet."""
        if self.substeps < 0 or self.most < 1:
            raise ConfigError(
                f"substeps={self.substeps}, most={self.most} are not allowed.\n"
                "Allowed: substeps 0 (chosen by the speed of sound) or more, most 1 or more."
            )
        for name, place in self.gauges.items():
            if len(place) != 2:
                raise ConfigError(
                    f"gauges.{name}={place} is no place.\nAllowed: [east, north] in m."
                )
        self._pool: Pool | None = None

    @property
    def pool(self) -> Pool:
        """The water itself, once opened."""
        if self._pool is None:
            raise ConfigError("the particle water is not open.\nIt opens with its world.")
        return self._pool

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
        """Prepare the basin and the boundaries."""
        environment = around.environment
        if around.waves.at(np.zeros((1, 3)), np.zeros((1, 1)), 0.0).normal is not None:
            raise ConfigError(
                "wave: the sea around a basin of particles is still.\n"
                "Leave wave out and make waves in the basin: fluid.maker.kind=piston"
            )
        column = WaterColumn.of_profiles(
            environment.water_temperature, environment.salinity, environment.water_density
        )
        physics = dataclasses.replace(
            self.physics,
            density=float(column.density[0]),
            gravity=environment.gravity,
            outflow=bool(self.open_sides) or self.physics.outflow,
        )
        self._pool = Pool(self, self._basin(environment), physics, around, bodies)

    def fill(self, states: BodyStates) -> None:
        """Put the water at rest around the bodies."""
        self.pool.fill(states)

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance; return the impulses on the bodies [N s, N m s], shape (K, 6)."""
        return self.pool.exchange(states, time, step)

    def surface(self, position: Array) -> Sea:
        """Return the surface over points, as known from the last look."""
        heights = self.pool.heights.at(np.asarray(position, dtype=float))
        return Sea(heights[:, None], None, None, None, None)

    def books(self) -> Books | None:
        """Return the momentum of the last step."""
        return self.pool.last

    def figures(self) -> Mapping[str, float]:
        """Return particles, compression, losses and gauges."""
        return self.pool.figures()

    def particles(self) -> tuple[Floats, Floats]:
        """Return places and velocities."""
        return self.pool.water.positions(), self.pool.water.velocities()

    def snapshot(self) -> Any:
        """Return a copy of everything that changes."""
        return self.pool.snapshot()

    def restore(self, kept: Any) -> None:
        """Put a snapshot back."""
        self.pool.restore(kept)

    def close(self) -> None:
        """Free the memory."""
        if self._pool is not None:
            self._pool.water.close()
            self._pool = None
