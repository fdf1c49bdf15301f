"""Options of the position-based fluid solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from seals.plugins.fluids.solver import Domain
from seals.plugins.fluids.solvers.device_settings import DeviceSettings
from seals.schema import count, setting

if TYPE_CHECKING:
    from seals.plugins.fluids.solvers.device_solver import DeviceSolver


@dataclass(kw_only=True)
class PbfSettings(DeviceSettings):
    """Physics and numerics of the position-based fluid (PBF, XPBD with compliance).

    Args:
        iterations: density iterations a substep; the most allowed when ``tolerance`` is set.
        tolerance: residual mean compression at which iterations stop [1]; 0 runs a fixed count.
        warm_start: share of the last substep's multipliers that a substep starts from [1].
    """

    iterations: int = count(4, bounds=(1, 1000))
    tolerance: float = setting(0.0, "1", bounds=(0.0, 0.1), source="chosen")
    warm_start: float = setting(0.0, "1", bounds=(0.0, 1.0), source="chosen")

    def build(self, domain: Domain, *, device: str, threads: int) -> DeviceSolver:
        """Allocate the solver, see `SolverSettings.build`; Taichi starts with the first one."""
        from seals.plugins.fluids.solvers.pbf.engine import Engine
        from seals.plugins.fluids.solvers.pbf.solver import SolverPbf

        return SolverPbf(domain, settings=self, engine=Engine(device=device, threads=threads))
