"""The fluid plug-in of a particle domain: options and methods that all domains share."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar

import numpy as np

from seals.arrays import Array, Floats
from seals.environment.sampler import WaterColumn
from seals.environment.settings import EnvironmentSettings
from seals.environment.waves import Sea
from seals.errors import ConfigError
from seals.field_roles import roles
from seals.fluid import BodyStates, MomentumBalance
from seals.plugins.fluids.coupling.simulation import Simulation
from seals.plugins.fluids.sampling import Thin
from seals.plugins.fluids.solver import SolverSettings
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.plugins.fluids.solvers.dfsph.settings import DfsphOptions, DfsphSettings
from seals.schema import count, named, setting, vector

_CHOSEN = "chosen"


class Device(Enum):
    """Device on which the particles are computed."""

    cpu = "cpu"
    cuda = "cuda"


class Method(Enum):
    """Method by which the particles are kept at the density of water."""

    pbf = "pbf"
    """Position-based fluid: a fixed number of iterations, compressible by ``sound_speed``."""
    dfsph = "dfsph"
    """Divergence-free SPH: iterated to a stated compression, incompressible by default."""


@roles(data="solid_scale subgrid_drag")
@dataclass(kw_only=True)
class ParticleFluid:
    """Base of the particle fluids: water particles with two-way coupling to bodies.

    Args:
        spacing: of the particles at rest [m].
        size: length (x), width (y) and depth of the water [m].
        freeboard: room above the water [m].
        substeps: of the fluid in a step of the world; 0 derives them from the solver's stability;
            a window may then take several steps at once.
        solver: pbf or dfsph.
        physics: options of the solver; density and gravity are those of the environment.
        dfsph: further options of ``solver=dfsph``.
        device: cpu or cuda.
        threads: on the CPU; 0 for all that this process may use.
        most: particles and boundary samples allowed before anything is allocated.
        thin: treatment of parts thinner than a spacing: by their volume, or as a closed layer.
        solid_scale: weight s of a body's boundary volumes in the density [1], by robot or
            robot/link, on top of ``physics.solid_scale``.
        subgrid_drag: whether the drag that a robot states is added as far as the particles do not
            resolve it, in water without waves and current.
        look: time between two updates of the surface [s].
    """

    spacing: float = setting(0.05, "m", bounds=(1e-3, 5.0), source=_CHOSEN)
    size: list[float] = vector((1.2, 1.2, 0.8), "m", bounds=(0.01, 1e3), source=_CHOSEN)
    freeboard: float = setting(0.6, "m", bounds=(0.0, 1e3), source=_CHOSEN)
    substeps: int = count(0, bounds=(0, 10_000))
    solver: Method = Method.pbf
    physics: SolverSettings
    dfsph: DfsphOptions = field(default_factory=DfsphOptions)
    device: Device = Device.cpu
    threads: int = count(0, bounds=(0, 1024))
    most: int = count(2_000_000, bounds=(1, 10**9))
    thin: Thin = Thin.volume
    solid_scale: dict[str, float] = named("1", bounds=(0.1, 4.0), source="Macklin et al. 2014")
    subgrid_drag: bool = True
    look: float = setting(0.02, "s", bounds=(0.0, 10.0), source=_CHOSEN)

    name: ClassVar[str]
    accounts_for: ClassVar[tuple[str, ...]] = (
        "buoyancy",
        "centre of buoyancy",
        "added mass",
        "slamming",
        "linear drag",
        "quadratic drag",
        "angular drag",
        "lift",
        "radiation damping",
        "steady current",
    )

    def __post_init__(self) -> None:
        """Check the counts; nothing is allocated yet."""
        if self.substeps < 0 or self.most < 1:
            raise ConfigError(
                f"substeps={self.substeps}, most={self.most} are not allowed.\n"
                "Allowed: substeps 0 (chosen by the speed of sound) or more, most 1 or more."
            )
        self._simulation: Simulation | None = None
        self._time = 0.0

    @property
    def simulation(self) -> Any:
        """The simulation, once opened."""
        if self._simulation is None:
            raise ConfigError(f"fluid {self.name!r} is not open.\nIt is opened by its world.")
        return self._simulation

    def _physics(self, environment: EnvironmentSettings, **changes: Any) -> SolverSettings:
        """Options of the solver with density and gravity of the environment."""
        e = environment
        column = WaterColumn.of_profiles(e.water_temperature, e.salinity, e.water_density)
        density = float(column.density[0])
        chosen = self.physics
        if self.solver is Method.dfsph:
            if not isinstance(chosen, DeviceSettings):
                raise ConfigError(
                    f"solver=dfsph: {self.name!r} has a solver of its own, "
                    f"{type(chosen).__name__}.\nLeave solver out."
                )
            chosen = DfsphSettings.of(chosen, self.dfsph)
        return dataclasses.replace(chosen, density=density, gravity=e.gravity, **changes)

    def initialise(self, states: BodyStates) -> None:
        """Fill the domain with water around the bodies, at time zero."""
        self._time = 0.0
        self.simulation.initialise(states)

    def exchange(self, states: BodyStates, time: float, step: float) -> Floats:
        """Advance one step; return the impulses on the bodies [N s, N m s], shape (K, 6)."""
        self._time = time + step
        out: Floats = self.simulation.exchange(states, time, step)
        return out

    def surface(self, position: Array) -> Sea:
        """Return the height of the water surface over points, as last updated."""
        heights = self.simulation.surface(np.asarray(position, dtype=float), self._time)
        return Sea(heights[:, None], None, None, None, None)

    def momentum_balance(self) -> MomentumBalance | None:
        """Return the momentum balance of the last step."""
        out: MomentumBalance | None = self.simulation.last
        return out

    def diagnostics(self) -> Mapping[str, float]:
        """Return diagnostics: particle count, compression, added and lost particles, gauges."""
        out: Mapping[str, float] = self.simulation.diagnostics()
        return out

    def particles(self) -> tuple[Floats, Floats]:
        """Return positions [m] and velocities [m/s], shape (n, 3) each."""
        return self.simulation.water.positions(), self.simulation.water.velocities()

    def snapshot(self) -> Any:
        """Return a copy of the complete state."""
        return self._time, self.simulation.snapshot()

    def restore(self, kept: Any) -> None:
        """Restore a snapshot."""
        self._time, state = kept
        self.simulation.restore(state)

    def close(self) -> None:
        """Free the memory."""
        if self._simulation is not None:
            self._simulation.water.close()
            self._simulation = None
