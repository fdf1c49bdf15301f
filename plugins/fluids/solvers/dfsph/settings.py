"""Options of divergence-free SPH."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from seals.errors import ConfigError
from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_settings import DeviceSettings, Kernel
from seals.schema import check_tree, count, setting

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.device_solver import DeviceSolver


@dataclass(kw_only=True)
class DfsphOptions:
    """Options that divergence-free SPH has besides those that all solvers share.

    Args:
        compression: mean compression predicted for the end of a substep at which the iterations of
            the density stop [1].
        divergence: mean change of the density in a substep by the divergence of the velocities at
            which their iterations stop [1]; 0 leaves the divergence alone.
        iterations: most iterations of each of the two in a substep.
        courant: largest way of the fastest particle or body in a substep [1 spacing].
        warm: share of the last substep's pressures that the iterations start from [1].
    """

    compression: float = setting(1e-4, "1", bounds=(1e-5, 0.1), source="Bender, Koschier 2015")
    divergence: float = setting(1e-4, "1", bounds=(0.0, 0.1), source="measured on waves")
    iterations: int = count(100, bounds=(2, 10_000))
    courant: float = setting(0.4, "1", bounds=(0.05, 1.0), source="Bender, Koschier 2015")
    warm: float = setting(1.0, "1", bounds=(0.0, 1.0), source="measured")

    def __post_init__(self) -> None:
        """Refuse what the fields do not allow, as the reading of a configuration does."""
        check_tree(self, where="dfsph")


@dataclass(kw_only=True)
class DfsphSettings(DeviceSettings):
    """Physics and numerics of divergence-free smoothed-particle hydrodynamics (DFSPH).

    Args:
        own: options of this solver.
    """

    own: DfsphOptions = field(default_factory=DfsphOptions)

    def __post_init__(self) -> None:
        """Check the kernel.

        Raises:
            ConfigError: a kernel with which the pressures run away.
        """
        super().__post_init__()
        if self.kernel is not Kernel.spline:
            raise ConfigError(
                f"fluid.physics.kernel={self.kernel.value} is unstable with fluid.solver=dfsph: "
                "the water is compressed by a quarter.\nUse fluid.physics.kernel=spline."
            )

    @classmethod
    def of(cls, shared: DeviceSettings, own: DfsphOptions) -> DfsphSettings:
        """Return these options with what all solvers share from another one's."""
        names = [f.name for f in fields(DeviceSettings)]
        return cls(own=own, **{name: getattr(shared, name) for name in names})

    def build(self, domain: Domain, *, device: str, threads: int) -> DeviceSolver:
        """Allocate the solver, see `SolverSettings.build`; Taichi starts with the first one."""
        from seals.plugins.fluids.solvers.dfsph.solver import SolverDfsph
        from seals.plugins.fluids.solvers.pbf.engine import Engine

        return SolverDfsph(domain, settings=self, engine=Engine(device=device, threads=threads))
